// Elements by id, with the type that the page gives them.
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found as T;
}

export function show(node: HTMLElement, visible: boolean): void {
  node.hidden = !visible;
}

/** Paints RGBA bytes; a canvas takes the size of the image. */
export function paint(canvas: HTMLCanvasElement, rgba: Uint8Array, width: number, height: number): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    canvas.style.aspectRatio = `${width} / ${height}`;
  }
  if (rgba.length === 0) context.clearRect(0, 0, width, height);
  else context.putImageData(new ImageData(new Uint8ClampedArray(rgba), width, height), 0, 0);
}

export function seconds(s: number): string {
  if (!Number.isFinite(s)) return "";
  if (s < 60) return `${Math.ceil(s)} s`;
  const minutes = Math.floor(s / 60);
  return minutes < 60 ? `${minutes} min ${Math.round(s % 60)} s` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

export function bytes(n: number): string {
  return n < 1e6 ? `${(n / 1e3).toFixed(0)} kB` : `${(n / 1e6).toFixed(n < 1e8 ? 1 : 0)} MB`;
}
