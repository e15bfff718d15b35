// The page as people use it, in Chromium. Long runs use the CPU engine in WebAssembly: WebGPU is
// in software here, and has a test of its own in resume.test.mjs.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { QUICK, SHOTS, done, download, finish, finished, ready, setUp, stats, visit } from "./page.mjs";

setUp();

test("a first visit: start the built-in room, watch it grow, use everything", { timeout: 240_000 }, async () => {
  const page = await visit(QUICK.replace("preset=tiny&engine=cpu&", ""));
  await page.locator("#preset").selectOption("tiny");
  await page.locator("#engine-choice").selectOption("cpu");
  await page.locator(".more summary").click();
  await page.locator("#frames").fill("60");
  await page.evaluate(() => {
    window.shifts = [];
    new PerformanceObserver((list) => window.shifts.push(...list.getEntries().filter((e) => !e.hadRecentInput).map((e) => e.value))).observe({ type: "layout-shift", buffered: true });
  });
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
  const firstMap = await page.evaluate(() => window.mteSlam.run.firstMap);
  console.log(`# first surface ${firstMap.toFixed(1)} s after the start (processor, 64 x 48 pixels)`);
  assert.ok(firstMap > 0 && firstMap < 60, `${firstMap} s`);

  // Images on both sides.
  for (const id of ["in-color", "in-depth", "in-classes", "out-color", "out-depth", "out-classes"]) {
    const painted = await page.evaluate((id) => {
      const c = document.getElementById(id);
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      return new Set(Array.from({ length: d.length / 4 }, (_, i) => d[4 * i] * 65536 + d[4 * i + 1] * 256 + d[4 * i + 2])).size;
    }, id);
    assert.ok(painted > 3, `${id} shows ${painted} colours`);
  }

  const shift = await page.evaluate(() => window.shifts.reduce((a, b) => a + b, 0));
  console.log(`# layout shift from the start to the eighth frame: ${shift.toFixed(4)} (good: below 0.1)`);
  assert.ok(shift < 0.1, `the layout jumps: ${shift}`);

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
  await ready(page);
  assert.equal(await page.locator("#preset").inputValue(), "tiny");
  assert.equal(await page.locator("#frames").inputValue(), "60");
  await page.locator("#begin").click();
  await done(page, 1);
  await finish(page);
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

test("memory over 200 frames: flat, but for what the odometry keeps of its keyframes and a buffer for kept states", { timeout: 240_000 }, async () => {
  const page = await visit("source=room&preset=tiny&engine=cpu&width=48&frames=200&mesh=20&render=0&set.mapping.rays=64&set.mapping.iterations=2&set.mapping.first_iterations=10&set.mapping.final_iterations=2&set.tracking.align_pixels=128&set.keyframes.budget_mib=1");
  await page.evaluate(() => {
    window.memory = [];
    window.mteSlam.slam.on("metrics", (m) => window.memory.push([m.index, m.wasmBytes, m.deviceBytes]));
    document.getElementById("begin").click();
  });
  // States of the run are kept meanwhile; the first one takes its memory before the measurement.
  await done(page, 30);
  await page.evaluate(() => window.mteSlam.slam.save());
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
  // A kept state passes through the module's memory tensor by tensor; the largest has 27 MB, and may
  // find a gap only from the second state on.
  const state = 32e6;
  assert.ok(late[1] - early[1] <= keyframes + state, `the module's memory grows by ${late[1] - early[1]} bytes, expected at most ${keyframes} for keyframes and ${state} for a state`);
  assert.ok(late[2] <= early[2], "the device's memory grows");
  assert.ok(heapAfter <= heapBefore * 1.5 + 3e6, "the heap grows");
  await finish(page);
});

test("only own scripts run, every control has a name, and the layout holds from 360 pixels to 4K", { timeout: 240_000 }, async () => {
  // Only the page's own scripts run.
  const guarded = await visit();
  await guarded.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "window.inline = true";
    document.head.append(script);
  });
  assert.equal(await guarded.evaluate(() => window.inline), undefined);
  assert.match(guarded.problems.join(), /Content Security Policy/);
  await guarded.close();
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
      for (const id of ["toggle", "step", "tools", "new-run", "share"]) document.getElementById(id).hidden = false;
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
