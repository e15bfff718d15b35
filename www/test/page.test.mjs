// The page as people use it, in Chromium. Long runs use the CPU engine in WebAssembly: WebGPU is
// in software here, and has tests of its own at the end.
//
// MTE_SLAM_BIN     the native program (for `serve` and for making a recording)
// MTE_SLAM_DATA    a folder with room-11 and kitchen-7scenes, for tests with real files (optional)
// MTE_SLAM_SHOTS   a folder for screenshots (optional)
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, serve } from "./browser.mjs";
import { files, zip } from "./zip.mjs";

const DIST = process.env.MTE_SLAM_DIST ?? fileURLToPath(new URL("../dist", import.meta.url));
const BIN = process.env.MTE_SLAM_BIN;
const DATA = process.env.MTE_SLAM_DATA;
const SHOTS = process.env.MTE_SLAM_SHOTS;
/** Small enough for a second a frame on one thread. */
const QUICK = "preset=tiny&engine=cpu&width=64&mesh=12&render=4&set.mapping.rays=300&set.mapping.first_iterations=50&set.mapping.iterations=4&set.mapping.final_iterations=4&set.sampling.render_stratified=24&set.sampling.render_surface=6&set.mesh.resolution_m=0.1&set.mesh.min_component_triangles=1";

let browser;
let server;
let scratch;
let recording;

