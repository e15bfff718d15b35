// The package as npm would install it, used by another page: the lines of www/README.md as they stand.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch } from "./browser.mjs";
import { pack } from "./npm.mjs";
import { setUp, world } from "./page.mjs";

setUp();

test("the example of the README maps a picked folder and saves its mesh", { timeout: 240_000 }, async () => {
  const readme = readFileSync(fileURLToPath(new URL("../README.md", import.meta.url)), "utf8");
  const start = readme.indexOf("    import { MteSlam }");
  const example = readme.slice(start).split("\n").reduce(
    (lines, line) => (lines.ended || (line !== "" && !line.startsWith("    ")) ? Object.assign(lines, { ended: true }) : lines.concat(line.slice(4))), []).join("\n");
  assert.ok(example.trim().split("\n").length <= 22 && /slam\.start/.test(example), example);
  pack(join(world.scratch, "npm"));
  writeFileSync(join(world.scratch, "other.html"), `<!doctype html><meta charset="utf-8">
    <script type="importmap">{ "imports": { "mte-slam": "/data/npm/lib/mte-slam.js" } }</script>
    <input type="file" id="files" webkitdirectory>
    <script>
      const input = document.getElementById("files");
      window.drawn = {};
      window.saved = {};
      const draw = (key, vertices, indices) => (window.drawn[key] = [vertices.length, indices.length]);
      const save = (name, bytes) => (window.saved[name] = [...bytes.slice(0, 12), bytes.length]);
      input.onchange = () => {
        const script = document.createElement("script");
        script.type = "module";
        script.textContent = document.getElementById("example").textContent;
        document.body.append(script);
      };
    </script>
    <script type="text/plain" id="example">\n${example}</script>`);
  // Without WebGPU the package takes the processor, as it does for visitors who have none; shaders
  // in software would take minutes to compile.
  const browser = await launch({ gpu: false });
  const page = await browser.newPage();
  const [lines, errors] = [[], []];
  page.on("console", (m) => (m.type() === "error" ? errors : lines).push(m.text()));
  page.on("pageerror", (e) => errors.push(e.message));
  await page.goto(`${world.server.url}/data/other.html`);
  await page.locator("#files").setInputFiles(world.recording);
  await page.waitForFunction(() => Object.keys(window.saved).length > 0, null, { timeout: 220_000 }).catch((e) => assert.fail(`${e.message}\n${lines.join("\n")}\n${errors.join("\n")}`));
  const { drawn, saved } = await page.evaluate(() => ({ drawn: window.drawn, saved: window.saved }));
  const [name, bytes] = Object.entries(saved)[0];
  assert.match(name, /\.glb$/);
  assert.equal(String.fromCharCode(...bytes.slice(0, 4)), "glTF");
  assert.ok(Object.values(drawn).filter(([v, i]) => v % 20 === 0 && i % 12 === 0 && v > 0).length > 3, JSON.stringify(drawn));
  assert.match(lines.join("\n"), /my room 6 frames on .*\n(.*\n)*0 \d.* ms, error/);
  assert.deepEqual(errors.filter((e) => !/favicon|Failed to load resource/.test(e)), []);
  await browser.close();
});

test("the built page's folder holds the package, too, under a name that stays", { timeout: 60_000 }, async () => {
  const page = await world.browser.newPage();
  await page.goto(`${world.server.url}/data/room/files.json`);
  const ready = await page.evaluate(async () => {
    const { MteSlam } = await import("/some/where/mte-slam.js");
    const slam = new MteSlam();
    return new Promise((resolve) => slam.on("ready", resolve));
  });
  assert.match(ready.version, /^\d+\.\d+\.\d+/);
  await page.close();
});
