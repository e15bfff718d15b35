// The page: wires controls, engine and view together. All computing happens in workers.
import { MteSlam, type ErrorEvent, type ExportKind, type OpenedEvent, type Settings, type SourceSpec } from "./client";
import { bytes, element, paint, seconds, show } from "./ui/dom";
import { type Action, type FailureKind, fail } from "./ui/failure";
import { Legend } from "./ui/legend";
import { Plots } from "./ui/plots";
import { archive, dropped, inputFolder, pickFolder } from "./ui/sources";
import * as state from "./ui/state";
import * as theme from "./ui/theme";
import { View } from "./ui/view";
import type { Shading } from "./view/protocol";

const slam = new MteSlam();
const view = new View(element<HTMLCanvasElement>("view"));
const plots = new Plots(element("plots"));
const legend = new Legend(element("legend"), element<HTMLButtonElement>("legend-all"), () =>
  view.send({ type: "classes", ...legend.state }),
);

const form = element<HTMLFormElement>("start-pane");
const toggle = element<HTMLButtonElement>("toggle");
const stepButton = element<HTMLButtonElement>("step");
const input = <T extends HTMLInputElement | HTMLSelectElement>(id: string) => element<T>(id);

/** The run on the page. */
const run = {
  opened: undefined as OpenedEvent | undefined,
  source: undefined as SourceSpec | undefined,
  choice: state.read(new URLSearchParams(location.search)),
  running: false,
  finished: false,
  frames: 0,
  done: 0,
  triangles: 0,
  lost: 0,
  /** When frames were done, for the time that is left. */
  begun: 0,
  begunAt: 0,
};
/** Files that were given but not opened yet. */
let given: SourceSpec | undefined;
let hasGpu = false;
let gpuName = "";
let software = false;

// --- Running ---------------------------------------------------------------------------------

function status(text: string): void {
  element("status").textContent = text;
}

function transport(): void {
  const open = run.opened !== undefined;
  for (const button of [toggle, stepButton]) show(button, open && Boolean(form.hidden));
  show(element("back"), open);
  toggle.disabled = !open || (run.finished && !run.running);
  toggle.textContent = run.running ? "Pause" : run.finished ? "Done" : run.done > 0 ? "Resume" : "Start";
  stepButton.disabled = !open || run.running || run.finished;
  const seek = input<HTMLInputElement>("seek");
  seek.disabled = !open || run.running || run.done === 0;
  seek.max = String(Math.max(0, run.done - 1));
  for (const button of element("exports").querySelectorAll("button")) {
    const classes = button.dataset.kind === "glb-classes";
    button.disabled = !open || run.done === 0 || (classes && run.opened!.classes.length === 0);
  }
}

function progress(): void {
  const bar = element("progress");
  const part = run.frames > 0 ? run.done / run.frames : 0;
  bar.querySelector("i")!.style.transform = `scaleX(${part})`;
  bar.setAttribute("aria-valuenow", String(Math.round(part * 100)));
  const rate = (run.done - run.begun) / Math.max(1e-3, (performance.now() - run.begunAt) / 1000);
  const left = run.running && run.done - run.begun > 2 ? `about ${seconds((run.frames - run.done) / rate)} left` : "";
  element("eta").textContent = run.frames > 0 ? `${run.done} of ${run.frames} frames${left ? `, ${left}` : ""}` : "";
}

async function open(source: SourceSpec, choice: state.Choice): Promise<void> {
  run.source = source;
  run.choice = choice;
  Object.assign(run, { opened: undefined, finished: false, frames: 0, done: 0, triangles: 0, lost: 0, begun: 0 });
  plots.clear();
  view.send({ type: "reset" });
  legend.set([]);
  for (const id of ["in-color", "in-depth", "in-classes", "out-color", "out-depth", "out-classes"])
    paint(element<HTMLCanvasElement>(id), new Uint8Array(), 160, 120);
  element("frame-number").textContent = "";
  show(form, false);
  show(element("failure"), false);
  show(element("tools"), true);
  show(element("new-run"), true);
  show(element("picked"), false);
  const query = state.write(choice);
  history.replaceState(null, "", query ? `?${query}` : location.pathname);
  transport();
  progress();
  status("Opening the recording");
  const settings: Settings = { unroll: !software, ...choice.settings };
  if (await slam.open(source, settings)) {
    run.begunAt = performance.now();
    await slam.start();
  }
}