before(async () => {
  assert.ok(existsSync(join(DIST, "index.html")), "www/dist is not built: run scripts/build-web.sh");
  assert.ok(BIN && existsSync(BIN), "MTE_SLAM_BIN does not name the native program");
  scratch = mkdtempSync(join(tmpdir(), "mte-slam-page-"));
  recording = join(scratch, "room");
  const made = spawnSync(BIN, ["synth", recording, "--frames", "6", "--width", "64"], { encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  writeFileSync(join(recording, "files.json"), JSON.stringify(files(recording)));
  writeFileSync(join(scratch, "room.zip"), zip(recording, "room"));
  if (SHOTS) mkdirSync(SHOTS, { recursive: true });
  browser = await launch();
  // A sub-path, as on GitHub Pages.
  server = await serve({ "/some/where/": DIST, "/data/": scratch });
});

after(async () => {
  await browser?.close();
  server?.close();
  if (scratch) rmSync(scratch, { recursive: true, force: true });
});

/** A page that fails the test on errors in it, and on requests to anybody else. */
async function visit(query = "", { to = `${server.url}/some/where/`, context, width = 1280, height = 800, scheme } = {}) {
  const page = await (context ?? browser).newPage({ viewport: { width, height }, colorScheme: scheme });
  page.problems = [];
  page.on("pageerror", (e) => page.problems.push(e.message));
  page.on("console", (m) => {
    if (m.type() === "error" && !/Failed to load resource/.test(m.text())) page.problems.push(m.text());
  });
  page.on("request", (r) => {
    if (!/^(http:\/\/(localhost|127\.0\.0\.1)[:/]|blob:|data:)/.test(r.url())) page.problems.push(`request to ${r.url()}`);
  });
  await page.goto(to + (query ? `?${query}` : ""));
  await page.waitForFunction(() => window.mteSlam && !document.getElementById("gpu-note").textContent.startsWith("Looking"));
  return page;
}

const done = (page, n, timeout = 120_000) =>
  page.waitForFunction((n) => window.mteSlam.run.done >= n || !document.getElementById("failure").hidden, n, { timeout });
const finished = async (page, timeout = 120_000) => {
  await page.waitForFunction(() => window.mteSlam.run.finished || !document.getElementById("failure").hidden, null, { timeout });
  assert.equal(await page.locator("#failure").isHidden(), true, await page.locator("#failure-text").textContent());
};
const stats = (page) => page.evaluate(() => window.mteSlam.view.stats());
const failure = async (page, kind, timeout = 60_000) => {
  await page.waitForFunction(() => !document.getElementById("failure").hidden, null, { timeout });
  assert.equal(await page.locator("#failure").getAttribute("data-kind"), kind, await page.locator("#failure-text").textContent());
  return page.locator("#failure-text").textContent();
};
/** Puts the pane away, so that the next one is seen to come. */
const dismiss = (page) => page.evaluate(() => (document.getElementById("failure").hidden = true));
async function download(page, kind) {
  const [file] = await Promise.all([page.waitForEvent("download", { timeout: 90_000 }), page.locator(`[data-kind="${kind}"]`).click()]);
  return readFileSync(await file.path());
}
async function finish(page) {
  assert.deepEqual(page.problems, []);
  await page.close();
}

test("a first visit: start the built-in room, watch it grow, use everything", { timeout: 240_000 }, async () => {
  const page = await visit(QUICK.replace("preset=tiny&engine=cpu&", ""));
  await page.locator("#preset").selectOption("tiny");
  await page.locator("#engine-choice").selectOption("cpu");
  await page.locator(".more summary").click();
  await page.locator("#frames").fill("60");
  await page.locator("#begin").click();
  await done(page, 2);
  assert.match(await page.locator("#run-name").textContent(), /synthetic-room, 60 frames of 64 × 48/);
  const early = await page.evaluate(() => ({ t: window.mteSlam.run.triangles, n: window.mteSlam.plots.count("tracking") }));
  await done(page, 8);
  const later = await page.evaluate(() => ({ t: window.mteSlam.run.triangles, n: window.mteSlam.plots.count("tracking") }));
  assert.ok(later.t > 500, `${later.t} triangles`);
  assert.ok(later.t > early.t || early.t > 500, `the mesh does not grow: ${early.t}, ${later.t}`);
  assert.ok(later.n > early.n, "the plots do not move");
  assert.match(await page.locator("#plot-ate .value").textContent(), /^\d+\.\d\d/);

  // Images on both sides.
  for (const id of ["in-color", "in-depth", "in-classes", "out-color", "out-depth", "out-classes"]) {
    const painted = await page.evaluate((id) => {
      const c = document.getElementById(id);
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      return new Set(Array.from({ length: d.length / 4 }, (_, i) => d[4 * i] * 65536 + d[4 * i + 1] * 256 + d[4 * i + 2])).size;
    }, id);
    assert.ok(painted > 3, `${id} shows ${painted} colours`);
  }

  // Pause holds.
  await page.locator("#toggle").click();
  await page.waitForFunction(() => document.getElementById("toggle").textContent === "Resume");
  const held = await page.evaluate(() => window.mteSlam.run.done);
  await page.waitForTimeout(1500);
  assert.equal(await page.evaluate(() => window.mteSlam.run.done), held);
  await page.locator("#step").click();
  await done(page, held + 1);

  // An earlier frame's view of the map.
  await page.waitForFunction(() => !document.getElementById("seek").disabled);
  const pixels = () => page.evaluate(() => document.getElementById("out-color").toDataURL());
  const shown = await pixels();
  await page.locator("#seek").fill("1");
  await page.waitForFunction((old) => document.getElementById("out-color").toDataURL() !== old, shown);
  assert.equal(await page.locator("#seek-value").textContent(), "1");

  // Pixels of the view, then orbit by mouse and by keyboard.
  const first = await stats(page);
  assert.ok(first.triangles > 500 && first.covered > 0.03, JSON.stringify(first));
  const box = await page.locator("#view").boundingBox();
  await page.mouse.move(box.x + 300, box.y + 300);
  await page.mouse.down();
  await page.mouse.move(box.x + 420, box.y + 330, { steps: 6 });
  await page.mouse.up();
  const turned = await stats(page);
  assert.notDeepEqual(turned.eye, first.eye);
  await page.locator("#view").focus();
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("+");
  const zoomed = await stats(page);
  assert.notDeepEqual(zoomed.eye, turned.eye);
  await page.keyboard.press("f");
  assert.equal(await page.locator("#follow").getAttribute("aria-pressed"), "true");
  await page.locator("#fit").click();

  // Shadings change the picture.
  const plain = await stats(page);
  await page.locator('#shading [data-value="class"]').click();
  const classes = await stats(page);
  assert.notDeepEqual(classes.mean, plain.mean);

  // A hidden class leaves the picture, and comes back.
  const boxes = page.locator("#legend input");
  assert.ok((await boxes.count()) > 5);
  await page.locator('#legend input[data-class="wall"]').uncheck();
  await page.mouse.move(box.x + 5, box.y + 5);
  const hidden = await stats(page);
  assert.ok(hidden.covered < classes.covered * 0.95, `${hidden.covered} of ${classes.covered}`);
  await page.locator('#legend input[data-class="wall"]').check();

  // A click names the surface under it.
  const names = new Set(await boxes.evaluateAll((all) => all.map((b) => b.dataset.class)));
  let named = "";
  for (const [x, y] of [[0.5, 0.5], [0.5, 0.6], [0.45, 0.4], [0.6, 0.5], [0.4, 0.55], [0.55, 0.35]]) {
    await page.mouse.click(box.x + box.width * x, box.y + box.height * y);
    await page.waitForTimeout(200);
    if (await page.locator("#picked").isVisible()) {
      named = await page.locator("#picked").getAttribute("data-class");
      break;
    }
  }
  assert.ok(names.has(named), `clicked ${JSON.stringify(named)}`);

  // Exports parse.
  const ply = await download(page, "ply");
  const head = ply.subarray(0, ply.indexOf("end_header\n") + 11).toString();
  const [, vertices] = /element vertex (\d+)/.exec(head);
  const [, faces] = /element face (\d+)/.exec(head);
  assert.ok(Number(vertices) > 100 && Number(faces) > 100, head);
  const sizes = { float: 4, uchar: 1, int: 4, uint: 4, ushort: 2, short: 2, char: 1 };
  const row = [...head.split("element face")[0].matchAll(/property (\w+) \w+/g)].reduce((n, m) => n + sizes[m[1]], 0);
  assert.ok(ply.length > head.length + Number(vertices) * row + Number(faces) * 13 - 1, "the PLY is cut off");
  const glb = await download(page, "glb");
  assert.equal(glb.toString("latin1", 0, 4), "glTF");
  assert.equal(glb.readUInt32LE(8), glb.length);
  const json = JSON.parse(glb.toString("utf8", 20, 20 + glb.readUInt32LE(12)));
  assert.ok(json.meshes.length > 0 && json.accessors.length > 1);
  const processed = await page.evaluate(() => window.mteSlam.run.done);
  const trajectory = (await download(page, "trajectory")).toString().trim().split("\n").filter((l) => !l.startsWith("#"));
  assert.equal(trajectory.length, processed);
  assert.ok(trajectory.every((line) => line.split(" ").map(Number).filter(Number.isFinite).length === 8));
  const metrics = JSON.parse((await download(page, "metrics")).toString());
  assert.equal(metrics.frames_processed, processed);
  assert.ok(metrics.trajectory.aligned_cm.rmse < 20);
  const checkpoint = await download(page, "checkpoint");
  const header = JSON.parse(checkpoint.toString("utf8", 8, 8 + Number(checkpoint.readBigUInt64LE(0))));
  assert.equal(header["decoders.values"].dtype, "F32");

  // The address holds the run: a reload in the middle goes on with the same settings.
  assert.match(page.url(), /source=room.*preset=tiny.*engine=cpu/);
  await page.reload();
  await page.waitForFunction(() => window.mteSlam && !document.getElementById("gpu-note").textContent.startsWith("Looking"));
  assert.equal(await page.locator("#preset").inputValue(), "tiny");
  assert.equal(await page.locator("#frames").inputValue(), "60");
  await page.locator("#begin").click();
  await done(page, 1);
  await finish(page);
});

test("a folder, a zip, a zip and a folder on a server", { timeout: 240_000 }, async () => {
  const page = await visit(QUICK);
  await page.locator("#folder-input").setInputFiles(recording);
  assert.match(await page.locator("#folder-name").textContent(), /room, \d+ files/);
  await page.locator("#begin").click();
  await finished(page);
  assert.match(await page.locator("#run-name").textContent(), /room, 6 frames of 64 × 48, replica/);
  const folder = await page.evaluate(() => ({ t: window.mteSlam.run.triangles, classes: window.mteSlam.run.opened.classes.length }));
  assert.ok(folder.t > 300 && folder.classes > 5, JSON.stringify(folder));

  // Dropped on the running page; the same frames give the same mesh, to the triangle.
  const bytes = [...readFileSync(join(scratch, "room.zip"))];
  await page.evaluate((bytes) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(bytes)], "room.zip"));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, bytes);
  await page.waitForFunction(() => !window.mteSlam.run.finished);
  await finished(page);
  assert.equal(await page.evaluate(() => window.mteSlam.run.triangles), folder.t);
  await finish(page);

  for (const name of ["room.zip", "room/"]) {
    const before = server.log.length;
    const remote = await visit(`${QUICK}&auto&source=${server.url}/data/${name}`);
    await finished(remote);
    assert.equal(await remote.evaluate(() => window.mteSlam.run.triangles), folder.t);
    const asked = server.log.slice(before).filter((r) => r.path.startsWith("/data/"));
    if (name === "room.zip") assert.ok(asked.length > 1 && asked.every((r) => r.range), "the archive was not read by ranges");
    await finish(remote);
  }
});

