// Draws the growing mesh and the camera's path. WebGL 2 and not WebGPU: it is also there where the
// CPU engine is needed, and on a thread of its own it never waits for the mapping.
import type { ChunkData } from "../../pkg/mte_slam_web.js";
import {
  type Mat4, type Vec3, across, add, cross, dot, inverse, length, lookAt, multiply, perspective,
  scale, sub, transform, unit,
} from "./math";
import type { Shading, Theme } from "./protocol";
import { LINE_FRAGMENT, LINE_VERTEX, MESH_FRAGMENT, MESH_VERTEX } from "./shaders";

const VERTEX_BYTES = 20;
const FOV_Y = (50 * Math.PI) / 180;
const SHADINGS: Shading[] = ["color", "class", "normal", "depth"];

interface Chunk {
  array: WebGLVertexArrayObject;
  vertices: WebGLBuffer;
  indices: WebGLBuffer;
  count: number;
  bytes: number;
  low: Vec3;
  high: Vec3;
}

interface Lines {
  array: WebGLVertexArrayObject;
  buffer: WebGLBuffer;
  count: number;
}

class Program {
  readonly #gl: WebGL2RenderingContext;
  readonly #places = new Map<string, WebGLUniformLocation | null>();
  readonly handle: WebGLProgram;

  constructor(gl: WebGL2RenderingContext, vertex: string, fragment: string) {
    this.#gl = gl;
    this.handle = gl.createProgram()!;
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.handle, shader);
    }
    gl.linkProgram(this.handle);
    if (!gl.getProgramParameter(this.handle, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`the viewer's shader: ${gl.getProgramInfoLog(this.handle)}`);
  }

  at(name: string): WebGLUniformLocation | null {
    if (!this.#places.has(name)) this.#places.set(name, this.#gl.getUniformLocation(this.handle, name));
    return this.#places.get(name)!;
  }
}

