// Runs that go on: after a reload, a crash, a lost device, and a lost 3D view.
import assert from "node:assert/strict";
import { cpSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { QUICK, done, download, failure, finish, finished, ready, setUp, stats, visit, world } from "./page.mjs";

setUp();

const RUN = `${QUICK}&source=room&frames=12&set.mapping.every=2`;
const state = (page) => page.evaluate(() => {
  const { done, kept, restoredAt, triangles } = window.mteSlam.run;
  return { done, kept, restoredAt, triangles };
});
/** Notes which frames are read from now on. */
const watch = (page) => page.evaluate(() => {
  window.read = [];
  window.mteSlam.slam.on("frame", (e) => window.read.push(e.index));
});

test("reload in the middle and go on: the same trajectory as without", { timeout: 240_000 }, async () => {
  const whole = await visit(`${RUN}&auto`);
  await finished(whole);
  const expected = (await download(whole, "trajectory")).toString();
  await finish(whole);

  const page = await visit(RUN);
  await page.locator("#begin").click();
  await done(page, 5);
  await page.locator("#toggle").click();
  await page.waitForFunction(() => !window.mteSlam.run.running && window.mteSlam.run.kept === window.mteSlam.run.done);
  const before = await state(page);
  await page.reload();
  await ready(page);
  assert.match(await page.locator("#kept-text").textContent(), new RegExp(`Living room: ${before.done} of 12 frames, just now`));
  await watch(page);
  await page.locator("#kept-go").click();
  await finished(page);
  const read = await page.evaluate(() => window.read);
  assert.equal(read[0], before.done, "went on from another frame");
  assert.equal(read.length, 12 - before.done);
  assert.equal(await page.evaluate(() => window.mteSlam.plots.count("tracking")), 12);
  assert.equal((await download(page, "trajectory")).toString(), expected);
  const { triangles, covered } = await stats(page);
  assert.ok(triangles > 300 && covered > 0.02, `${triangles} triangles, ${covered} covered`);

  // Its last state is kept after it was said to be done.
  await page.waitForFunction(() => window.mteSlam.run.kept === 12);
  // A finished run is shown again as it was, without a frame read.
  await page.reload();
  await ready(page);
  assert.equal(await page.locator("#kept-go").textContent(), "Show again");
  await watch(page);
  await page.locator("#kept-go").click();
  await finished(page);
  assert.deepEqual(await page.evaluate(() => window.read), []);
  assert.equal((await download(page, "trajectory")).toString(), expected);

  // And forgotten when asked to.
  await page.locator("#new-run").click();
  await page.locator("#kept-forget").click();
  await page.waitForFunction(() => document.getElementById("kept").hidden);
  await page.reload();
  await ready(page);
  assert.equal(await page.locator("#kept").isHidden(), true);
  await finish(page);
});

test("a folder is asked for again, and another one is refused", { timeout: 240_000 }, async () => {
  const page = await visit(`${QUICK}&set.mapping.every=2`);
  await page.locator("#folder-input").setInputFiles(world.recording);
  await page.locator("#begin").click();
  await done(page, 2);
  await page.locator("#toggle").click();
  await page.waitForFunction(() => !window.mteSlam.run.running && window.mteSlam.run.kept === window.mteSlam.run.done);
  const { kept } = await state(page);
  await page.reload();
  await ready(page);
  // Playwright cannot answer the picker, so the page takes the input that other browsers have.
  await page.evaluate(() => delete window.showDirectoryPicker);
  const [chooser] = await Promise.all([page.waitForEvent("filechooser"), page.locator("#kept-go").click()]);
  assert.match(await page.locator("#notice").textContent(), /Give “room” again/);
  const other = join(world.scratch, "kitchen");
  cpSync(world.recording, other, { recursive: true });
  await chooser.setFiles(other);
  assert.match(await failure(page, "bad-file"), /recording: found "kitchen", expected "room"/);
  await page.locator("#failure-actions button", { hasText: "New run" }).click();
  const [again] = await Promise.all([page.waitForEvent("filechooser"), page.locator("#kept-go").click()]);
  await watch(page);
  await again.setFiles(world.recording);
  await finished(page);
  assert.equal((await page.evaluate(() => window.read))[0], kept);
  await finish(page);
});

test("a crash of the engine's worker: go on from the state that was kept", { timeout: 240_000 }, async () => {
  const page = await visit(`${RUN}&auto`);
  await done(page, 4);
  // A hidden tab keeps its state, too: browsers may end it.
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { configurable: true, get: () => true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await page.waitForFunction(() => window.mteSlam.run.kept > 0);
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { configurable: true, get: () => false });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  assert.match(await page.locator("#notice").textContent(), /hidden/);
  const { kept } = await state(page);
  await Promise.all(page.workers().filter((w) => !/view/.test(w.url())).map((w) => w.evaluate(() => void setTimeout(() => { throw new RangeError("memory is exhausted"); }))));
  assert.match(await failure(page, "crashed"), /memory is exhausted/);
  await watch(page);
  await page.locator("#failure-actions button", { hasText: `Go on from frame` }).click();
  await finished(page);
  const read = await page.evaluate(() => window.read);
  assert.ok(read[0] >= kept && read[0] < 12 && read.at(-1) === 11, `${kept}, ${read}`);
  page.problems = page.problems.filter((p) => !/memory is exhausted/.test(p));
  await finish(page);
});

test("the 3D view is lost and comes back with the mesh", { timeout: 120_000 }, async () => {
  const page = await visit(`${QUICK}&source=room&frames=3&auto`);
  await finished(page);
  await page.locator('#shading [data-value="class"]').click();
  const before = await stats(page);
  const view = await Promise.all(page.workers().map((w) => w.evaluate(() => "view" in self))).then((all) => page.workers()[all.indexOf(true)]);
  await view.evaluate(() => self.view.loseContext());
  await page.waitForFunction(() => /3D view is back/.test(document.getElementById("notice").textContent));
  for (let i = 0; i < 100 && (await stats(page)).triangles !== before.triangles; i++) await page.waitForTimeout(200);
  const after = await stats(page);
  for (const i of [0, 1, 2]) assert.ok(Math.abs(after.mean[i] - before.mean[i]) < 1, `${after.mean}, ${before.mean}`);
  assert.equal(await page.locator("#failure").isHidden(), true);
  await finish(page);
});

test("WebGPU in software: the device is lost in the middle, and the run goes on by itself on a new one", { timeout: 540_000 }, async () => {
  const page = await visit("source=room&preset=tiny&engine=gpu&frames=4&width=64&mesh=15&render=0&set.mapping.rays=256&set.mapping.first_iterations=40&set.mapping.iterations=2&set.mapping.final_iterations=2&set.mapping.semantic_iterations=4&set.fusion.first_steps=4&set.tracking.align_pixels=256&set.tracking.render_rays=256&set.sampling.stratified=12");
  // A new worker has its own navigator: only the first device can be taken away.
  await Promise.all(page.workers().map((w) => w.evaluate(() => {
    const real = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...a) {
      self.device = await real.apply(this, a);
      return self.device;
    };
  })));
  const begun = Date.now();
  await watch(page);
  await page.locator("#begin").click();
  await done(page, 1, 280_000);
  await page.locator("#toggle").click();
  await page.waitForFunction(() => !window.mteSlam.run.running && window.mteSlam.run.kept === window.mteSlam.run.done, null, { timeout: 120_000 });
  const { kept } = await state(page);
  assert.ok(kept >= 1 && kept < 4, `${kept} frames`);
  await Promise.all(page.workers().map((w) => w.evaluate(() => self.device?.destroy())));
  await page.locator("#toggle").click();
  await page.waitForFunction(() => window.mteSlam.run.restoredAt >= 0, null, { timeout: 120_000 });
  assert.match(await page.locator("#notice").textContent(), new RegExp(`device was lost at frame ${kept}.*Going on from frame ${kept} on a new one`));
  await finished(page, 280_000);
  const read = (await page.evaluate(() => window.read)).slice(kept);
  // The frame at which it was lost is read a second time.
  assert.deepEqual(read.filter((i) => i >= kept).slice(-(4 - kept)), Array.from({ length: 4 - kept }, (_, i) => kept + i));
  const { triangles, covered } = await stats(page);
  const first = await page.evaluate(() => window.mteSlam.run.firstMap);
  assert.ok(first > 0, `${first} s`);
  console.log(`# WebGPU on a software adapter: first surface after ${first.toFixed(1)} s, 4 frames on two devices in ${((Date.now() - begun) / 1000).toFixed(0)} s, ${triangles} triangles`);
  assert.match(await page.locator("#engine").textContent(), /^GPU/);
  assert.ok(triangles > 50 && covered > 0.01, `${triangles} triangles, ${covered} covered`);
  await page.close();
});