/** `mte-slam serve`; resolves with its address. */
async function serving(arguments_, port = 0) {
  const child = spawn(BIN, ["--json", "serve", ...arguments_, "--port", String(port), "--page", DIST]);
  let out = "";
  await new Promise((resolve, reject) => {
    child.stdout.on("data", (text) => {
      out += text;
      if (out.includes("\n")) resolve();
    });
    child.on("exit", (code) => reject(new Error(`serve ended with ${code}`)));
  });
  const url = JSON.parse(out).url;
  const end = () => new Promise((resolve) => {
    child.removeAllListeners("exit");
    child.on("exit", resolve);
    child.kill("SIGKILL");
  });
  return { url, port: Number(new URL(url).port), end };
}

test("mte-slam serve: stream, lose the server, resume", { timeout: 240_000 }, async () => {
  let native = await serving([recording]);
  const page = await visit(`${QUICK}&source=serve`, { to: native.url });
  assert.equal(await page.locator("#serve-card").isVisible(), true);
  await page.locator("#begin").click();
  await done(page, 2);
  // Frames are small, so the browser may hold them all: pausing and going back is what asks again.
  await page.locator("#toggle").click();
  await finishedOrPaused(page);
  await native.end();
  // A fresh open of a stream that is gone.
  await page.evaluate(() => window.mteSlam.slam.open({ kind: "serve", url: location.href.split("?")[0] }, { engine: "cpu", preset: "tiny" }));
  assert.match(await failure(page, "server-gone"), /api\/info/);
  native = await serving([recording], native.port);
  await page.locator("#failure-actions button", { hasText: "New run" }).click();
  await page.locator("#begin").click();
  await finished(page);
  assert.equal(await page.evaluate(() => window.mteSlam.run.done), 6);
  await native.end();
  page.problems = page.problems.filter((p) => !/ERR_CONNECTION|Failed to fetch/.test(p));
  await finish(page);
});
async function finishedOrPaused(page) {
  await page.waitForFunction(() => !window.mteSlam.run.running);
}

