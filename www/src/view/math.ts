// The little linear algebra that a viewer needs. Matrices are column-major, as WebGL takes them.
export type Vec3 = [number, number, number];
export type Mat4 = Float32Array;

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const unit = (a: Vec3): Vec3 => scale(a, 1 / Math.max(length(a), 1e-12));

/** A direction across `up`, the same for the same `up`. */
export function across(up: Vec3): Vec3 {
  const other: Vec3 = Math.abs(up[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0];
  return unit(sub(other, scale(up, dot(other, up))));
}

export function perspective(fovY: number, aspect: number, near: number, far: number): Mat4 {
  const f = 1 / Math.tan(fovY / 2);
  const m = new Float32Array(16);
  m[0] = f / aspect;
  m[5] = f;
  m[10] = (far + near) / (near - far);
  m[11] = -1;
  m[14] = (2 * far * near) / (near - far);
  return m;
}

export function lookAt(eye: Vec3, target: Vec3, up: Vec3): Mat4 {
  const z = unit(sub(eye, target));
  const x = unit(cross(up, z));
  const y = cross(z, x);
  return new Float32Array([
    x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
    -dot(x, eye), -dot(y, eye), -dot(z, eye), 1,
  ]);
}

export function multiply(a: Mat4, b: Mat4): Mat4 {
  const m = new Float32Array(16);
  for (let c = 0; c < 4; c++)
    for (let r = 0; r < 4; r++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + r]! * b[4 * c + k]!;
      m[4 * c + r] = sum;
    }
  return m;
}

/** The inverse; the zero matrix for a singular one. */
export function inverse(m: Mat4): Mat4 {
  const a = Array.from(m);
  const out: number[] = Array.from({ length: 16 }, (_, i) => (i % 5 === 0 ? 1 : 0));
  for (let c = 0; c < 4; c++) {
    let pivot = c;
    for (let r = c + 1; r < 4; r++)
      if (Math.abs(a[4 * c + r]!) > Math.abs(a[4 * c + pivot]!)) pivot = r;
    const p = a[4 * c + pivot]!;
    if (Math.abs(p) < 1e-20) return new Float32Array(16);
    for (let k = 0; k < 4; k++) {
      [a[4 * k + c], a[4 * k + pivot]] = [a[4 * k + pivot]!, a[4 * k + c]!];
      [out[4 * k + c], out[4 * k + pivot]] = [out[4 * k + pivot]!, out[4 * k + c]!];
    }
    for (let k = 0; k < 4; k++) {
      a[4 * k + c]! /= p;
      out[4 * k + c]! /= p;
    }
    for (let r = 0; r < 4; r++) {
      if (r === c) continue;
      const f = a[4 * c + r]!;
      for (let k = 0; k < 4; k++) {
        a[4 * k + r]! -= f * a[4 * k + c]!;
        out[4 * k + r]! -= f * out[4 * k + c]!;
      }
    }
  }
  return new Float32Array(out);
}

export function transform(m: Mat4, p: Vec3): Vec3 {
  const w = m[3]! * p[0] + m[7]! * p[1] + m[11]! * p[2] + m[15]!;
  const row = (r: number) => m[r]! * p[0] + m[4 + r]! * p[1] + m[8 + r]! * p[2] + m[12 + r]!;
  return [row(0) / w, row(1) / w, row(2) / w];
}
