// Small live plots: a figure, its unit, and its course so far.
interface Kind {
  id: string;
  name: string;
  unit: string;
  digits: number;
  color: "--accent" | "--truth";
}

const KINDS: Kind[] = [
  { id: "ate", name: "Trajectory error", unit: "cm", digits: 2, color: "--truth" },
  { id: "loss", name: "Loss", unit: "", digits: 3, color: "--accent" },
  { id: "tracking", name: "Tracking", unit: "ms", digits: 0, color: "--accent" },
  { id: "mapping", name: "Mapping", unit: "ms", digits: 0, color: "--accent" },
  { id: "triangles", name: "Triangles", unit: "", digits: 0, color: "--accent" },
  { id: "anchors", name: "Anchors", unit: "", digits: 0, color: "--accent" },
  { id: "memory", name: "Device memory", unit: "MB", digits: 0, color: "--accent" },
];

/** Points kept a plot; older ones are thinned out, so that memory stays as it is. */
const MOST = 600;

interface Plot {
  kind: Kind;
  box: HTMLElement;
  value: HTMLElement;
  canvas: HTMLCanvasElement;
  points: number[];
  /** How many values a point stands for. */
  step: number;
  skipped: number;
}

export class Plots {
  readonly #plots = new Map<string, Plot>();
  #due = false;

  constructor(place: HTMLElement) {
    for (const kind of KINDS) {
      const box = document.createElement("div");
      box.className = "plot";
      box.id = `plot-${kind.id}`;
      const name = document.createElement("div");
      name.className = "name";
      name.textContent = kind.name;
      const value = document.createElement("div");
      value.className = "value number";
      value.textContent = "–";
      const canvas = document.createElement("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", `${kind.name} over the frames`);
      box.append(name, value, canvas);
      place.append(box);
      this.#plots.set(kind.id, { kind, box, value, canvas, points: [], step: 1, skipped: 0 });
    }
    // Kinds that a run may not have are shown with their first value.
    this.#plots.get("anchors")!.box.hidden = true;
    new ResizeObserver(() => this.redraw()).observe(place);
  }

  clear(): void {
    for (const plot of this.#plots.values()) {
      plot.points = [];
      plot.step = 1;
      plot.skipped = 0;
      plot.value.textContent = "–";
    }
    this.#plots.get("anchors")!.box.hidden = true;
    this.redraw();
  }

  add(id: string, x: number | null | undefined): void {
    const plot = this.#plots.get(id);
    if (!plot || x === null || x === undefined || !Number.isFinite(x)) return;
    plot.box.hidden = false;
    if (++plot.skipped >= plot.step) {
      plot.skipped = 0;
      plot.points.push(x);
      if (plot.points.length > MOST) {
        plot.points = plot.points.filter((_, i) => i % 2 === 0);
        plot.step *= 2;
      }
    }
    const unit = document.createElement("small");
    unit.textContent = plot.kind.unit;
    const text = x.toLocaleString("en", { maximumFractionDigits: plot.kind.digits, minimumFractionDigits: plot.kind.digits });
    plot.value.replaceChildren(text, unit);
    this.redraw();
  }

  /** Number of points of a plot. */
  count(id: string): number {
    return this.#plots.get(id)?.points.length ?? 0;
  }

  redraw(): void {
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => {
      this.#due = false;
      const style = getComputedStyle(document.documentElement);
      for (const plot of this.#plots.values()) draw(plot, style.getPropertyValue(plot.kind.color).trim());
    });
  }
}

function draw(plot: Plot, color: string): void {
  const { canvas, points } = plot;
  const ratio = Math.min(3, devicePixelRatio || 1);
  const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  if (w === 0 || h === 0) return;
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const context = canvas.getContext("2d");
  if (!context) return;
  context.clearRect(0, 0, w, h);
  // The base line shows the place of a plot without values.
  context.fillStyle = color;
  context.globalAlpha = 0.25;
  context.fillRect(0, h - ratio, w, ratio);
  if (points.length < 2) return;
  // One wild value must not flatten the rest.
  const sorted = [...points].sort((a, b) => a - b);
  const top = Math.max(sorted[Math.floor(0.98 * (sorted.length - 1))]! * 1.1, 1e-9);
  const x = (i: number) => (i / (points.length - 1)) * (w - 2 * ratio) + ratio;
  const y = (v: number) => h - ratio - Math.min(v / top, 1) * (h - 3 * ratio);
  context.beginPath();
  points.forEach((v, i) => (i === 0 ? context.moveTo(x(i), y(v)) : context.lineTo(x(i), y(v))));
  context.globalAlpha = 1;
  context.strokeStyle = color;
  context.lineWidth = 1.5 * ratio;
  context.lineJoin = "round";
  context.stroke();
  context.lineTo(x(points.length - 1), h);
  context.lineTo(x(0), h);
  context.globalAlpha = 0.12;
  context.fill();
  context.globalAlpha = 1;
}