test("a stream that breaks off is resumed at the frame it was at", { timeout: 240_000 }, async () => {
  // Large frames: the browser cannot hold all of them before the server goes.
  const big = join(scratch, "big");
  assert.equal(spawnSync(BIN, ["synth", big, "--frames", "30", "--width", "640"]).status, 0);
  let native = await serving([big]);
  const page = await visit(`${QUICK}&source=serve&auto&set.mapping.every=10`, { to: native.url });
  await done(page, 1);
  await native.end();
  const text = await failure(page, "server-gone", 120_000);
  assert.match(text, /stream|server|fetch/i);
  const at = await page.evaluate(() => window.mteSlam.run.done);
  assert.ok(at >= 1 && at < 30, `${at} frames were held by the browser`);
  native = await serving([big], native.port);
  await page.locator("#failure-actions button", { hasText: "Resume" }).click();
  await done(page, at + 1);
  assert.equal(await page.locator("#failure").isHidden(), true);
  await native.end();
  await page.close();
});

test("what is wrong with a recording is said", { timeout: 120_000 }, async () => {
  const broken = join(scratch, "broken");
  cpSync(recording, broken, { recursive: true });
  const victim = files(broken).find((f) => /depth0*2\.png$/.test(f));
  writeFileSync(join(broken, victim), readFileSync(join(broken, victim)).subarray(0, 100));
  const page = await visit(QUICK);
  await page.locator("#folder-input").setInputFiles(broken);
  await page.locator("#begin").click();
  assert.match(await failure(page, "bad-file"), /depth0*2\.png.*frame 2/s);
  await page.locator("#failure-actions button", { hasText: "New run" }).click();

  const empty = join(scratch, "other");
  mkdirSync(empty);
  writeFileSync(join(empty, "readme.txt"), "no recording");
  await page.locator("#folder-input").setInputFiles(empty);
  await page.locator("#begin").click();
  assert.match(await failure(page, "bad-file"), /replica needs results\/frame/);

  await dismiss(page);
  await page.evaluate(() => window.mteSlam.slam.open({ kind: "zip", name: "x.zip", file: new Blob(["not a zip"]) }, { engine: "cpu" }));
  assert.match(await failure(page, "bad-file"), /expected a zip archive/);
  await dismiss(page);
  for (const [settings, part] of [[{ preset: "nonsense" }, /nonsense/], [{ overrides: { "mapping.rayz": 3 } }, /rayz/], [{ colour: 1 }, /colour/]]) {
    await page.evaluate((s) => window.mteSlam.slam.open({ kind: "built-in", scene: "room", frames: 3, width: 64, noise: false }, { engine: "cpu", ...s }), settings);
    assert.match(await failure(page, "bad-settings"), part);
    await dismiss(page);
  }
  // A map beyond what a buffer may hold, with the numbers.
  await page.evaluate(() => window.mteSlam.slam.open({ kind: "built-in", scene: "room", frames: 3, width: 64, noise: false },
    { engine: "cpu", preset: "tiny", overrides: { "field.surface_fine_m": 0.004 } }).then(() => window.mteSlam.slam.start()));
  assert.match(await failure(page, "out-of-memory"), /MiB/);
  await finish(page);
});

