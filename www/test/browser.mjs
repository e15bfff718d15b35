// Chromium with WebGPU in software, and a static server for www/dist.
import { createServer } from "node:http";
import { readFile, stat } from "node:fs/promises";
import { existsSync } from "node:fs";
import { extname, join, normalize, resolve } from "node:path";
import { chromium } from "playwright-core";

const TYPES = {
  ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css",
  ".wasm": "application/wasm", ".svg": "image/svg+xml", ".json": "application/json",
  ".png": "image/png", ".jpg": "image/jpeg", ".txt": "text/plain", ".zip": "application/zip",
  ".bin": "application/octet-stream",
};

/** Serves folders by their prefix, with ranges and simple listings; `log` collects requests. */
export async function serve(roots) {
  const log = [];
  const server = createServer(async (request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://x").pathname);
    log.push({ path, range: request.headers.range });
    const prefix = Object.keys(roots).sort((a, b) => b.length - a.length).find((p) => path.startsWith(p));
    try {
      const root = resolve(roots[prefix]);
      let file = join(root, normalize(path.slice(prefix.length)));
      if (!file.startsWith(root)) throw new Error("outside");
      if ((await stat(file)).isDirectory()) file = join(file, "index.html");
      const data = await readFile(file);
      const head = { "Content-Type": TYPES[extname(file)] ?? "application/octet-stream", "Cache-Control": "no-store" };
      const range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
      if (range) {
        const [first, last] = [Number(range[1]), Math.min(Number(range[2]), data.length - 1)];
        response.writeHead(206, { ...head, "Content-Range": `bytes ${first}-${last}/${data.length}` });
        response.end(data.subarray(first, last + 1));
      } else {
        response.writeHead(200, head);
        response.end(data);
      }
    } catch {
      response.writeHead(404);
      response.end("not found");
    }
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { url: `http://localhost:${server.address().port}`, log, close: () => server.close() };
}

export function executable() {
  const known = [process.env.MTE_SLAM_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  return known.find((path) => path && existsSync(path));
}

/** `gpu: false` starts a browser without WebGPU. */
export async function launch({ gpu = true } = {}) {
  const executablePath = executable();
  if (!executablePath) throw new Error("no Chromium found; install it or set MTE_SLAM_CHROMIUM");
  return chromium.launch({
    executablePath,
    args: [
      "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
      "--js-flags=--expose-gc",
      ...(gpu ? ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"] : ["--disable-features=WebGPU", "--disable-webgpu"]),
    ],
  });
}
