// The page's side of the 3D view: hands the canvas to its worker and passes on what hands do.
import type { ChunkData } from "../client";
import type { Shading, Theme, ViewEvent, ViewMessage } from "../view/protocol";

type Stats = Extract<ViewEvent, { type: "stats" }>;
type Hit = Extract<ViewEvent, { type: "picked" }>["hit"];

/** A press that moves less is a click [CSS pixels]. */
const CLICK_PIXELS = 4;

export class View {
  onPick: (hit: Hit) => void = () => {};
  onFollow: (on: boolean) => void = () => {};
  onFailure: (message: string) => void = () => {};
  /** The view was lost and is back, empty. */
  onRestored: () => void = () => {};
  readonly #canvas: HTMLCanvasElement;
  readonly #worker: Worker;
  readonly #pending = new Map<number, (event: ViewEvent) => void>();
  #next = 1;
  #ratio = 1;

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    this.#worker = new Worker(new URL("../view/worker.ts", import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }: MessageEvent<ViewEvent>) => this.#receive(data);
    if ("transferControlToOffscreen" in canvas) {
      const offscreen = canvas.transferControlToOffscreen();
      this.send({ type: "canvas", canvas: offscreen }, [offscreen]);
    } else {
      queueMicrotask(() => this.onFailure("this browser offers no canvas for workers (OffscreenCanvas)"));
    }
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement!);
    this.#resize();
    this.#hands();
  }

  send(message: ViewMessage, moved: Transferable[] = []): void {
    this.#worker.postMessage(message, moved);
  }

  chunks(chunks: ChunkData[], bounds: number[] | null): void {
    const moved = chunks.flatMap((c) => [c.vertices.buffer as ArrayBuffer, c.indices.buffer as ArrayBuffer]);
    this.send({ type: "chunks", chunks, bounds }, moved);
  }

  shading(shading: Shading): void {
    this.send({ type: "shading", shading });
  }

  theme(theme: Theme): void {
    this.send({ type: "theme", theme });
  }

  /** What is under a place of the canvas, in CSS pixels. */
  pick(x: number, y: number): Promise<Hit> {
    const ask = (id: number) => this.send({ type: "pick", id, x: x * this.#ratio, y: y * this.#ratio });
    return this.#ask(ask).then((event) => (event.type === "picked" ? event.hit : null));
  }

  stats(): Promise<Stats> {
    return this.#ask((id) => this.send({ type: "stats", id })).then((event) => event as Stats);
  }

  #ask(send: (id: number) => void): Promise<ViewEvent> {
    const id = this.#next++;
    return new Promise((resolve) => {
      this.#pending.set(id, resolve);
      send(id);
    });
  }

  #receive(event: ViewEvent): void {
    if (event.type === "unsupported") this.onFailure(event.message);
    if (event.type === "lost") this.onFailure("the browser took the 3D view's context away; it comes back when the browser allows");
    if (event.type === "restored") {
      this.#resize();
      this.onRestored();
    }
    if (event.type === "followed") this.onFollow(event.on);
    if ("id" in event) {
      this.#pending.get(event.id)?.(event);
      this.#pending.delete(event.id);
    }
  }

  #resize(): void {
    const place = this.#canvas.parentElement!;
    // More than about 5 megapixels cost time and show no more.
    const area = Math.max(1, place.clientWidth * place.clientHeight);
    this.#ratio = Math.min(devicePixelRatio || 1, 2, Math.sqrt(5e6 / area));
    const [width, height] = [place.clientWidth, place.clientHeight].map((n) => Math.round(n * this.#ratio));
    this.send({ type: "size", width: width!, height: height! });
  }

  #hands(): void {
    const canvas = this.#canvas;
    const pointers = new Map<number, { x: number; y: number }>();
    let moved = 0;
    let spread = 0;
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      pointers.set(e.pointerId, { x: e.offsetX, y: e.offsetY });
      if (pointers.size === 1) moved = 0;
      spread = 0;
    });
    canvas.addEventListener("pointermove", (e) => {
      const last = pointers.get(e.pointerId);
      if (!last) return;
      const [dx, dy] = [e.offsetX - last.x, e.offsetY - last.y];
      moved += Math.abs(dx) + Math.abs(dy);
      pointers.set(e.pointerId, { x: e.offsetX, y: e.offsetY });
      if (pointers.size >= 2) {
        const [a, b] = [...pointers.values()] as [{ x: number; y: number }, { x: number; y: number }];
        const now = Math.hypot(a.x - b.x, a.y - b.y);
        if (spread > 0 && now > 0) this.send({ type: "zoom", factor: spread / now });
        spread = now;
        this.send({ type: "pan", dx: (dx * this.#ratio) / 2, dy: (dy * this.#ratio) / 2 });
      } else if (e.buttons & 2 || e.buttons & 4 || e.shiftKey) {
        this.send({ type: "pan", dx: dx * this.#ratio, dy: dy * this.#ratio });
      } else {
        this.send({ type: "orbit", dx, dy });
      }
    });
    const release = (e: PointerEvent) => {
      const was = pointers.delete(e.pointerId);
      if (was && e.type === "pointerup" && pointers.size === 0 && moved < CLICK_PIXELS && e.button === 0)
        void this.pick(e.offsetX, e.offsetY).then((hit) => this.onPick(hit));
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      const lines = e.deltaMode === 1 ? 16 : 1;
      this.send({ type: "zoom", factor: Math.exp(Math.max(-200, Math.min(200, e.deltaY * lines)) * 0.0012) });
    }, { passive: false });
    canvas.addEventListener("keydown", (e) => {
      const turns: Record<string, [number, number]> = {
        ArrowLeft: [-24, 0], ArrowRight: [24, 0], ArrowUp: [0, -24], ArrowDown: [0, 24],
      };
      const turn = turns[e.key];
      if (turn) this.send({ type: e.shiftKey ? "pan" : "orbit", dx: turn[0], dy: turn[1] });
      else if (e.key === "+" || e.key === "=") this.send({ type: "zoom", factor: 0.85 });
      else if (e.key === "-") this.send({ type: "zoom", factor: 1 / 0.85 });
      else if (e.key === "Enter") void this.pick(canvas.clientWidth / 2, canvas.clientHeight / 2).then((hit) => this.onPick(hit));
      else return;
      e.preventDefault();
    });
  }
}
