// Dark or light: as the system says until the user chooses.
import type { Theme } from "../view/protocol";
import type { Vec3 } from "../view/math";

const KEY = "mte-slam-theme";

/** A colour of the style sheet as numbers in 0..1. */
function variable(name: string): Vec3 {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const hex = /^#(..)(..)(..)$/.exec(text);
  return hex ? [1, 2, 3].map((i) => parseInt(hex[i]!, 16) / 255) as Vec3 : [0.5, 0.5, 0.5];
}

/** Tells the theme once more. */
export let apply: () => void = () => {};

export function start(button: HTMLButtonElement, changed: (theme: Theme) => void): void {
  const system = matchMedia("(prefers-color-scheme: light)");
  let chosen: string | null = null;
  try {
    chosen = localStorage.getItem(KEY);
  } catch {
    // Storage can be forbidden; the choice then lasts as long as the page.
  }
  apply = () => {
    const light = chosen ? chosen === "light" : system.matches;
    document.documentElement.dataset.theme = light ? "light" : "dark";
    changed({
      background: variable("--stage"), grid: variable("--muted"), path: variable("--accent"),
      truth: variable("--truth"), dark: !light,
    });
  };
  system.addEventListener("change", () => apply());
  button.onclick = () => {
    chosen = document.documentElement.dataset.theme === "light" ? "dark" : "light";
    try {
      localStorage.setItem(KEY, chosen);
    } catch {
      // As above.
    }
    apply();
  };
  apply();
}