function again(change: Partial<Settings> = {}): void {
  slam.restart();
  const choice = { ...run.choice, settings: { ...run.choice.settings, ...change } };
  if (run.source) void open(run.source, choice);
  else newRun();
}

function newRun(): void {
  void slam.pause();
  show(element("failure"), false);
  show(form, true);
  show(element("tools"), false);
  transport();
  form.querySelector<HTMLElement>("input:checked")?.focus();
}

function failed(kind: FailureKind, message: string, resumable: boolean): void {
  const other: Action = { name: "New run", run: newRun };
  const actions: Action[] = [];
  if (resumable) actions.push({ name: "Resume", primary: true, run: () => void slam.start() });
  if (kind === "no-webgpu" || kind === "adapter" || kind === "limits")
    actions.push({ name: "Use the processor", primary: true, run: () => again({ engine: "cpu" }) });
  if (kind === "device-lost" || kind === "crashed" || kind === "engine" || kind === "out-of-memory")
    actions.push({ name: "Run again", primary: true, run: () => again() });
  if (kind === "viewer") actions.push({ name: "Go on without it", run: () => {} });
  else actions.push(other);
  status("Stopped");
  fail(kind, message, actions);
}

/** What the paper adds, switched off and on where this build has it. */
const SWITCHES: [path: string, name: string][] = [
  ["fusion.enabled", "Feature fusion (MTFF)"],
  ["suppressor.enabled", "Redundancy suppressor (FRS)"],
];

slam.on("ready", ({ version, config }) => {
  element("version").textContent = `Version ${version}.`;
  const rows = SWITCHES.flatMap(([path, name]) => {
    const usual = path.split(".").reduce<unknown>((at, key) => (at as Record<string, unknown> | undefined)?.[key], config);
    if (typeof usual !== "boolean") return [];
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.dataset.path = path;
    box.defaultChecked = usual;
    box.checked = Boolean(run.choice.settings.overrides?.[path] ?? usual);
    label.append(box, name);
    return [label];
  });
  element("switches").replaceChildren(...rows);
});

slam.on("opened", (event) => {
  run.opened = event;
  run.frames = event.frames;
  element("run-name").textContent = `${event.name}, ${event.frames} frames of ${event.width} × ${event.height}, ${event.layout}`;
  const chip = element("engine");
  const cpu = event.engine.kind === "cpu";
  chip.textContent = cpu ? "Processor" : `GPU: ${gpuName || event.engine.adapter}`;
  chip.title = event.engine.why ?? chip.textContent;
  chip.classList.toggle("warn", cpu);
  show(chip, true);
  legend.set(event.classes);
  view.send({ type: "truth", positions: event.truth });
  show(element("truth-shown"), event.truth.length > 0);
  const notes = [...event.warnings];
  if (cpu && event.engine.why) notes.unshift(`Computing on the processor, because ${event.engine.why}. Small runs only.`);
  note(notes.join(" · "));
  transport();
});

slam.on("state", (event) => {
  if (event.running && !run.running) {
    run.begun = run.done;
    run.begunAt = performance.now();
  }
  run.running = event.running;
  if (!event.open) run.opened = undefined;
  if (run.opened && !run.finished) status(event.running ? "Mapping" : "Paused");
  transport();
  progress();
});

slam.on("progress", ({ stage, done, total }) => {
  if (stage === "frames") {
    run.done = done;
    progress();
    transport();
  } else {
    const part = total > 1 || done > 0 ? `, ${Math.round((done / total) * 100)} %` : "";
    status(stage[0]!.toUpperCase() + stage.slice(1) + part);
  }
});

slam.on("frame", (event) => {
  if (run.running) status("Mapping");
  element("frame-number").textContent = `Frame ${event.index}`;
  paint(element<HTMLCanvasElement>("in-color"), event.color, event.width, event.height);
  paint(element<HTMLCanvasElement>("in-depth"), event.depth, event.width, event.height);
  paint(element<HTMLCanvasElement>("in-classes"), event.classes, event.width, event.height);
});

