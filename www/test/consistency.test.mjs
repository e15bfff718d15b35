// Every kernel in the browser, as shader on WebGPU and as Rust in WebAssembly, against what the
// native CPU engine found from the same inputs; then a short run of the built-in sequence.
//
// MTE_SLAM_CONSISTENCY   the test bodies as a WebAssembly package
// MTE_SLAM_REFERENCE     the native results
import assert from "node:assert/strict";
import { dirname } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, serve } from "./browser.mjs";

let browser;
let server;
let page;

before(async () => {
  const { MTE_SLAM_CONSISTENCY: code, MTE_SLAM_REFERENCE: reference } = process.env;
  assert.ok(code && reference, "MTE_SLAM_CONSISTENCY and MTE_SLAM_REFERENCE are set by scripts/test-web.sh");
  browser = await launch();
  server = await serve({ "/code/": code, "/reference/": dirname(reference), "/": fileURLToPath(new URL(".", import.meta.url)) });
  page = await browser.newPage();
  await page.goto(`${server.url}/blank.html`);
  await page.evaluate(async (file) => {
    const code = await import("/code/mte_slam_tests.js");
    await code.default();
    const bytes = await (await fetch(`/reference/${file}`)).arrayBuffer();
    window.reference = new code.Reference(new Uint8Array(bytes));
  }, reference.split("/").pop());
});
after(async () => {
  await browser?.close();
  server?.close();
});

for (const engine of ["cpu", "gpu"]) {
  test(`every kernel, ${engine}`, { timeout: 280_000 }, async (t) => {
    const kernels = await page.evaluate(() => window.reference.kernels());
    assert.ok(kernels.length >= 18, `${kernels.length} kernels`);
    for (const [i, name] of kernels.entries())
      await t.test(name, async (t) => {
        if ((await page.evaluate((i) => window.reference.cases(i), i)) === 0) return t.skip("no case yet");
        const difference = await page.evaluate(([engine, i]) => window.reference.check(engine, i), [engine, i]);
        assert.equal(difference, "");
      });
  });

  test(`a short run, ${engine}`, { timeout: 280_000 }, async () => {
    const [gap, tolerance] = await page.evaluate(async (engine) => [await window.reference.run(engine), window.reference.tolerance_m(engine)], engine);
    console.log(`# ${engine} in the browser and native: positions at most ${(gap * 1000).toFixed(5)} mm apart (tolerance ${tolerance * 1000} mm)`);
    assert.ok(gap <= tolerance, `${gap} m`);
  });
}

test("a result that is off by a hundredth is noticed", async () => {
  const kernels = await page.evaluate(() => window.reference.kernels());
  const i = kernels.indexOf("composite");
  await page.evaluate((i) => window.reference.spoil(i), i);
  assert.match(await page.evaluate((i) => window.reference.check("cpu", i), i), /Word/);
});
