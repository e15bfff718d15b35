// What of a run is in the address, so that it can be shared and survives a reload:
// ?source=room&preset=fast&engine=auto&frames=60
import type { Overrides, Settings, SourceSpec } from "../client";
import { address } from "./sources";

export interface Choice {
  source: string;
  settings: Settings;
  /** Width of the built-in sequence's images [pixels]. */
  width: number;
  /** Start at once. */
  auto: boolean;
}

const number = (text: string | null): number | undefined => {
  const n = text === null || text === "" ? NaN : Number(text);
  return Number.isFinite(n) ? n : undefined;
};

/** A number, `true`, `false` or a list as such; anything else is a text. */
function literal(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

export function read(query: URLSearchParams): Choice {
  const settings: Settings = {};
  const preset = query.get("preset");
  const engine = query.get("engine");
  // What an address says is checked where it is used.
  if (preset) settings.preset = preset as Settings["preset"];
  if (engine === "auto" || engine === "gpu" || engine === "cpu") settings.engine = engine;
  if (query.get("labels") === "none") settings.labels = "none";
  const tracker = query.get("tracker");
  if (tracker) settings.tracker = tracker as Settings["tracker"];
  const frames = number(query.get("frames"));
  if (frames !== undefined) settings.frames = frames;
  const stride = number(query.get("stride"));
  if (stride !== undefined) settings.stride = stride;
  const scale = number(query.get("scale"));
  if (scale !== undefined) settings.scale = scale;
  const resolution = number(query.get("mesh"));
  if (resolution !== undefined) settings.liveResolutionM = resolution / 100;
  const renderEvery = number(query.get("render"));
  if (renderEvery !== undefined) settings.renderEvery = renderEvery;
  const overrides: Record<string, unknown> = {};
  for (const [key, value] of query) {
    if (!key.startsWith("set.")) continue;
    overrides[key.slice(4)] = literal(value);
  }
  if (Object.keys(overrides).length > 0) settings.overrides = overrides as Overrides;
  return { source: query.get("source") ?? "", settings, width: number(query.get("width")) ?? 160, auto: query.has("auto") };
}

export function write(choice: Choice): string {
  const query = new URLSearchParams();
  const { settings: s } = choice;
  const put = (key: string, value: unknown, usual?: unknown) => {
    if (value !== undefined && value !== usual && value !== "") query.set(key, String(value));
  };
  put("source", choice.source);
  put("preset", s.preset, "fast");
  put("engine", s.engine, "auto");
  put("tracker", s.tracker);
  put("labels", s.labels, "dataset");
  put("frames", s.frames);
  put("stride", s.stride, 1);
  put("scale", s.scale, 1);
  put("mesh", s.liveResolutionM === undefined ? undefined : Math.round(s.liveResolutionM * 1e4) / 100, 5);
  put("render", s.renderEvery, 5);
  put("width", choice.width, 160);
  for (const [key, value] of Object.entries(s.overrides ?? {})) query.set(`set.${key}`, typeof value === "string" ? value : JSON.stringify(value));
  return query.toString();
}

/** The built-in sequence or address that a name stands for; nothing for files, which cannot be in an address. */
export function named(choice: Choice): SourceSpec | undefined {
  const { source, width, settings } = choice;
  if (source === "room" || source === "office")
    return { kind: "built-in", scene: source, frames: settings.frames ?? 120, width, noise: source === "office" };
  if (source === "serve") return { kind: "serve", url: new URL(".", location.href).href };
  if (source.includes("/")) return address(source);
  return undefined;
}