slam.on("rendered", (event) => {
  input<HTMLInputElement>("seek").value = String(event.index);
  element("seek-value").textContent = String(event.index);
  paint(element<HTMLCanvasElement>("out-color"), event.color, event.width, event.height);
  paint(element<HTMLCanvasElement>("out-depth"), event.depth, event.width, event.height);
  paint(element<HTMLCanvasElement>("out-classes"), event.classes, event.width, event.height);
});

slam.on("pose", (event) => {
  const { width, height, focal } = run.opened!;
  view.send({ type: "pose", worldFromCamera: event.worldFromCamera, aspect: width / height, focal });
});
slam.on("trajectory", (event) => view.send({ type: "path", positions: event.positions }));
slam.on("map", (event) => {
  run.triangles = event.triangles;
  plots.add("triangles", event.triangles);
  view.chunks(event.chunks, event.bounds ?? null);
});
slam.on("metrics", (event) => {
  plots.add("ate", event.ateCm);
  plots.add("loss", event.losses?.total);
  plots.add("tracking", event.trackingMs);
  if (event.losses) plots.add("mapping", event.mappingMs);
  plots.add("anchors", event.anchors);
  plots.add("memory", event.deviceBytes / 1e6);
});
slam.on("lost", (event) => {
  run.lost++;
  note(`Frame ${event.index} could not be located; the map ignores it.`);
});
slam.on("warning", (event) => note(event.message));
slam.on("done", (event) => {
  run.finished = true;
  const lost = event.lost > 0 ? `, ${event.lost} lost` : "";
  status(`Done in ${seconds(event.seconds)}${lost}`);
  transport();
});
slam.on("error", (event: ErrorEvent) => failed(event.kind, event.message, event.resumable));
slam.on("crashed", (event) => {
  run.opened = undefined;
  run.running = false;
  transport();
  failed("crashed", event.message, false);
});

let noteTimer = 0;
function note(text: string): void {
  const place = element("notice");
  place.textContent = text;
  show(place, text !== "");
  clearTimeout(noteTimer);
  noteTimer = window.setTimeout(() => show(place, false), 9000);
}

// --- Controls --------------------------------------------------------------------------------

toggle.onclick = () => void (run.running ? slam.pause() : slam.start());
stepButton.onclick = () => void slam.step();
input<HTMLInputElement>("seek").oninput = (e) => {
  element("seek-value").textContent = (e.target as HTMLInputElement).value;
};
input<HTMLInputElement>("seek").onchange = (e) => void slam.seekView({ frame: (e.target as HTMLInputElement).valueAsNumber });
element("new-run").onclick = newRun;
element("back").onclick = () => {
  show(form, false);
  show(element("tools"), true);
  transport();
};
element("fit").onclick = () => view.send({ type: "fit" });
const followButton = element("follow");
const follow = (on: boolean) => followButton.setAttribute("aria-pressed", String(on));
followButton.onclick = () => {
  const on = followButton.getAttribute("aria-pressed") !== "true";
  follow(on);
  view.send({ type: "follow", on });
};
view.onFollow = follow;
const truthButton = element("truth-shown");
truthButton.onclick = () => {
  const on = truthButton.getAttribute("aria-pressed") !== "true";
  truthButton.setAttribute("aria-pressed", String(on));
  view.send({ type: "truthShown", on });
};
document.addEventListener("keydown", (e) => {
  const typing = e.target instanceof HTMLInputElement || e.target instanceof HTMLSelectElement;
  if (typing || e.ctrlKey || e.metaKey || e.altKey || form.contains(e.target as Node)) return;
  if (e.key === "f") followButton.click();
  if (e.key === "r") element("fit").click();
});

const shadings = [...element("shading").querySelectorAll("button")];
function shade(button: HTMLButtonElement): void {
  for (const other of shadings) {
    other.setAttribute("aria-checked", String(other === button));
    other.tabIndex = other === button ? 0 : -1;
  }
  view.shading(button.dataset.value as Shading);
}
shadings.forEach((button, i) => {
  button.onclick = () => shade(button);
  button.onkeydown = (e) => {
    const by = e.key === "ArrowRight" ? 1 : e.key === "ArrowLeft" ? -1 : 0;
    const next = shadings[(i + by + shadings.length) % shadings.length]!;
    if (by) {
      shade(next);
      next.focus();
    }
  };
});

