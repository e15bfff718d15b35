// The page: wires controls, engine and view together. All computing happens in workers.
import { MteSlam, type ErrorEvent, type ExportKind, type KeptRun, type OpenedEvent, type Overrides, type Settings, type SourceSpec } from "./client";
import { bytes, element, paint, seconds, show } from "./ui/dom";
import { type Action, type FailureKind, fail } from "./ui/failure";
import { type About, about, engineOf, mine, offer, sourceOf } from "./ui/kept";
import { choiceFromForm, choose, chosen, formFromChoice } from "./ui/form";
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
  /** When it was asked for, and how long the first surface took from there [s]. */
  askedAt: 0,
  firstMap: undefined as number | undefined,
  id: "",
  /** Frames in the state that is kept of this run; 0 for none. */
  kept: 0,
  /** Frames that were done when it last went on from there; -1 for never. */
  restoredAt: -1,
};
/** A run that goes on when its files are given again. */
let awaited: KeptRun | undefined;
/** Files that were given but not opened yet. */
let given: SourceSpec | undefined;
let hasGpu = false;
let gpuName = "";

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
  bar.setAttribute("aria-valuetext", `${run.done} of ${run.frames} frames`);
  element("eta").textContent = run.frames > 0 ? `${run.done} of ${run.frames} frames${left ? `, ${left}` : ""}` : "";
}

/** Opens a recording and starts; `id` names a kept run to go on with. */
async function open(source: SourceSpec, choice: state.Choice, id?: string, start = true): Promise<void> {
  const again = id !== undefined && id === run.id;
  run.source = source;
  run.choice = choice;
  Object.assign(run, { opened: undefined, finished: false, frames: 0, done: 0, triangles: 0, lost: 0, begun: 0, askedAt: performance.now(), firstMap: undefined });
  if (!again) Object.assign(run, { id: id ?? `${Date.now()}-${Math.random()}`, kept: 0, restoredAt: -1 });
  awaited = undefined;
  mine(run.id);
  plots.clear();
  view.send({ type: "reset" });
  legend.set([]);
  for (const id of ["in-color", "in-depth", "in-classes", "out-color", "out-depth", "out-classes"])
    paint(element<HTMLCanvasElement>(id), new Uint8Array(), 160, 120);
  element("frame-number").textContent = "";
  show(form, false);
  // That the view fails may be known before a run opens by itself, and stays true.
  const pane = element("failure");
  if (pane.dataset.kind !== "viewer") show(pane, false);
  show(element("tools"), true);
  show(element("new-run"), true);
  show(element("share"), choice.source !== "");
  show(element("picked"), false);
  const query = state.write(choice);
  history.replaceState(null, "", query ? `?${query}` : location.pathname);
  transport();
  progress();
  status("Opening the recording");
  const settings: Settings = { ...choice.settings };
  const keep = { id: run.id, about: about(source, choice), resume: id !== undefined };
  if (await slam.open(source, settings, keep)) {
    run.begunAt = performance.now();
    if (start) await slam.start();
  }
}

function again(change: Partial<Settings> = {}): void {
  slam.restart();
  const choice = { ...run.choice, settings: { ...run.choice.settings, ...change } };
  if (run.source) void open(run.source, choice);
  else newRun();
}

/** Goes on from the state that is kept of the run on the page, with a new worker and device. */
function restore(start: boolean): void {
  run.restoredAt = run.done;
  slam.restart();
  if (run.source) void open(run.source, run.choice, run.id, start);
}

/** Goes on with a run of an earlier visit. */
function goOn(kept: KeptRun): void {
  const { choice, kind, name } = kept.about as About;
  const source = sourceOf(kept);
  const settings = { ...choice.settings, ...engineOf(choiceFromForm(run.choice).settings) };
  if (source) return void open(source, { ...choice, settings }, kept.id);
  awaited = kept;
  note(`Give “${name}” again to go on: pick it or drop it here.`);
  void ask(kind === "zip" ? "zip" : "folder");
}

/** Opens files that were given: anew, or for the run that waits for them. */
function openFiles(source: SourceSpec): Promise<void> {
  const waits = awaited;
  if (waits && (waits.about as About).kind === source.kind) return open(source, (waits.about as About).choice, waits.id);
  return open(source, { ...choiceFromForm(run.choice), source: "" });
}

function newRun(): void {
  void slam.pause();
  void offer(goOn);
  show(element("failure"), false);
  show(form, true);
  show(element("tools"), false);
  transport();
  form.querySelector<HTMLElement>("input:checked")?.focus();
}

