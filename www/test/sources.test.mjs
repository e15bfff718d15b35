// Recordings from everywhere: folders, archives, servers, `mte-slam serve`, and real ones.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { cpSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { BIN, DATA, NO_DATA, QUICK, done, failure, finish, finished, serving, setUp, visit, world } from "./page.mjs";
import { files, zip } from "./zip.mjs";

setUp();

test("a folder, a zip, a zip and a folder on a server", { timeout: 240_000 }, async () => {
  const page = await visit(QUICK);
  await page.locator("#folder-input").setInputFiles(world.recording);
  assert.match(await page.locator("#folder-name").textContent(), /room, \d+ files/);
  await page.locator("#begin").click();
  await finished(page);
  assert.match(await page.locator("#run-name").textContent(), /room, 6 frames of 64 × 48, replica/);
  const folder = await page.evaluate(() => ({ t: window.mteSlam.run.triangles, classes: window.mteSlam.run.opened.classes.length }));
  assert.ok(folder.t > 300 && folder.classes > 5, JSON.stringify(folder));

  // Dropped on the running page; the same frames give the same mesh, to the triangle.
  const bytes = [...readFileSync(join(world.scratch, "room.zip"))];
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
    const before = world.server.log.length;
    const remote = await visit(`${QUICK}&auto&source=${world.server.url}/data/${name}`);
    await finished(remote);
    assert.equal(await remote.evaluate(() => window.mteSlam.run.triangles), folder.t);
    const asked = world.server.log.slice(before).filter((r) => r.path.startsWith("/data/"));
    if (name === "room.zip") assert.ok(asked.length > 1 && asked.every((r) => r.range), "the archive was not read by ranges");
    await finish(remote);
  }
});

test("mte-slam serve: stream, lose the server, resume", { timeout: 240_000 }, async () => {
  let native = await serving([world.recording]);
  const page = await visit(`${QUICK}&source=serve`, { to: native.url });
  assert.equal(await page.locator("#serve-card").isVisible(), true);
  await page.locator("#begin").click();
  await done(page, 2);
  // Frames are small, so the browser may hold them all: pausing and going back is what asks again.
  await page.locator("#toggle").click();
  await page.waitForFunction(() => !window.mteSlam.run.running);
  await native.end();
  // A fresh open of a stream that is gone.
  await page.evaluate(() => window.mteSlam.slam.open({ kind: "serve", url: location.href.split("?")[0] }, { engine: "cpu", preset: "tiny" }));
  assert.match(await failure(page, "server-gone"), /api\/info/);
  native = await serving([world.recording], native.port);
  await page.locator("#failure-actions button", { hasText: "New run" }).click();
  await page.locator("#begin").click();
  await finished(page);
  assert.equal(await page.evaluate(() => window.mteSlam.run.done), 6);
  await native.end();
  page.problems = page.problems.filter((p) => !/ERR_CONNECTION|Failed to fetch/.test(p));
  await finish(page);
});

test("a stream that breaks off is resumed at the frame it was at", { timeout: 240_000 }, async () => {
  // Large frames: the browser cannot hold all of them before the server goes.
  const big = join(world.scratch, "big");
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

/** Drops files or folders on the page as a hand does. */
async function drop(page, path) {
  const client = await page.context().newCDPSession(page);
  const data = { items: [], files: [path], dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver", "drop"]) await client.send("Input.dispatchDragEvent", { type, x: 300, y: 300, data });
  await client.detach();
}

test("room-11's first frames, dropped as a folder and as a zip", { skip: NO_DATA, timeout: 300_000 }, async () => {
  const part = join(world.scratch, "room-11");
  mkdirSync(part);
  for (const name of files(join(DATA, "room-11"))) {
    const frame = /(\d{4,6})\.(jpg|png)$/.exec(name);
    if (/noisy|mesh/.test(name) || (frame && Number(frame[1]) >= 4)) continue;
    cpSync(join(DATA, "room-11", name), join(part, name), { recursive: true });
  }
  writeFileSync(join(world.scratch, "room-11.zip"), zip(part, "room-11"));
  const page = await visit(`${QUICK}&frames=4&scale=0.25`);
  await drop(page, part);
  await page.waitForFunction(() => window.mteSlam.run.opened);
  await finished(page);
  assert.match(await page.locator("#run-name").textContent(), /room-11, 4 frames of 80 × 60, replica/);
  const result = () => page.evaluate(() => {
    const { run, plots } = window.mteSlam;
    return { triangles: run.triangles, classes: run.opened.classes.length, lost: run.lost, ate: document.querySelector("#plot-ate .value").firstChild.textContent, frames: plots.count("tracking") };
  });
  const folder = await result();
  assert.ok(folder.triangles > 300 && folder.classes > 10 && folder.lost === 0 && folder.frames === 4 && Number(folder.ate) < 2, JSON.stringify(folder));
  console.log(`# room-11, 4 frames at a quarter of the size: ATE ${folder.ate} cm, ${folder.triangles} triangles, ${folder.classes} classes`);
  await page.locator("#new-run").click();
  await drop(page, join(world.scratch, "room-11.zip"));
  await page.waitForFunction(() => !window.mteSlam.run.finished);
  await finished(page);
  assert.deepEqual(await result(), folder);
  await finish(page);
});

test("kitchen-7scenes, streamed by mte-slam serve", { skip: NO_DATA, timeout: 300_000 }, async () => {
  const native = await serving([join(DATA, "kitchen-7scenes"), "--scale", "0.2", "--frames", "12"]);
  const page = await visit(`${QUICK}&source=serve&auto`, { to: native.url });
  await finished(page, 240_000);
  const { done, lost, triangles } = await page.evaluate(() => window.mteSlam.run);
  const ate = await page.locator("#plot-ate .value").textContent();
  console.log(`# kitchen-7scenes, 12 frames at a fifth of the size: ATE ${ate}, ${triangles} triangles`);
  assert.ok(done === 12 && lost === 0 && triangles > 300 && parseFloat(ate) < 5, JSON.stringify({ done, lost, triangles, ate }));
  await native.end();
  await finish(page);
});
