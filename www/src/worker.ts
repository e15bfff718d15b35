// The engine's thread: takes commands in order, processes frames while running, posts events.
import init, { Session, configuration, version, type Command, type Event as SlamEvent } from "../pkg/mte_slam_web.js";
import { put, state } from "./keep";
import wasmUrl from "../pkg/mte_slam_web_bg.wasm?url";

/** A run whose state is kept now and then. */
export interface Keep {
  /** Names the run, for going on with it. */
  id: string;
  /** Kept with it, for the page; must be cloneable. */
  about?: unknown;
  /** Go on from the state that is kept. */
  resume?: boolean;
}

/** What the worker posts beside the session's events. */
export type WorkerEvent =
  | Exclude<SlamEvent, { type: "saved" }>
  /** A state was kept; `bytes` only where the browser's database would not have it, and why. */
  | { type: "saved"; id: string; frame: number; frames: number; size: number; bytes?: Uint8Array; why?: string }
  | { type: "ready"; version: string; config: Record<string, unknown> }
  | { type: "state"; running: boolean; open: boolean }
  | { type: "answered"; id: number; ok: boolean }
  | { type: "crashed"; message: string };

/** What the worker is sent: a command and a number for its answer. */
export type WorkerMessage = { id: number; command: Command; keep?: Keep };

const scope = self as unknown as DedicatedWorkerGlobalScope;
const queue: WorkerMessage[] = [];
let session: Session | undefined;
let running = false;
let open = false;
let busy = false;
let keep: Keep | undefined;
/** States are written one after the other. */
let writing: Promise<void> = Promise.resolve();

/** Buffers of an event; they move to the page instead of being copied. */
function buffers(value: unknown, found: ArrayBuffer[] = []): ArrayBuffer[] {
  if (value instanceof Uint8Array) found.push(value.buffer as ArrayBuffer);
  else if (Array.isArray(value)) for (const item of value) buffers(item, found);
  else if (value && typeof value === "object")
    for (const item of Object.values(value)) buffers(item, found);
  return found;
}

function post(event: WorkerEvent): void {
  const moved = event.type === "map" || "color" in event || "bytes" in event || "positions" in event;
  scope.postMessage(event, moved || event.type === "opened" ? buffers(event) : []);
}

/** Puts a state into the browser's database, or hands it to the page. */
async function store({ id, about }: Keep, frame: number, frames: number, bytes: Uint8Array): Promise<void> {
  const size = bytes.byteLength;
  try {
    await put({ id, at: Date.now(), frame, frames, size, about }, bytes);
    post({ type: "saved", id, frame, frames, size });
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    post({ type: "saved", id, frame, frames, size, bytes, why });
  }
}

function hear(event: SlamEvent): void {
  if (event.type !== "saved") return post(event);
  const run = keep;
  if (run) writing = writing.then(() => store(run, event.frame, event.frames, event.bytes));
}

/** Lets messages that wait be received. */
function turn(): Promise<void> {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}

async function follow({ id, command, keep: wanted }: WorkerMessage): Promise<void> {
  if (command.type === "open") {
    await writing;
    keep = wanted;
    command.keep = keep !== undefined;
    if (keep?.resume && !command.resume) command.resume = await state(keep.id).catch(() => undefined);
    if (keep?.resume && !command.resume) {
      post({ type: "error", kind: "command", message: "nothing is kept of this run", resumable: false });
      open = running = false;
      post({ type: "state", running, open });
      return post({ type: "answered", id, ok: false });
    }
  }
  const ok = await session!.handle(command);
  // Whoever asked for a state may go once it is kept.
  if (command.type === "save") await writing;
  if (command.type === "open") {
    open = ok;
    running = false;
  } else if (command.type === "start") running = ok;
  else if (command.type === "pause") running = false;
  else if (command.type === "dispose") open = running = false;
  post({ type: "state", running, open });
  post({ type: "answered", id, ok });
}

async function pump(): Promise<void> {
  if (busy || !session) return;
  busy = true;
  try {
    for (;;) {
      const message = queue.shift();
      if (message) {
        await follow(message);
      } else if (running) {
        const more = await session.step();
        if (!more) {
          running = false;
          post({ type: "state", running, open });
        }
        await turn();
      } else break;
    }
    busy = false;
  } catch (error) {
    // A trap inside WebAssembly: its state cannot be trusted any more, so `busy` stays.
    const message = error instanceof Error ? error.message : String(error);
    post({ type: "crashed", message });
  }
}

scope.onmessage = ({ data }: MessageEvent<WorkerMessage>) => {
  // Taken note of at once: the frame under way is the last one.
  if (data.command.type === "pause") running = false;
  queue.push(data);
  void pump();
};

init({ module_or_path: wasmUrl })
  .then(() => {
    session = new Session(hear);
    post({ type: "ready", version: version(), config: configuration({}) });
    return pump();
  })
  .catch((error: unknown) => {
    const message = error instanceof Error ? error.message : String(error);
    post({ type: "crashed", message: `the WebAssembly module did not load: ${message}` });
  });