test("without WebGPU: said, and the processor offered", { timeout: 120_000 }, async () => {
  const plain = await launch({ gpu: false });
  try {
    const page = await visit(`${QUICK}&source=room&frames=3&auto`.replace("engine=cpu", "engine=gpu"), { context: plain });
    const kind = await page.evaluate(async () => ("gpu" in navigator && (await navigator.gpu?.requestAdapter()) === null ? "adapter" : "no-webgpu"));
    await failure(page, kind);
    await page.locator("#failure-actions button", { hasText: "Use the processor" }).click();
    await finished(page);
    await finish(page);
    // `auto` goes on by itself, with a warning.
    const auto = await visit(`${QUICK}&source=room&frames=2&auto`.replace("engine=cpu", "engine=auto"), { context: plain });
    await done(auto, 1);
    assert.match(await auto.locator("#engine").getAttribute("class"), /warn/);
    assert.match(await auto.locator("#engine").getAttribute("title"), /WebGPU|adapter/);
    await finish(auto);
  } finally {
    await plain.close();
  }
});

test("no WebGPU, and adapters that refuse, are too small, or go away", { timeout: 240_000 }, async () => {
  const page = await visit(`${QUICK}&source=room&frames=3`.replace("engine=cpu", "engine=gpu"));
  const patch = (code) => Promise.all(page.workers().map((w) => w.evaluate(code)));
  const begin = () => dismiss(page).then(() => page.evaluate(() => window.mteSlam.slam.open({ kind: "built-in", scene: "room", frames: 3, width: 64, noise: false },
    { engine: "gpu", preset: "tiny", unroll: false, renderEvery: 0, overrides: { "mapping.rays": 128, "mapping.first_iterations": 4 } }).then((ok) => ok && window.mteSlam.slam.start())));

  await patch(() => {
    self.realGpu = Object.getOwnPropertyDescriptor(WorkerNavigator.prototype, "gpu");
    Object.defineProperty(WorkerNavigator.prototype, "gpu", { configurable: true, get: () => undefined });
  });
  await begin();
  await failure(page, "no-webgpu");
  assert.match(await page.locator("#failure-help").textContent(), /Chrome and Edge.*Safari.*Firefox/);
  await patch(() => {
    Object.defineProperty(WorkerNavigator.prototype, "gpu", self.realGpu);
    self.realRequest = GPU.prototype.requestAdapter;
    GPU.prototype.requestAdapter = async () => null;
  });
  await begin();
  await failure(page, "adapter");
  await patch(() => {
    GPU.prototype.requestAdapter = self.realRequest;
    self.realLimits = Object.getOwnPropertyDescriptor(GPUAdapter.prototype, "limits");
    Object.defineProperty(GPUAdapter.prototype, "limits", {
      configurable: true,
      get() {
        const real = self.realLimits.get.call(this);
        const copy = {};
        for (const key in real) if (typeof real[key] === "number") copy[key] = real[key];
        return Object.assign(copy, { maxStorageBuffersPerShaderStage: 4 });
      },
    });
  });
  await begin();
  assert.match(await failure(page, "limits"), /4.*8/);
  await patch(() => {
    Object.defineProperty(GPUAdapter.prototype, "limits", self.realLimits);
    const real = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...a) {
      self.device = await real.apply(this, a);
      return self.device;
    };
  });
  void begin();
  await page.waitForFunction(() => window.mteSlam.run.opened && window.mteSlam.run.running, null, { timeout: 60_000 });
  await patch(() => self.device?.destroy());
  await failure(page, "device-lost", 120_000);
  // Running again makes a new worker and a new device.
  await page.evaluate(() => (window.mteSlam.run.choice.settings.engine = "cpu"));
  await page.evaluate(() => (window.mteSlam.run.source = { kind: "built-in", scene: "room", frames: 2, width: 64, noise: false }));
  await page.locator("#failure-actions button", { hasText: "Run again" }).click();
  await finished(page);
  await page.close();
});