view.onPick = (hit) => {
  const place = element("picked");
  show(place, hit !== null);
  if (!hit) return;
  const { name, color } = legend.name(hit.class);
  const swatch = document.createElement("span");
  swatch.className = "swatch";
  swatch.style.background = color;
  const at = hit.point.map((x) => x.toFixed(2)).join(", ");
  place.replaceChildren(swatch, `${name} at ${at} m`);
  place.dataset.class = name;
};
view.onFailure = (message) => failed("viewer", message, false);

for (const button of element("exports").querySelectorAll("button"))
  button.onclick = async () => {
    const was = run.running;
    const place = element("export-note");
    place.textContent = "Working…";
    if (was) await slam.pause();
    const file = await slam.export(button.dataset.kind as ExportKind);
    if (file) {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([file.bytes as Uint8Array<ArrayBuffer>], { type: file.mime }));
      link.download = file.name;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
      place.textContent = `${file.name}, ${bytes(file.bytes.length)}`;
    } else place.textContent = "";
    if (was) await slam.start();
    else if (!run.finished) status("Paused");
  };

// --- Choosing a recording ----------------------------------------------------------------------

const chosen = () => new FormData(form).get("source") as string;
function choose(value: string): void {
  const radio = form.querySelector<HTMLInputElement>(`input[value="${value}"]`);
  if (radio) radio.checked = true;
  show(element("url-row"), value === "url");
}

function choiceFromForm(): state.Choice {
  const number = (id: string) => {
    const n = input<HTMLInputElement>(id).valueAsNumber;
    return Number.isFinite(n) ? n : undefined;
  };
  const settings: Settings = { ...run.choice.settings, preset: input<HTMLSelectElement>("preset").value };
  const engine = input<HTMLSelectElement>("engine-choice").value;
  settings.engine = engine as Settings["engine"];
  settings.labels = input<HTMLSelectElement>("labels").value as Settings["labels"];
  const tracker = input<HTMLSelectElement>("tracker").value;
  if (tracker) settings.tracker = tracker;
  else delete settings.tracker;
  const frames = number("frames");
  if (frames === undefined) delete settings.frames;
  else settings.frames = frames;
  settings.stride = number("stride") ?? 1;
  settings.scale = number("scale") ?? 1;
  settings.liveResolutionM = (number("resolution") ?? 5) / 100;
  for (const box of element("switches").querySelectorAll<HTMLInputElement>("input")) {
    if (box.checked === box.defaultChecked && settings.overrides?.[box.dataset.path!] === undefined) continue;
    settings.overrides = { ...settings.overrides, [box.dataset.path!]: box.checked };
  }
  const source = chosen() === "url" ? input<HTMLInputElement>("url").value.trim() : chosen();
  return { source, settings, width: run.choice.width, auto: false };
}

function formFromChoice({ source, settings: s }: state.Choice): void {
  const set = (id: string, value: string | number | undefined | null) => {
    if (value !== undefined && value !== null) input<HTMLInputElement>(id).value = String(value);
  };
  if (source) choose(["room", "office", "serve"].includes(source) ? source : "url");
  if (source.includes("/")) set("url", source);
  set("preset", s.preset ?? "fast");
  set("engine-choice", s.engine);
  set("labels", s.labels);
  set("tracker", s.tracker);
  set("frames", s.frames);
  set("stride", s.stride);
  set("scale", s.scale);
  if (s.liveResolutionM) set("resolution", Math.round(s.liveResolutionM * 1e4) / 100);
}

/** Files were given: they are what the form now means. */
function give(source: SourceSpec): void {
  given = source;
  const kind = source.kind === "zip" ? "zip" : "folder";
  choose(kind);
  if (source.kind === "zip") element("zip-name").textContent = source.name;
  if (source.kind === "files") element("folder-name").textContent = `${source.name}, ${(source.files as unknown[]).length} files`;
}

