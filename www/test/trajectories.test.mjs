// One recording mapped by the native program and in the browser, with the same settings: the
// trajectories side by side.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { BIN, SHOTS, download, finish, finished, setUp, visit, world } from "./page.mjs";

setUp();

const SETTINGS = { "mapping.rays": 600, "mapping.iterations": 6, "mapping.first_iterations": 60, "mapping.final_iterations": 20, "mapping.semantic_iterations": 40, "mapping.every": 4, "tracking.align_pixels": 1024, "sampling.stratified": 16 };
const FRAMES = 12;

/** Rows of a TUM file: time, position, quaternion. */
const rows = (text) => text.trim().split("\n").filter((line) => !line.startsWith("#")).map((line) => line.split(" ").map(Number));
const gap = (a, b) => Math.hypot(a[1] - b[1], a[2] - b[2], a[3] - b[3]);

/** Both paths from above. */
function picture(native, browser, text) {
  const all = [...native, ...browser];
  const [x0, x1, y0, y1] = [1, 2].flatMap((k) => [Math.min(...all.map((r) => r[k])), Math.max(...all.map((r) => r[k]))]);
  const scale = 400 / Math.max(x1 - x0, y1 - y0, 1e-6);
  const line = (path, style) => `<polyline fill="none" ${style} points="${path.map((r) => `${(20 + (r[1] - x0) * scale).toFixed(2)},${(440 - (r[2] - y0) * scale).toFixed(2)}`).join(" ")}"/>`;
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 440 480" font-family="sans-serif" font-size="13"><rect width="440" height="480" fill="#fff"/>${line(native, 'stroke="#0b7a66" stroke-width="5" opacity=".5"')}${line(browser, 'stroke="#a8560a" stroke-width="1.5"')}<text x="20" y="470">${text}</text></svg>`;
}

for (const tracker of ["align", "render"])
  test(`native and browser trajectories, ${tracker}`, { timeout: 280_000 }, async () => {
    const recording = join(world.scratch, `side-by-side-${tracker}`);
    assert.equal(spawnSync(BIN, ["synth", recording, "--frames", String(FRAMES), "--width", "80"]).status, 0);
    const out = join(world.scratch, `native-${tracker}`);
    const set = Object.entries(SETTINGS).flatMap(([key, value]) => ["--set", `${key}=${value}`]);
    const run = spawnSync(BIN, ["run", recording, "--out", out, "--preset", "fast", "--engine", "cpu", "--tracker", tracker, "--no-mesh", "--render-every", "0", ...set], { encoding: "utf8" });
    assert.equal(run.status, 0, run.stderr);
    const native = rows(readFileSync(join(out, "trajectory.txt"), "utf8"));

    const query = Object.entries(SETTINGS).map(([key, value]) => `&set.${key}=${value}`).join("");
    const page = await visit(`preset=fast&engine=cpu&tracker=${tracker}&mesh=12&render=0${query}`);
    await page.locator("#folder-input").setInputFiles(recording);
    await page.locator("#begin").click();
    await finished(page, 240_000);
    const browser = rows((await download(page, "trajectory")).toString());
    const metrics = JSON.parse((await download(page, "metrics")).toString());
    await finish(page);

    assert.equal(native.length, FRAMES);
    assert.equal(browser.length, FRAMES);
    const gaps = native.map((row, i) => gap(row, browser[i]));
    const [most, mean] = [Math.max(...gaps), gaps.reduce((a, b) => a + b) / FRAMES];
    const ate = [JSON.parse(readFileSync(join(out, "metrics.json"), "utf8")), metrics].map((m) => m.trajectory.aligned_cm.rmse.toFixed(4));
    const text = `${tracker}, ${FRAMES} frames: at most ${(most * 1000).toFixed(4)} mm apart, ${(mean * 1000).toFixed(4)} on average; ATE native ${ate[0]} cm, browser ${ate[1]} cm`;
    console.log(`# ${text}`);
    if (SHOTS) writeFileSync(join(SHOTS, `trajectories-${tracker}.svg`), picture(native, browser, text));
    assert.ok(most < 1e-3, `${most} m`);
    assert.ok(gaps.at(-1) < 1e-3 && native.at(-1).some((x, i) => x !== native[0][i]), "the camera does not move");
  });
