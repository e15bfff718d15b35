// The viewer's thread: draws when something changed, at most once a display frame.
import { Renderer } from "./renderer";
import type { ViewEvent, ViewMessage } from "./protocol";

const scope = self as unknown as DedicatedWorkerGlobalScope;
const post = (event: ViewEvent) => scope.postMessage(event);
let renderer: Renderer | undefined;
// What tests look at.
Object.defineProperty(scope, "view", { get: () => renderer });
let waiting = false;

function schedule(): void {
  if (waiting || !renderer?.changed) return;
  waiting = true;
  scope.requestAnimationFrame(() => {
    waiting = false;
    renderer?.draw();
  });
}

scope.onmessage = ({ data }: MessageEvent<ViewMessage>) => {
  if (data.type === "canvas") {
    try {
      const { canvas } = data;
      renderer = new Renderer(canvas);
      canvas.addEventListener("webglcontextlost", (event) => {
        // Asks for it back.
        event.preventDefault();
        post({ type: "lost" });
      });
      canvas.addEventListener("webglcontextrestored", () => {
        renderer = new Renderer(canvas);
        post({ type: "restored" });
      });
      post({ type: "ready" });
    } catch (error) {
      post({ type: "unsupported", message: error instanceof Error ? error.message : String(error) });
    }
    return;
  }
  const r = renderer;
  if (!r) return;
  const followed = r.follow;
  switch (data.type) {
    case "size": r.size(data.width, data.height); break;
    case "theme": r.theme(data.theme); break;
    case "reset": r.reset(); break;
    case "chunks": r.chunks(data.chunks, data.bounds); break;
    case "path": r.path(data.positions); break;
    case "truth": r.truth(data.positions); break;
    case "pose": r.pose(data.worldFromCamera, data.aspect, data.focal); break;
    case "shading": r.shading = data.shading; r.changed = true; break;
    case "classes": r.classes(data.colors, data.visible, data.highlight); break;
    case "orbit": r.orbit(data.dx, data.dy); break;
    case "pan": r.pan(data.dx, data.dy); break;
    case "zoom": r.zoom(data.factor); break;
    case "follow": r.follow = data.on; r.changed = true; break;
    case "truthShown": r.truthShown = data.on; r.changed = true; break;
    case "fit": r.fit(); break;
    case "pick": post({ type: "picked", id: data.id, hit: r.pick(data.x, data.y) }); break;
    case "stats": post({ type: "stats", id: data.id, frames: r.frames, ...r.stats() }); break;
  }
  if (followed !== r.follow) post({ type: "followed", on: r.follow });
  schedule();
};
