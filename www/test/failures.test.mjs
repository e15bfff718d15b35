// Every way in which a run can fail, and what the page says then.
import assert from "node:assert/strict";
import { cpSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { DIST, QUICK, dismiss, done, failure, finish, finished, setUp, visit, world } from "./page.mjs";
import { launch } from "./browser.mjs";
import { files } from "./zip.mjs";

setUp();

test("what is wrong with a recording is said", { timeout: 120_000 }, async () => {
  const broken = join(world.scratch, "broken");
  cpSync(world.recording, broken, { recursive: true });
  const victim = files(broken).find((f) => /depth0*2\.png$/.test(f));
  writeFileSync(join(broken, victim), readFileSync(join(broken, victim)).subarray(0, 100));
  const page = await visit(QUICK);
  await page.locator("#folder-input").setInputFiles(broken);
  await page.locator("#begin").click();
  assert.match(await failure(page, "bad-file"), /depth0*2\.png.*frame 2/s);
  await page.locator("#failure-actions button", { hasText: "New run" }).click();

  const empty = join(world.scratch, "other");
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

test("without WebGL: said, and the mapping goes on", { timeout: 120_000 }, async () => {
  // Workers cannot be patched before they start, so the page is served with a view that gets no context.
  const copy = join(world.scratch, "no-webgl");
  cpSync(DIST, copy, { recursive: true });
  const views = files(copy).filter((name) => /worker-[^/]*\.js$/.test(name) && readFileSync(join(copy, name), "utf8").includes("webgl2"));
  assert.equal(views.length, 1);
  writeFileSync(join(copy, views[0]), `OffscreenCanvas.prototype.getContext = () => null;\n${readFileSync(join(copy, views[0]), "utf8")}`);
  const page = await visit(`${QUICK}&source=room&frames=2&auto`, { to: `${world.server.url}/data/no-webgl/` });
  assert.match(await failure(page, "viewer"), /WebGL 2/);
  await page.locator("#failure-actions button", { hasText: "Go on without it" }).click();
  await finished(page);
  assert.ok((await page.evaluate(() => window.mteSlam.run.triangles)) > 100);
  await finish(page);
});

test("no WebGPU, and adapters that refuse, are too small, or go away", { timeout: 240_000 }, async () => {
  const page = await visit(`${QUICK}&source=room&frames=3`.replace("engine=cpu", "engine=gpu"));
  const patch = (code) => Promise.all(page.workers().map((w) => w.evaluate(code)));
  const begin = () => dismiss(page).then(() => page.evaluate(() => window.mteSlam.slam.open({ kind: "built-in", scene: "room", frames: 3, width: 64, noise: false },
    { engine: "gpu", preset: "tiny", renderEvery: 0, overrides: { "mapping.rays": 128, "mapping.first_iterations": 4 } }).then((ok) => ok && window.mteSlam.slam.start())));

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
