// Runs that can go on: what this browser has kept of them, and the line that offers it.
import { type KeptRun, MteSlam, type Settings, type SourceSpec } from "../client";
import { bytes, element, show } from "./dom";
import { type Choice, named } from "./state";

/** What the page keeps with a run. */
export interface About {
  choice: Choice;
  kind: SourceSpec["kind"];
  /** The folder's or archive's name, for people. */
  name: string;
}

export function about(source: SourceSpec, choice: Choice): About {
  const name = "name" in source ? source.name : choice.source;
  return { choice: { ...choice, auto: false }, kind: source.kind, name };
}

/** Where the run's frames come from, unless only the user can give that again. */
export function sourceOf(run: KeptRun): SourceSpec | undefined {
  const { choice, kind } = run.about as About;
  return kind === "files" || kind === "zip" ? undefined : named(choice);
}

function ago(ms: number): string {
  const minutes = Math.round(ms / 60_000);
  if (minutes < 1) return "just now";
  if (minutes < 60) return `${minutes} min ago`;
  return minutes < 48 * 60 ? `${Math.round(minutes / 60)} h ago` : `${Math.round(minutes / 1440)} days ago`;
}

const NAMES: Record<string, string> = { room: "Living room", office: "Office", serve: "This server" };

const KEY = "mte-slam-run";

/** Notes in this tab which run is its own: another tab may have a newer one. */
export function mine(id: string): void {
  try {
    sessionStorage.setItem(KEY, id);
  } catch {
    // Storage can be forbidden; then the newest run is offered.
  }
}

function own(): string | null {
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return null;
  }
}

/** Offers this tab's run, or the newest, if there is one. */
export async function offer(goOn: (run: KeptRun) => void): Promise<void> {
  const all = await MteSlam.kept();
  const run = all.find(({ id }) => id === own()) ?? all[0];
  const place = element("kept");
  show(place, run !== undefined);
  if (!run) return;
  const { name } = run.about as About;
  const done = run.frame >= run.frames;
  element("kept-text").textContent =
    `${NAMES[name] ?? name}: ${run.frame} of ${run.frames} frames, ${ago(Date.now() - run.at)}, ${bytes(run.size)} in this browser`;
  const button = element<HTMLButtonElement>("kept-go");
  button.textContent = done ? "Show again" : "Go on";
  button.onclick = () => goOn(run);
  element("kept-forget").onclick = () => void MteSlam.forget(run.id).then(() => offer(goOn));
}

/** Settings that a run takes over from today's page when it goes on. */
export function engineOf({ engine }: Settings): Settings {
  return { ...(engine && { engine }) };
}
