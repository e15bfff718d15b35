// The engine's thread: takes commands in order, processes frames while running, posts events.
import init, { Session, configuration, version, type Command, type Event as SlamEvent } from "../pkg/mte_slam_web.js";
import wasmUrl from "../pkg/mte_slam_web_bg.wasm?url";

/** What the worker posts beside the session's events. */
export type WorkerEvent =
  | SlamEvent
  | { type: "ready"; version: string; config: Record<string, unknown> }
  | { type: "state"; running: boolean; open: boolean }
  | { type: "answered"; id: number; ok: boolean }
  | { type: "crashed"; message: string };

/** What the worker is sent: a command and a number for its answer. */
export type WorkerMessage = { id: number; command: Command };

const scope = self as unknown as DedicatedWorkerGlobalScope;
const queue: WorkerMessage[] = [];
let session: Session | undefined;
let running = false;
let open = false;
let busy = false;

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

async function follow({ id, command }: WorkerMessage): Promise<void> {
  const ok = await session!.handle(command);
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
    session = new Session((event: SlamEvent) => post(event));
    post({ type: "ready", version: version(), config: configuration({}) });
    return pump();
  })
  .catch((error: unknown) => {
    const message = error instanceof Error ? error.message : String(error);
    post({ type: "crashed", message: `the WebAssembly module did not load: ${message}` });
  });
