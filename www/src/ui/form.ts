// The form of the start: a choice of recording and settings, and back.
import type { Overrides, Settings } from "../client";
import { element, show } from "./dom";
import type { Choice } from "./state";

const form = element<HTMLFormElement>("start-pane");
const input = <T extends HTMLInputElement | HTMLSelectElement>(id: string) => element<T>(id);

/** The kind of recording that is chosen. */
export const chosen = () => new FormData(form).get("source") as string;
export function choose(value: string): void {
  const radio = form.querySelector<HTMLInputElement>(`input[value="${value}"]`);
  if (radio) radio.checked = true;
  show(element("url-row"), value === "url");
}

/** What the form says; what it has no field for is as in `last`. */
export function choiceFromForm(last: Choice): Choice {
  const number = (id: string) => {
    const n = input<HTMLInputElement>(id).valueAsNumber;
    return Number.isFinite(n) ? n : undefined;
  };
  const preset = input<HTMLSelectElement>("preset").value as Settings["preset"];
  const settings: Settings = { ...last.settings, preset };
  const engine = input<HTMLSelectElement>("engine-choice").value;
  settings.engine = engine as Settings["engine"];
  settings.labels = input<HTMLSelectElement>("labels").value as Settings["labels"];
  const tracker = input<HTMLSelectElement>("tracker").value;
  if (tracker) settings.tracker = tracker as Settings["tracker"];
  else delete settings.tracker;
  const frames = number("frames");
  if (frames === undefined) delete settings.frames;
  else settings.frames = frames;
  settings.stride = number("stride") ?? 1;
  settings.scale = number("scale") ?? 1;
  settings.liveResolutionM = (number("resolution") ?? 5) / 100;
  for (const box of element("switches").querySelectorAll<HTMLInputElement>("input")) {
    const path = box.dataset.path as keyof Overrides;
    if (box.checked === box.defaultChecked && settings.overrides?.[path] === undefined) continue;
    settings.overrides = { ...settings.overrides, [path]: box.checked } as Overrides;
  }
  const source = chosen() === "url" ? input<HTMLInputElement>("url").value.trim() : chosen();
  return { source, settings, width: last.width, auto: false };
}

export function formFromChoice({ source, settings: s }: Choice): void {
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