test("the page stays responsive while mapping", { timeout: 120_000 }, async () => {
  const page = await visit(`${QUICK}&source=room&frames=40&auto`);
  await done(page, 1);
  await page.evaluate(() => {
    window.tasks = [];
    new PerformanceObserver((list) => window.tasks.push(...list.getEntries().map((e) => e.duration))).observe({ entryTypes: ["longtask"] });
  });
  const before = await stats(page);
  const box = await page.locator("#view").boundingBox();
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.mouse.down();
  const start = Date.now();
  for (let i = 0; Date.now() - start < 4000; i++) {
    await page.mouse.move(box.x + 200 + (i % 100), box.y + 200);
    await page.waitForTimeout(12);
  }
  const seconds = (Date.now() - start) / 1000;
  await page.mouse.up();
  const after = await stats(page);
  const longest = await page.evaluate(() => Math.max(0, ...window.tasks));
  const rate = (after.frames - before.frames) / seconds;
  console.log(`# longest main-thread task ${longest.toFixed(0)} ms (0: none of 50 ms or more), view ${rate.toFixed(1)} pictures a second while mapping (WebGL in software)`);
  assert.ok(longest < 250, `${longest} ms`);
  assert.ok(rate > 3, `${rate} pictures a second`);
  await finish(page);
});

