// What the page's tests share: a browser, the built page below a sub-path, a small recording, and
// the steps that people take.
//
// MTE_SLAM_BIN     the native program (for `serve` and for making a recording)
// MTE_SLAM_DATA    a folder with room-11 and kitchen-7scenes, for tests with real files (default:
//                  ../shared/data beside the repository or shared/data in it, if it is there)
// MTE_SLAM_SHOTS   a folder for screenshots (optional)
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, serve } from "./browser.mjs";
import { files, zip } from "./zip.mjs";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
export const DIST = process.env.MTE_SLAM_DIST ?? here("../dist");
export const BIN = process.env.MTE_SLAM_BIN;
export const SHOTS = process.env.MTE_SLAM_SHOTS;
const holdsData = (folder) => folder && ["room-11", "kitchen-7scenes"].every((name) => existsSync(join(folder, name)));
export const DATA = process.env.MTE_SLAM_DATA ?? [here("../../shared/data"), here("../../../shared/data")].find(holdsData);
/** Why tests with real recordings are skipped; false where they are not. */
export const NO_DATA = !holdsData(DATA) && "there is no shared/data with room-11 and kitchen-7scenes, nor does MTE_SLAM_DATA name one";
/** Small enough for a second a frame on one thread. */
export const QUICK = "preset=tiny&engine=cpu&width=64&mesh=12&render=4&set.mapping.rays=300&set.mapping.first_iterations=50&set.mapping.iterations=4&set.mapping.final_iterations=4&set.mapping.semantic_iterations=24&set.sampling.render_stratified=24&set.sampling.render_surface=6&set.mesh.resolution_m=0.1&set.mesh.min_component_triangles=1";

/** Set before the first test. */
export const world = {};

/** To be called once a file: starts and ends what the tests need. */
export function setUp() {
  before(async () => {
    assert.ok(existsSync(join(DIST, "index.html")), "www/dist is not built: run scripts/build-web.sh");
    assert.ok(BIN && existsSync(BIN), "MTE_SLAM_BIN does not name the native program");
    const scratch = mkdtempSync(join(tmpdir(), "mte-slam-page-"));
    const recording = join(scratch, "room");
    const made = spawnSync(BIN, ["synth", recording, "--frames", "6", "--width", "64"], { encoding: "utf8" });
    assert.equal(made.status, 0, made.stderr);
    writeFileSync(join(recording, "files.json"), JSON.stringify(files(recording)));
    writeFileSync(join(scratch, "room.zip"), zip(recording, "room"));
    if (SHOTS) mkdirSync(SHOTS, { recursive: true });
    const browser = await launch();
    // A sub-path, as on GitHub Pages.
    const server = await serve({ "/some/where/": DIST, "/data/": scratch });
    Object.assign(world, { browser, server, scratch, recording });
  });
  after(async () => {
    await world.browser?.close();
    world.server?.close();
    if (world.scratch) rmSync(world.scratch, { recursive: true, force: true });
  });
}

/** A page that fails the test on errors in it, and on requests to anybody else. */
export async function visit(query = "", { to = `${world.server.url}/some/where/`, context, width = 1280, height = 800, scheme } = {}) {
  const page = await (context ?? world.browser).newPage({ viewport: { width, height }, colorScheme: scheme });
  page.problems = [];
  page.on("pageerror", (e) => page.problems.push(e.message));
  page.on("console", (m) => {
    if (m.type() === "error" && !/Failed to load resource/.test(m.text())) page.problems.push(m.text());
  });
  page.on("request", (r) => {
    if (!/^(http:\/\/(localhost|127\.0\.0\.1)[:/]|blob:|data:)/.test(r.url())) page.problems.push(`request to ${r.url()}`);
  });
  await page.goto(to + (query ? `?${query}` : ""));
  await ready(page);
  return page;
}

/** The page has looked for a GPU and for runs to go on with. */
export const ready = (page) => page.waitForFunction(() => window.mteSlam?.ready);
export const done = (page, n, timeout = 120_000) =>
  page.waitForFunction((n) => window.mteSlam.run.done >= n || !document.getElementById("failure").hidden, n, { timeout });
export const finished = async (page, timeout = 120_000) => {
  await page.waitForFunction(() => window.mteSlam.run.finished || !document.getElementById("failure").hidden, null, { timeout });
  assert.equal(await page.locator("#failure").isHidden(), true, await page.locator("#failure-text").textContent());
};
export const stats = (page) => page.evaluate(() => window.mteSlam.view.stats());
export const failure = async (page, kind, timeout = 60_000) => {
  await page.waitForFunction(() => !document.getElementById("failure").hidden, null, { timeout });
  assert.equal(await page.locator("#failure").getAttribute("data-kind"), kind, await page.locator("#failure-text").textContent());
  return page.locator("#failure-text").textContent();
};
/** Puts the pane away, so that the next one is seen to come. */
export const dismiss = (page) => page.evaluate(() => (document.getElementById("failure").hidden = true));
export async function download(page, kind) {
  const [file] = await Promise.all([page.waitForEvent("download", { timeout: 90_000 }), page.locator(`[data-kind="${kind}"]`).click()]);
  return readFileSync(await file.path());
}
export async function finish(page) {
  assert.deepEqual(page.problems, []);
  await page.close();
}

/** `mte-slam serve`; resolves with its address. */
export async function serving(arguments_, port = 0) {
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