/** The viewer's state and pictures. `changed` is set when a new picture is due. */
export class Renderer {
  changed = true;
  frames = 0;
  follow = false;
  truthShown = true;
  shading: Shading = "color";
  readonly #gl: WebGL2RenderingContext;
  readonly #mesh: Program;
  readonly #line: Program;
  readonly #classes: WebGLTexture;
  readonly #chunks = new Map<string, Chunk>();
  readonly #path: Lines;
  readonly #truth: Lines;
  readonly #sensor: Lines;
  readonly #box: Lines;
  #width = 1;
  #height = 1;
  #highlight = -1;
  #theme: Theme = {
    background: [0.06, 0.07, 0.08], grid: [0.3, 0.34, 0.36], path: [0.3, 0.8, 0.7],
    truth: [0.95, 0.65, 0.3], dark: true,
  };
  // The orbit: around `target`, at `distance`, turned by angles about `up`.
  #target: Vec3 = [0, 0, 0];
  #distance = 5;
  #turn = 0.7;
  #lift = 0.75;
  /** The turn that shows what the sensor saw first, from its side. */
  #home: number | undefined;
  #up: Vec3 = [0, 0, 1];
  #upSum: Vec3 = [0, 0, 0];
  #touched = false;
  #pose: number[] | undefined;
  #bounds: number[] | undefined;
  #picture: { frame: WebGLFramebuffer; color: WebGLRenderbuffer; depth: WebGLRenderbuffer; width: number; height: number } | undefined;

  constructor(canvas: OffscreenCanvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser offers no WebGL 2");
    this.#gl = gl;
    this.#mesh = new Program(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.#line = new Program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.#classes = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_2D, this.#classes);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.classes(new Uint8Array(), [], -1);
    this.#path = this.#lines();
    this.#truth = this.#lines();
    this.#sensor = this.#lines();
    this.#box = this.#lines();
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  size(width: number, height: number): void {
    this.#width = Math.max(1, width);
    this.#height = Math.max(1, height);
    const canvas = this.#gl.canvas;
    if (canvas.width !== this.#width || canvas.height !== this.#height) {
      canvas.width = this.#width;
      canvas.height = this.#height;
    }
    if (!this.#touched && !this.follow) this.#frame();
    this.changed = true;
  }

  theme(theme: Theme): void {
    this.#theme = theme;
    this.changed = true;
  }

  reset(): void {
    for (const key of [...this.#chunks.keys()]) this.#drop(key);
    for (const lines of [this.#path, this.#truth, this.#sensor, this.#box]) lines.count = 0;
    this.#pose = this.#bounds = undefined;
    this.#upSum = [0, 0, 0];
    this.#up = [0, 0, 1];
    this.#touched = false;
    this.#home = undefined;
    this.#turn = 0.7;
    this.#lift = 0.75;
    this.follow = false;
    this.changed = true;
  }

  chunks(chunks: ChunkData[], bounds: number[] | null): void {
    const gl = this.#gl;
    for (const chunk of chunks) {
      this.#drop(chunk.key);
      const count = chunk.indices.byteLength / 4;
      if (count === 0) continue;
      const array = gl.createVertexArray()!;
      const vertices = gl.createBuffer()!;
      const indices = gl.createBuffer()!;
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
      gl.bufferData(gl.ARRAY_BUFFER, chunk.vertices, gl.STATIC_DRAW);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, chunk.indices, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, VERTEX_BYTES, 0);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribPointer(1, 3, gl.BYTE, true, VERTEX_BYTES, 12);
      gl.enableVertexAttribArray(2);
      gl.vertexAttribPointer(2, 4, gl.UNSIGNED_BYTE, true, VERTEX_BYTES, 16);
      gl.bindVertexArray(null);
      const low: Vec3 = [Infinity, Infinity, Infinity];
      const high: Vec3 = [-Infinity, -Infinity, -Infinity];
      const view = new DataView(chunk.vertices.buffer, chunk.vertices.byteOffset, chunk.vertices.byteLength);
      for (let at = 0; at < view.byteLength; at += VERTEX_BYTES)
        for (let k = 0; k < 3; k++) {
          const x = view.getFloat32(at + 4 * k, true);
          low[k] = Math.min(low[k]!, x);
          high[k] = Math.max(high[k]!, x);
        }
      const bytes = chunk.vertices.byteLength + chunk.indices.byteLength;
      this.#chunks.set(chunk.key, { array, vertices, indices, count, bytes, low, high });
    }
    if (bounds) {
      this.#bounds = bounds;
      this.#fill(this.#box, boxEdges(bounds));
    }
    if (!this.#touched && !this.follow) this.#frame();
    this.changed = true;
  }

  path(positions: Uint8Array): void {
    this.#fill(this.#path, segments(positions));
    this.changed = true;
  }

  truth(positions: Uint8Array): void {
    this.#fill(this.#truth, segments(positions));
    this.changed = true;
  }

  /** The sensor's pose, row-major `world_from_camera`. */
  pose(m: number[], aspect: number, focal: number): void {
    this.#pose = m;
    const at = (p: Vec3): Vec3 => [
      m[0]! * p[0] + m[1]! * p[1] + m[2]! * p[2] + m[3]!,
      m[4]! * p[0] + m[5]! * p[1] + m[6]! * p[2] + m[7]!,
      m[8]! * p[0] + m[9]! * p[1] + m[10]! * p[2] + m[11]!,
    ];
    const z = 0.22;
    const [w, h] = [(z * aspect) / focal, z / focal];
    const corners = ([[-w, -h, z], [w, -h, z], [w, h, z], [-w, h, z]] as Vec3[]).map(at);
    const tip = at([0, 0, 0]);
    const out: Vec3[] = [];
    corners.forEach((c, i) => out.push(tip, c, c, corners[(i + 1) % 4]!));
    // A mark on the upper edge.
    out.push(at([-w * 0.4, -h * 1.12, z]), at([0, -h * 1.5, z]), at([0, -h * 1.5, z]), at([w * 0.4, -h * 1.12, z]));
    this.#fill(this.#sensor, new Float32Array(out.flat()));
    // People hold cameras upright on the whole: the mean of "up" in the pictures is up in the
    // world, and exactly an axis when it is nearly one.
    this.#upSum = sub(this.#upSum, [m[1]!, m[5]!, m[9]!]);
    const up = unit(this.#upSum);
    const axis = [0, 1, 2].find((k) => Math.abs(up[k]!) > 0.92);
    const snapped: Vec3 = [0, 0, 0];
    if (axis !== undefined) snapped[axis] = Math.sign(up[axis]!);
    this.#up = axis === undefined ? up : snapped;
    if (this.#home === undefined) {
      // Surfaces are drawn on the side that was seen, so the first look is from there, a little
      // to the side.
      const forward = across(this.#up);
      const away: Vec3 = [-m[2]!, -m[6]!, -m[10]!];
      this.#home = Math.atan2(dot(away, cross(this.#up, forward)), dot(away, forward)) + 0.4;
      if (!this.#touched) this.#turn = this.#home;
    }
    this.changed = true;
  }

  classes(colors: Uint8Array, visible: boolean[], highlight: number): void {
    const gl = this.#gl;
    const table = new Uint8Array(256 * 4).fill(255);
    table.set([150, 156, 160, 255], 255 * 4);
    for (let i = 0; i < colors.length / 3; i++)
      table.set([colors[3 * i]!, colors[3 * i + 1]!, colors[3 * i + 2]!, visible[i] === false ? 0 : 255], 4 * i);
    // Index 255, surfaces without a class, can be hidden by the entry after the last class.
    if (visible[colors.length / 3] === false) table[255 * 4 + 3] = 0;
    gl.bindTexture(gl.TEXTURE_2D, this.#classes);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
    this.#highlight = highlight;
    this.changed = true;
  }

  orbit(dx: number, dy: number): void {
    this.#take();
    this.#turn -= dx * 0.006;
    this.#lift = Math.min(1.54, Math.max(-1.54, this.#lift + dy * 0.006));
  }

  pan(dx: number, dy: number): void {
    this.#take();
    const { right, upward } = this.#axes();
    const metres = (2 * this.#distance * Math.tan(FOV_Y / 2)) / this.#height;
    this.#target = add(this.#target, add(scale(right, -dx * metres), scale(upward, dy * metres)));
  }

  zoom(factor: number): void {
    this.#take();
    this.#distance = Math.min(200, Math.max(0.2, this.#distance * factor));
  }

  /** Shows everything and keeps doing so while the map grows. */
  fit(): void {
    this.#touched = this.follow = false;
    this.#turn = this.#home ?? 0.7;
    this.#lift = 0.75;
    this.#frame();
    this.changed = true;
  }

  /** The class and point under a pixel. */
  pick(x: number, y: number): { class: number; point: Vec3 } | null {
    const gl = this.#gl;
    this.#offscreen();
    const row = this.#height - 1 - Math.round(y);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(Math.round(x), row, 1, 1);
    gl.clearColor(0, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
    const matrix = this.#matrix();
    this.#drawMesh(matrix, true);
    const pixel = new Uint8Array(4);
    gl.readPixels(Math.round(x), row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.enable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const depth = ((pixel[1]! << 16) | (pixel[2]! << 8) | pixel[3]!) / 16777215;
    if (depth >= 1) return null;
    const clip: Vec3 = [(2 * x) / this.#width - 1, 1 - (2 * y) / this.#height, 2 * depth - 1];
    return { class: pixel[0]!, point: transform(inverse(matrix), clip) };
  }

  /** Figures for tests and the status line, from the picture as drawn. */
  stats(): { triangles: number; chunks: number; covered: number; mean: Vec3; eye: Vec3; bytes: number } {
    const gl = this.#gl;
    this.#offscreen();
    this.#scene();
    const pixels = new Uint8Array(this.#width * this.#height * 4);
    gl.readPixels(0, 0, this.#width, this.#height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const back = this.#theme.background.map((x) => Math.round(x * 255));
    let covered = 0;
    const sum: Vec3 = [0, 0, 0];
    for (let i = 0; i < pixels.length; i += 4) {
      let off = 0;
      for (let k = 0; k < 3; k++) {
        off += Math.abs(pixels[i + k]! - back[k]!);
        sum[k]! += pixels[i + k]!;
      }
      if (off > 12) covered++;
    }
    const n = pixels.length / 4;
    let triangles = 0;
    let bytes = 0;
    for (const chunk of this.#chunks.values()) {
      triangles += chunk.count / 3;
      bytes += chunk.bytes;
    }
    const mean = scale(sum, 1 / n);
    return { triangles, chunks: this.#chunks.size, covered: covered / n, mean, eye: this.#eye().eye, bytes };
  }

  /** Takes the context away as a browser short of memory does, and gives it back. */
  async loseContext(): Promise<void> {
    const extension = this.#gl.getExtension("WEBGL_lose_context");
    extension?.loseContext();
    await new Promise((resolve) => setTimeout(resolve, 200));
    extension?.restoreContext();
  }

  draw(): void {
    this.#gl.bindFramebuffer(this.#gl.FRAMEBUFFER, null);
    this.#scene();
    this.frames++;
    this.changed = false;
  }

  #scene(): void {
    const gl = this.#gl;
    const [r, g, b] = this.#theme.background;
    gl.viewport(0, 0, this.#width, this.#height);
    gl.clearColor(r, g, b, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const matrix = this.#matrix();
    this.#drawLines(matrix, this.#box, [...this.#theme.grid, 0.55], 1);
    this.#drawMesh(matrix, false);
    // Through walls the path shows faintly.
    gl.disable(gl.DEPTH_TEST);
    if (this.truthShown) this.#drawLines(matrix, this.#truth, [...this.#theme.truth, 0.25], 1.5);
    this.#drawLines(matrix, this.#path, [...this.#theme.path, 0.35], 2.5);
    gl.enable(gl.DEPTH_TEST);
    if (this.truthShown) this.#drawLines(matrix, this.#truth, [...this.#theme.truth, 0.9], 1.5);
    this.#drawLines(matrix, this.#path, [...this.#theme.path, 1], 2.5);
    this.#drawLines(matrix, this.#sensor, [...this.#theme.path, 1], 2);
  }

  #drawMesh(matrix: Mat4, picking: boolean): void {
    const gl = this.#gl;
    const p = this.#mesh;
    gl.useProgram(p.handle);
    gl.uniformMatrix4fv(p.at("clipFromWorld"), false, matrix);
    const { eye } = this.#eye();
    gl.uniform3fv(p.at("eye"), eye);
    gl.uniform3fv(p.at("light"), unit(add(scale(this.#up, 1), scale(unit(sub(eye, this.#target)), 0.8))));
    gl.uniform1i(p.at("shading"), SHADINGS.indexOf(this.shading));
    gl.uniform1i(p.at("highlight"), this.#highlight);
    gl.uniform1f(p.at("reach"), this.#distance * 1.8);
    gl.uniform1i(p.at("picking"), picking ? 1 : 0);
    gl.uniform1i(p.at("classes"), 0);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.#classes);
    // Triangles face free space: seen from behind, a wall gives way to the room.
    gl.enable(gl.CULL_FACE);
    for (const chunk of this.#chunks.values()) {
      gl.bindVertexArray(chunk.array);
      gl.drawElements(gl.TRIANGLES, chunk.count, gl.UNSIGNED_INT, 0);
    }
    gl.disable(gl.CULL_FACE);
    gl.bindVertexArray(null);
  }

  #drawLines(matrix: Mat4, lines: Lines, color: number[], width: number): void {
    if (lines.count === 0) return;
    const gl = this.#gl;
    const p = this.#line;
    gl.useProgram(p.handle);
    gl.uniformMatrix4fv(p.at("clipFromWorld"), false, matrix);
    gl.uniform2f(p.at("viewport"), this.#width, this.#height);
    gl.uniform1f(p.at("width"), width * Math.max(1, this.#height / 900));
    gl.uniform4fv(p.at("color"), color);
    gl.bindVertexArray(lines.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
    gl.bindVertexArray(null);
  }

  #lines(): Lines {
    const gl = this.#gl;
    const array = gl.createVertexArray()!;
    const buffer = gl.createBuffer()!;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const place of [0, 1]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, 12 * place);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.bindVertexArray(null);
    return { array, buffer, count: 0 };
  }

  #fill(lines: Lines, data: Float32Array): void {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, lines.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    lines.count = data.length / 6;
  }

  #drop(key: string): void {
    const chunk = this.#chunks.get(key);
    if (!chunk) return;
    this.#gl.deleteVertexArray(chunk.array);
    this.#gl.deleteBuffer(chunk.vertices);
    this.#gl.deleteBuffer(chunk.indices);
    this.#chunks.delete(key);
  }

  /** From now on the user holds the camera. */
  #take(): void {
    if (this.follow && this.#pose) {
      const { eye, target } = this.#eye();
      this.#target = target;
      const back = sub(eye, target);
      this.#distance = length(back);
      const forward = across(this.#up);
      const side = cross(this.#up, forward);
      this.#lift = Math.asin(dot(back, this.#up) / this.#distance);
      this.#turn = Math.atan2(dot(back, side), dot(back, forward));
    }
    this.follow = false;
    this.#touched = true;
    this.changed = true;
  }

  #axes(): { right: Vec3; upward: Vec3 } {
    const { eye, target } = this.#eye();
    const forward = unit(sub(target, eye));
    const right = unit(cross(forward, this.#up));
    return { right, upward: cross(right, forward) };
  }

  #eye(): { eye: Vec3; target: Vec3 } {
    const m = this.#pose;
    if (this.follow && m) {
      const at: Vec3 = [m[3]!, m[7]!, m[11]!];
      const forward: Vec3 = [m[2]!, m[6]!, m[10]!];
      const eye = add(at, add(scale(forward, -0.9), scale(this.#up, 0.35)));
      return { eye, target: add(at, scale(forward, 1.6)) };
    }
    const forward = across(this.#up);
    const side = cross(this.#up, forward);
    const flat = add(scale(forward, Math.cos(this.#turn)), scale(side, Math.sin(this.#turn)));
    const away = add(scale(flat, Math.cos(this.#lift)), scale(this.#up, Math.sin(this.#lift)));
    return { eye: add(this.#target, scale(away, this.#distance)), target: this.#target };
  }

  #matrix(): Mat4 {
    const { eye, target } = this.#eye();
    const far = Math.max(60, this.#distance * 6);
    const near = Math.max(0.02, this.#distance * 0.01);
    return multiply(
      perspective(FOV_Y, this.#width / this.#height, near, far),
      lookAt(eye, target, this.#up),
    );
  }

  /** Puts the whole mesh (or the box, before there is one) into view. */
  #frame(): void {
    const low: Vec3 = [Infinity, Infinity, Infinity];
    const high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const chunk of this.#chunks.values())
      for (let k = 0; k < 3; k++) {
        low[k] = Math.min(low[k]!, chunk.low[k]!);
        high[k] = Math.max(high[k]!, chunk.high[k]!);
      }
    if (!(low[0] <= high[0])) {
      if (!this.#bounds) return;
      for (let k = 0; k < 3; k++) {
        low[k] = this.#bounds[k]!;
        high[k] = this.#bounds[3 + k]!;
      }
    }
    this.#target = scale(add(low, high), 0.5);
    const radius = length(sub(high, low)) / 2;
    const narrow = Math.min(1, this.#width / this.#height);
    this.#distance = Math.max(0.8, radius / Math.sin(FOV_Y / 2) / narrow);
  }

  /** A picture of the canvas's size that can be read back; the canvas itself may be multisampled. */
  #offscreen(): void {
    const gl = this.#gl;
    const old = this.#picture;
    if (old && old.width === this.#width && old.height === this.#height) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, old.frame);
    } else {
      if (old) {
        gl.deleteFramebuffer(old.frame);
        gl.deleteRenderbuffer(old.color);
        gl.deleteRenderbuffer(old.depth);
      }
      const [frame, color, depth] = [gl.createFramebuffer()!, gl.createRenderbuffer()!, gl.createRenderbuffer()!];
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.bindRenderbuffer(gl.RENDERBUFFER, color);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, this.#width, this.#height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, color);
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, this.#width, this.#height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
      this.#picture = { frame, color, depth, width: this.#width, height: this.#height };
    }
    gl.viewport(0, 0, this.#width, this.#height);
  }
}

/** Pairs of neighbouring points of a path; unknown points break it. */
function segments(bytes: Uint8Array): Float32Array {
  const p = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.byteLength / 4);
  const out: number[] = [];
  for (let i = 3; i < p.length; i += 3) {
    const part = Array.from(p.subarray(i - 3, i + 3));
    if (part.every(Number.isFinite)) out.push(...part);
  }
  return new Float32Array(out);
}

function boxEdges(b: number[]): Float32Array {
  const corner = (i: number): Vec3 => [b[i & 1 ? 3 : 0]!, b[i & 2 ? 4 : 1]!, b[i & 4 ? 5 : 2]!];
  const out: number[] = [];
  for (let i = 0; i < 8; i++)
    for (const bit of [1, 2, 4]) if (!(i & bit)) out.push(...corner(i), ...corner(i | bit));
  return new Float32Array(out);
}
