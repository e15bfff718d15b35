// The package's front: a SLAM session in a dedicated worker, as typed commands and events.
//
//   import { MteSlam } from "mte-slam";
//   const slam = new MteSlam();
//   slam.on("metrics", (m) => console.log(m.index, m.ateCm));
//   slam.on("map", ({ chunks, triangles }) => draw(chunks, triangles));
//   await slam.open({ kind: "built-in", scene: "room", frames: 60, width: 160, noise: false });
//   slam.start();
import type {
  Command,
  Event as SlamEvent,
  ExportKind,
  ExportedEvent,
  Settings,
  SourceSpec,
  ViewCommand,
} from "../pkg/mte_slam_web.js";
import { type KeptRun, forget, kept } from "./keep";
import type { Keep, WorkerEvent, WorkerMessage } from "./worker";

export type * from "../pkg/mte_slam_web.js";
export type { KeptRun } from "./keep";
export type { Keep, WorkerEvent } from "./worker";

type Named<T extends WorkerEvent["type"]> = Extract<WorkerEvent, { type: T }>;
type Listener = (event: never) => void;

/** One session. Everything is local: nothing is uploaded. */
export class MteSlam {
  #worker: Worker;
  #next = 1;
  #answers = new Map<number, (ok: boolean) => void>();
  #listeners = new Map<string, Set<Listener>>();
  /** The last state, where the browser's database would not have it. */
  #held: { id: string; bytes: Uint8Array } | undefined;

  constructor() {
    this.#worker = this.#start();
  }

  #start(): Worker {
    const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    worker.onmessage = ({ data }: MessageEvent<WorkerEvent>) => this.#receive(data);
    worker.onerror = (event) =>
      this.#receive({ type: "crashed", message: event.message || "the worker did not load" });
    return worker;
  }

  #receive(event: WorkerEvent): void {
    if (event.type === "answered") {
      this.#answers.get(event.id)?.(event.ok);
      this.#answers.delete(event.id);
    }
    if (event.type === "saved") this.#held = event.bytes ? { id: event.id, bytes: event.bytes } : undefined;
    if (event.type === "crashed") {
      for (const answer of this.#answers.values()) answer(false);
      this.#answers.clear();
    }
    for (const listener of this.#listeners.get(event.type) ?? []) (listener as (e: WorkerEvent) => void)(event);
  }

  /** Hears events of a type; the result stops it. */
  on<T extends WorkerEvent["type"]>(type: T, listener: (event: Named<T>) => void): () => void {
    const set = this.#listeners.get(type) ?? new Set();
    this.#listeners.set(type, set.add(listener as Listener));
    return () => set.delete(listener as Listener);
  }

  /** Sends a command; resolves when it was followed (true) or an `error` was emitted (false). */
  send(command: Command, keep?: Keep): Promise<boolean> {
    const id = this.#next++;
    return new Promise((resolve) => {
      this.#answers.set(id, resolve);
      this.#worker.postMessage({ id, command, keep } satisfies WorkerMessage);
    });
  }

  /**
   * Opens a recording. With `keep`, the run's state is kept on this device now and then; with
   * `keep.resume` the run goes on from there, on a new device.
   */
  open(source: SourceSpec, settings: Settings = {}, keep?: Keep): Promise<boolean> {
    const held = keep?.resume && this.#held?.id === keep.id ? this.#held.bytes : undefined;
    return this.send({ type: "open", source, settings, resume: held }, keep);
  }

  /** Runs whose state is kept on this device, the newest first. */
  static kept(): Promise<KeptRun[]> {
    return kept();
  }

  /** Forgets a kept run. */
  static forget(id: string): Promise<void> {
    return forget(id);
  }

  /** Keeps the run's state now. */
  save(): Promise<boolean> {
    return this.send({ type: "save" });
  }

  /** Processes frames until paused or done. */
  start(): Promise<boolean> {
    return this.send({ type: "start" });
  }

  /** Stops after the frame under way. */
  pause(): Promise<boolean> {
    return this.send({ type: "pause" });
  }

  /** Processes one frame. */
  step(): Promise<boolean> {
    return this.send({ type: "step" });
  }

  /** Renders the map from a frame's estimated pose, or any; a `rendered` event follows. */
  seekView(view: ViewCommand): Promise<boolean> {
    return this.send({ type: "seekView", ...view });
  }

  /** Makes a file of the map. */
  async export(kind: ExportKind, resolutionM?: number): Promise<ExportedEvent | undefined> {
    let file: ExportedEvent | undefined;
    const off = this.on("exported", (event) => {
      if (event.kind === kind) file = event;
    });
    await this.send({ type: "export", kind, resolutionM });
    off();
    return file;
  }

  /** Emits path, pose and the whole mesh again, for a view that has lost them. */
  refresh(): Promise<boolean> {
    return this.send({ type: "refresh" });
  }

  /** Ends the worker and makes a new one: the way out of a lost device or a crash. */
  restart(): void {
    this.#worker.terminate();
    for (const answer of this.#answers.values()) answer(false);
    this.#answers.clear();
    this.#worker = this.#start();
  }

  /** Frees everything. */
  dispose(): void {
    this.#worker.terminate();
  }
}

export type { SlamEvent };
