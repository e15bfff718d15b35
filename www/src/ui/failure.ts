// What went wrong, why, and what helps: one pane for every kind of failure.
import type { ErrorKind } from "../client";
import { element, show } from "./dom";

export type FailureKind = ErrorKind | "crashed" | "viewer";

interface Text {
  title: string;
  help: string[];
}

const TEXTS: Record<FailureKind, Text> = {
  "no-webgpu": {
    title: "This browser offers no WebGPU",
    help: [
      "Chrome and Edge 113 or newer have it on Windows, macOS, ChromeOS and Android 12; Safari 26; Firefox 141 on Windows. On Linux, Chrome may need chrome://flags/#enable-unsafe-webgpu.",
      "WebGPU needs https:// or http://localhost.",
      "The processor can compute the same map, more slowly: choose the preset Tiny and small images.",
    ],
  },
  adapter: {
    title: "The graphics adapter was refused",
    help: [
      "The browser found no adapter it trusts, or the driver gave none. chrome://gpu says why.",
      "An updated graphics driver, or hardware acceleration switched on in the browser's settings, often helps.",
      "The processor can compute the same map, more slowly.",
    ],
  },
  limits: {
    title: "This adapter is too small",
    help: ["It has less than WebGPU's default limits, which the kernels need. The numbers are above.", "The processor can compute the same map, more slowly."],
  },
  "device-lost": {
    title: "The graphics device was lost",
    help: [
      "The driver was reset, the computer slept, or another program took the device. The mesh on screen stays until a new run begins.",
      "Go on makes a new device and continues from the last state that was kept; Run again repeats the run from its first frame.",
    ],
  },
  "out-of-memory": {
    title: "Out of memory",
    help: [
      "Use a smaller image scale, fewer frames, or the preset Tiny or Fast.",
      "Closing other tabs that draw in 3D frees memory of the device.",
    ],
  },
  "bad-file": {
    title: "This recording cannot be read",
    help: [
      "The message names the file, what was found and what is expected.",
      "Recordings in the layouts of Replica (NICE-SLAM or vMAP), ScanNet (exported or .sens), TUM RGB-D, 7-Scenes and nerfstudio, and folders of images with an intrinsics.json, are understood, as folders or zip files.",
    ],
  },
  "bad-settings": { title: "These settings cannot be used", help: ["The message names the setting and what it may be."] },
  "server-gone": {
    title: "The server does not answer",
    help: ["Check that it is running and allows this page to read from it (CORS).", "The map so far is kept. Resume asks for the frame again and goes on."],
  },
  command: { title: "That is not possible now", help: [] },
  engine: { title: "The engine failed", help: ["This is a mistake in this program. The message helps to find it."] },
  crashed: {
    title: "The engine stopped",
    help: ["Its memory may have run out, or this is a mistake in this program. Go on continues from the last state that was kept, if there is one.", "If it stops again, use a smaller image scale or the preset Tiny."],
  },
  viewer: {
    title: "The 3D view cannot be shown",
    help: ["It needs WebGL 2 on a canvas of a worker. Mapping, pictures, figures and exports work without it."],
  },
};

export interface Action {
  name: string;
  primary?: boolean;
  run: () => void;
}

export function fail(kind: FailureKind, message: string, actions: Action[]): void {
  const text = TEXTS[kind];
  element("failure-title").textContent = text.title;
  element("failure-text").textContent = message;
  element("failure-help").replaceChildren(
    ...text.help.map((line) => {
      const item = document.createElement("li");
      item.textContent = line;
      return item;
    }),
  );
  const pane = element("failure");
  pane.dataset.kind = kind;
  const buttons = actions.map(({ name, primary, run }) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    if (primary) button.className = "primary";
    button.onclick = () => {
      show(pane, false);
      run();
    };
    return button;
  });
  element("failure-actions").replaceChildren(...buttons);
  show(pane, true);
  buttons[0]?.focus();
}