async function ask(kind: string): Promise<void> {
  if (kind === "zip") return element("zip-input").click();
  if ("showDirectoryPicker" in window) {
    try {
      const source = await pickFolder();
      if (source) give(source);
    } catch (error) {
      if ((error as Error).name !== "AbortError") failed("bad-file", (error as Error).message, false);
    }
  } else element("folder-input").click();
}

form.addEventListener("change", (e) => {
  const target = e.target as HTMLInputElement;
  if (target.name === "source") choose(target.value);
});
form.addEventListener("click", (e) => {
  const radio = e.target as HTMLInputElement;
  // A click asks for the files; moving there by arrow keys does not.
  if (radio.name === "source" && (radio.value === "folder" || radio.value === "zip") && e.detail > 0) void ask(radio.value);
});
element<HTMLInputElement>("zip-input").onchange = (e) => {
  const file = (e.target as HTMLInputElement).files?.[0];
  if (file) give(archive(file));
};
element<HTMLInputElement>("folder-input").onchange = (e) => {
  const files = (e.target as HTMLInputElement).files;
  const source = files && inputFolder(files);
  if (source) give(source);
};
form.onsubmit = async (e) => {
  e.preventDefault();
  const choice = choiceFromForm();
  try {
    const fits = given && given.kind === (chosen() === "zip" ? "zip" : "files") && ["zip", "folder"].includes(chosen());
    if (!fits && ["zip", "folder"].includes(chosen())) return void ask(chosen());
    const source = fits ? given : state.named(choice);
    if (!source) throw new Error(`${choice.source || "nothing"}: expected an address such as https://example.org/room.zip`);
    await open(source, choice);
  } catch (error) {
    failed("bad-settings", (error as Error).message, false);
  }
};

let drags = 0;
const dropping = (on: boolean) => show(element("dropping"), on);
document.addEventListener("dragenter", (e) => {
  e.preventDefault();
  drags++;
  dropping(true);
});
document.addEventListener("dragleave", () => {
  drags = Math.max(0, drags - 1);
  if (drags === 0) dropping(false);
});
document.addEventListener("dragover", (e) => e.preventDefault());
document.addEventListener("drop", async (e) => {
  e.preventDefault();
  drags = 0;
  dropping(false);
  if (!e.dataTransfer) return;
  try {
    const source = await dropped(e.dataTransfer);
    give(source);
    await open(source, { ...choiceFromForm(), source: "" });
  } catch (error) {
    failed("bad-file", (error as Error).message, false);
  }
});

// --- Beginning -----------------------------------------------------------------------------------

theme.start(element<HTMLButtonElement>("theme"), (t) => {
  view.theme(t);
  plots.redraw();
});
document.addEventListener("visibilitychange", () => {
  if (!document.hidden && run.running) note("Mapping went on while this tab was hidden, as far as the browser lets it.");
});

/** What this browser can compute with; software adapters get shaders without unrolled loops. */
async function lookForGpu(): Promise<void> {
  const place = element("gpu-note");
  try {
    const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
    const about = adapter?.info;
    hasGpu = adapter !== null && adapter !== undefined;
    const name = about?.description || [about?.vendor, about?.architecture].filter(Boolean).join(" ");
    gpuName = name;
    software = /swiftshader|llvmpipe|software/i.test(name) || about?.isFallbackAdapter === true;
    place.textContent = !hasGpu
      ? "No WebGPU here: the processor computes, so choose Tiny and small images."
      : software
        ? `WebGPU in software (${name}): slow. The processor may be faster.`
        : `GPU: ${name || "found"}`;
  } catch (error) {
    place.textContent = `No GPU: ${(error as Error).message}`;
  }
  // Without a choice in the address, what suits this machine.
  if (!hasGpu && !run.choice.settings.preset) input<HTMLSelectElement>("preset").value = "tiny";
}

// What tests look at.
Object.assign(window, { mteSlam: { slam, view, plots, run } });

const offered = document.querySelector('meta[name="mte-slam-serve"]');
show(element("serve-card"), offered !== null);
formFromChoice(run.choice);
if (offered && !run.choice.source) choose("serve");
status("Ready");
await lookForGpu();
if (run.choice.auto) {
  const source = state.named(run.choice);
  if (source) await open(source, run.choice);
}
