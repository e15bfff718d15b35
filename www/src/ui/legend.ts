// The classes of a recording: shown or hidden one by one, and made to stand out by pointing.
import type { ClassInfo } from "../client";

export class Legend {
  readonly #place: HTMLElement;
  readonly #changed: () => void;
  #classes: ClassInfo[] = [];
  #visible: boolean[] = [];
  #highlight = -1;

  constructor(place: HTMLElement, all: HTMLButtonElement, changed: () => void) {
    this.#place = place;
    this.#changed = changed;
    all.onclick = () => {
      const on = this.#visible.some((v) => !v);
      this.#visible.fill(on);
      for (const box of place.querySelectorAll("input")) box.checked = on;
      this.#tell();
    };
    place.addEventListener("pointerleave", () => this.#point(-1));
  }

  /** Colours, what is shown (last: surfaces without a class), and what stands out. */
  get state(): { colors: Uint8Array; visible: boolean[]; highlight: number } {
    const colors = new Uint8Array(this.#classes.flatMap((c) => [...c.color]));
    return { colors, visible: this.#visible, highlight: this.#highlight };
  }

  name(index: number): { name: string; color: string } {
    const found = this.#classes[index];
    return found
      ? { name: found.name, color: `rgb(${found.color.join(" ")})` }
      : { name: "no class", color: "transparent" };
  }

  set(classes: ClassInfo[]): void {
    this.#classes = classes;
    this.#visible = Array.from({ length: classes.length + 1 }, () => true);
    this.#highlight = -1;
    if (classes.length === 0) {
      const item = document.createElement("li");
      item.className = "muted";
      item.textContent = "This recording has no labels: geometry and colour only.";
      this.#place.replaceChildren(item);
    } else {
      const rows = [...classes.map((_, i) => i), classes.length].map((i) => this.#row(i));
      this.#place.replaceChildren(...rows);
    }
    this.#tell();
  }

  #row(i: number): HTMLElement {
    const { name, color } = this.name(i);
    const item = document.createElement("li");
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = true;
    box.dataset.class = name;
    box.onchange = () => {
      this.#visible[i] = box.checked;
      this.#tell();
    };
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = color;
    const text = document.createElement("span");
    text.textContent = name;
    text.title = name;
    label.append(box, swatch, text);
    label.addEventListener("pointerenter", () => this.#point(i));
    box.addEventListener("focus", () => this.#point(i));
    box.addEventListener("blur", () => this.#point(-1));
    item.append(label);
    return item;
  }

  #point(i: number): void {
    // Surfaces without a class are class 255 in the mesh.
    const next = i === this.#classes.length && i >= 0 ? 255 : i;
    if (next === this.#highlight) return;
    this.#highlight = next;
    this.#changed();
  }

  #tell(): void {
    this.#changed();
  }
}