function failed(kind: FailureKind, message: string, resumable: boolean): void {
  const stopped = ["device-lost", "crashed", "engine", "out-of-memory"].includes(kind);
  // Once by itself, and again only after it got further: a device that is always lost must not be
  // asked for ever.
  if (kind === "device-lost" && run.kept > 0 && run.done > run.restoredAt) {
    const at = run.done;
    restore(run.running);
    return note(`The graphics device was lost at frame ${at}: ${message}. Going on from frame ${run.kept} on a new one.`, 20);
  }
  const other: Action = { name: "New run", run: newRun };
  const actions: Action[] = [];
  if (stopped && run.kept > 0) actions.push({ name: `Go on from frame ${run.kept}`, primary: true, run: () => restore(true) });
  if (resumable) actions.push({ name: "Resume", primary: true, run: () => void slam.start() });
  if (kind === "no-webgpu" || kind === "adapter" || kind === "limits")
    actions.push({ name: "Use the processor", primary: true, run: () => again({ engine: "cpu" }) });
  if (stopped) actions.push({ name: "Run again", primary: run.kept === 0, run: () => again() });
  if (kind === "viewer") actions.push({ name: "Go on without it", run: () => {} });
  else actions.push(other);
  if (kind !== "viewer") status("Stopped");
  fail(kind, message, actions);
}

/** What the paper adds, switched off and on where this build has it. */
const SWITCHES: [path: keyof Overrides, name: string][] = [
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
  run.done = event.next;
  if (event.next > 0) run.kept = event.next;
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
  if (event.triangles > 0) run.firstMap ??= (performance.now() - run.askedAt) / 1000;
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
slam.on("saved", (event) => {
  if (event.id !== run.id) return;
  if (event.why && run.kept === 0) note(`This browser keeps no state of the run (${event.why}): it goes on after a lost device, but not after a reload.`);
  run.kept = event.frame;
});
slam.on("done", (event) => {
  run.finished = true;
  const lost = event.lost > 0 ? `, ${event.lost} lost` : "";
  const first = run.firstMap === undefined ? "" : `, first surface after ${run.firstMap.toFixed(1)} s`;
  status(`Done in ${seconds(event.seconds)}${lost}${first}`);
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
function note(text: string, seconds = 9): void {
  const place = element("notice");
  place.textContent = text;
  show(place, text !== "");
  clearTimeout(noteTimer);
  noteTimer = window.setTimeout(() => show(place, false), seconds * 1000);
}

// --- Controls --------------------------------------------------------------------------------

toggle.onclick = async () => {
  if (!run.running) return void slam.start();
  await slam.pause();
  if (run.done > run.kept) void slam.save();
};
element("share").onclick = async () => {
  try {
    await navigator.clipboard.writeText(location.href);
    note("Address copied: it holds the recording's address and the settings, no files.");
  } catch {
    note("Copy the address of this page: it holds the recording's address and the settings, no files.");
  }
};
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
  button.tabIndex = i === 0 ? 0 : -1;
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
view.onRestored = () => {
  const pane = element("failure");
  if (pane.dataset.kind === "viewer") show(pane, false);
  theme.apply();
  view.shading(element("shading").querySelector<HTMLElement>('[aria-checked="true"]')!.dataset.value as Shading);
  view.send({ type: "classes", ...legend.state });
  if (!run.opened) return;
  view.send({ type: "truth", positions: run.opened.truth });
  view.send({ type: "truthShown", on: truthButton.getAttribute("aria-pressed") === "true" });
  note("The 3D view is back; the mesh is built again.");
  void slam.refresh().then(() => status(run.finished ? "Done" : run.running ? "Mapping" : "Paused"));
};

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

/** Files were given: they are what the form now means. */
function give(source: SourceSpec): void {
  given = source;
  const kind = source.kind === "zip" ? "zip" : "folder";
  choose(kind);
  if (source.kind === "zip") element("zip-name").textContent = source.name;
  if (source.kind === "files") element("folder-name").textContent = `${source.name}, ${(source.files as unknown[]).length} files`;
  if (awaited && (awaited.about as About).kind === source.kind) void openFiles(source);
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
  const choice = choiceFromForm(run.choice);
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
    const waits = awaited;
    give(source);
    if (!waits || awaited) await openFiles(source);
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
  // Browsers may end a hidden tab.
  if (document.hidden && run.running && run.done > run.kept) void slam.save();
  if (!document.hidden && run.running) note("Mapping went on while this tab was hidden, as far as the browser lets it.");
});

/** What this browser can compute with. */
async function lookForGpu(): Promise<void> {
  const place = element("gpu-note");
  try {
    const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
    const about = adapter?.info;
    hasGpu = adapter !== null && adapter !== undefined;
    const name = about?.description || [about?.vendor, about?.architecture].filter(Boolean).join(" ");
    gpuName = name;
    const software = /swiftshader|llvmpipe|software/i.test(name) || about?.isFallbackAdapter === true;
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
const seen = { slam, view, plots, run, ready: false };
Object.assign(window, { mteSlam: seen });

const offered = document.querySelector('meta[name="mte-slam-serve"]');
show(element("serve-card"), offered !== null);
formFromChoice(run.choice);
if (offered && !run.choice.source) choose("serve");
status("Ready");
await lookForGpu();
await offer(goOn);
seen.ready = true;
if (run.choice.auto) {
  const source = state.named(run.choice);
  if (source) await open(source, run.choice);
}