test("memory over 200 frames: flat, but for what the odometry keeps of its keyframes", { timeout: 240_000 }, async () => {
  const page = await visit("source=room&preset=tiny&engine=cpu&width=48&frames=200&mesh=20&render=0&set.mapping.rays=64&set.mapping.iterations=2&set.mapping.first_iterations=10&set.mapping.final_iterations=2&set.tracking.align_pixels=128&set.keyframes.budget_mib=1");
  await page.evaluate(() => {
    window.memory = [];
    window.mteSlam.slam.on("metrics", (m) => window.memory.push([m.index, m.wasmBytes, m.deviceBytes]));
    document.getElementById("begin").click();
  });
  const heap = () => page.evaluate(() => (window.gc?.(), performance.memory.usedJSHeapSize));
  await done(page, 60);
  const heapBefore = await heap();
  await done(page, 200, 200_000);
  const heapAfter = await heap();
  const rows = await page.evaluate(() => window.memory);
  const at = (i) => rows.find((r) => r[0] >= i);
  const [early, late] = [at(60), at(199)];
  const mb = (n) => (n / 1e6).toFixed(1);
  console.log(`# frames 60 to 199: wasm ${mb(early[1])} to ${mb(late[1])} MB, device ${mb(early[2])} to ${mb(late[2])} MB, heap ${mb(heapBefore)} to ${mb(heapAfter)} MB`);
  // At this size every frame is a keyframe of the odometry, with about 100 bytes a pixel.
  const keyframes = 140 * 48 * 36 * 110;
  assert.ok(late[1] - early[1] <= keyframes, `the module's memory grows by ${late[1] - early[1]} bytes, the keyframes' share is ${keyframes}`);
  assert.ok(late[2] <= early[2], "the device's memory grows");
  assert.ok(heapAfter <= heapBefore * 1.5 + 3e6, "the heap grows");
  await finish(page);
});

test("every control has a name, and the layout holds from 360 pixels to 4K", { timeout: 240_000 }, async () => {
  const sizes = [[360, 740], [768, 1024], [1280, 800], [2560, 1440], [3840, 2160]];
  for (const [width, height] of sizes) {
    const page = await visit("", { width, height, scheme: "dark" });
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `${width}: ${wide} pixels too wide`);
    const nameless = await page.evaluate(() => {
      const name = (e) => e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim() || e.title;
      return [...document.querySelectorAll("button, input:not([type=file]), select, canvas, a, [role=progressbar]")].filter((e) => !name(e)).map((e) => e.outerHTML);
    });
    assert.deepEqual(nameless, []);
    const cut = await page.evaluate(() => {
      for (const id of ["toggle", "step", "tools", "new-run"]) document.getElementById(id).hidden = false;
      document.getElementById("status").textContent = "Optimising the map, 100 %";
      document.getElementById("eta").textContent = "100 of 120 frames, about 3 min 20 s left";
      const place = (id) => document.getElementById(id).getBoundingClientRect();
      return ["eta", "status", "progress", "step", "truth-shown", "theme"].filter((id) => place(id).right > innerWidth + 0.5);
    });
    assert.deepEqual(cut, [], `${width}: beyond the right edge`);
    if (SHOTS) await page.screenshot({ path: join(SHOTS, `start-${width}.png`) });
    const small = await page.evaluate(() =>
      [...document.querySelectorAll("button, select")].filter((e) => e.offsetParent && e.id !== "legend-all" && e.getBoundingClientRect().height < 24).map((e) => e.id));
    assert.deepEqual(small, [], "too small for a finger");
    await page.close();
  }
  // Text is readable in both themes (WCAG AA).
  for (const scheme of ["dark", "light"]) {
    const page = await visit("", { scheme });
    const worst = await page.evaluate(() => {
      const light = (hex) => {
        const c = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255).map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
        return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
      };
      const style = getComputedStyle(document.documentElement);
      const value = (n) => light(style.getPropertyValue(n).trim().replace(/^#(.)(.)(.)$/, "#$1$1$2$2$3$3"));
      const ratio = (a, b) => (Math.max(value(a), value(b)) + 0.05) / (Math.min(value(a), value(b)) + 0.05);
      return Math.min(...[["--text", "--panel"], ["--muted", "--panel"], ["--muted", "--raised"], ["--muted", "--stage"], ["--accent", "--panel"], ["--on-accent", "--accent"], ["--bad", "--panel"], ["--truth", "--panel"]].map(([a, b]) => ratio(a, b)));
    });
    assert.ok(worst >= 4.5, `${scheme}: contrast ${worst.toFixed(2)}`);
    await page.close();
  }
});

test("WebGPU: the built-in room on the browser's own adapter", { timeout: 300_000 }, async () => {
  const page = await visit("source=room&preset=tiny&engine=gpu&frames=3&width=64&mesh=15&render=0&auto&set.mapping.rays=256&set.mapping.first_iterations=60&set.mapping.iterations=2&set.mapping.final_iterations=2&set.tracking.align_pixels=256&set.tracking.render_rays=256&set.sampling.stratified=12");
  const start = Date.now();
  await finished(page, 280_000);
  const { triangles, covered } = await stats(page);
  console.log(`# WebGPU on a software adapter: 3 frames in ${((Date.now() - start) / 1000).toFixed(0)} s, ${triangles} triangles`);
  assert.match(await page.locator("#engine").textContent(), /^GPU/);
  assert.ok(triangles > 50 && covered > 0.01, `${triangles} triangles, ${covered} covered`);
  await finish(page);
});

test("real recordings", { skip: !DATA && "MTE_SLAM_DATA is not set", timeout: 300_000 }, async () => {
  const part = join(scratch, "room-11");
  mkdirSync(part);
  for (const name of files(join(DATA, "room-11"))) {
    const frame = /(\d{4,6})\.(jpg|png)$/.exec(name);
    if (/noisy|mesh/.test(name) || (frame && Number(frame[1]) >= 4)) continue;
    cpSync(join(DATA, "room-11", name), join(part, name), { recursive: true });
  }
  writeFileSync(join(scratch, "room-11.zip"), zip(part, "room-11"));
  const page = await visit(`${QUICK}&frames=4&scale=0.25`);
  await page.locator("#folder-input").setInputFiles(part);
  await page.locator("#begin").click();
  await finished(page);
  const folder = await page.evaluate(() => window.mteSlam.run.triangles);
  assert.ok(folder > 300, `${folder} triangles`);
  await page.locator("#new-run").click();
  await page.locator("#zip-input").setInputFiles(join(scratch, "room-11.zip"));
  await page.locator("#begin").click();
  await page.waitForFunction(() => !window.mteSlam.run.finished);
  await finished(page);
  assert.equal(await page.evaluate(() => window.mteSlam.run.triangles), folder);
  await finish(page);

  const native = await serving([join(DATA, "kitchen-7scenes"), "--scale", "0.2", "--frames", "12"]);
  const kitchen = await visit(`${QUICK}&source=serve&auto`, { to: native.url });
  await finished(kitchen, 240_000);
  const state = await kitchen.evaluate(() => ({ done: window.mteSlam.run.done, lost: window.mteSlam.run.lost, t: window.mteSlam.run.triangles }));
  assert.ok(state.done === 12 && state.lost === 0 && state.t > 300, JSON.stringify(state));
  await native.end();
  await finish(kitchen);
});
