// What npm would publish: JavaScript and types, no sources; usable from TypeScript under both rules
// of resolution that are in use.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { pack } from "./npm.mjs";

const tsc = fileURLToPath(new URL("../node_modules/typescript/bin/tsc", import.meta.url));
let scratch;
let packed;

before(() => {
  scratch = mkdtempSync(join(tmpdir(), "mte-slam-npm-"));
  packed = pack(join(scratch, "node_modules", "mte-slam"));
});
after(() => rmSync(scratch, { recursive: true, force: true }));

test("the tarball holds JavaScript, WebAssembly and types, and nothing else", () => {
  const { files } = packed;
  for (const file of ["package.json", "README.md", "lib/mte-slam.js", "lib/types/client.d.ts", "lib/pkg/mte_slam_web.d.ts", "lib/LICENSE-MIT", "lib/LICENSE-APACHE"])
    assert.ok(files.includes(file), `${file} is not in ${files}`);
  assert.deepEqual(files.filter((f) => /\.(ts|mjs|html|css)$/.test(f) && !f.endsWith(".d.ts")), [], "sources");
  assert.deepEqual(files.filter((f) => !/^(lib\/|package\.json$|README\.md$)/.test(f)), [], "files beside the package");
  const wasm = files.filter((f) => f.endsWith(".wasm"));
  assert.equal(wasm.length, 1, `${wasm}`);
  // The same bytes as the page's, so within the same budget.
  const page = readFileSync(new URL("../pkg/mte_slam_web_bg.wasm", import.meta.url));
  assert.ok(page.equals(readFileSync(join(packed.folder, wasm[0]))), "another module than the page's");
  assert.ok(packed.size < 1_100_000, `${packed.size} bytes`);
  console.log(`# ${packed.name}: ${files.length} files, ${packed.size} bytes`);
});

test("its version is the program's", () => {
  const cargo = readFileSync(new URL("../../Cargo.toml", import.meta.url), "utf8");
  assert.equal(packed.version, /\[workspace\.package\]\nversion = "([^"]+)"/.exec(cargo)[1]);
});

for (const [module, resolution] of [["ESNext", "bundler"], ["NodeNext", "NodeNext"]])
  test(`its types hold in TypeScript, resolved as ${resolution}`, () => {
    const folder = join(scratch, resolution);
    mkdirSync(folder);
    writeFileSync(join(folder, "package.json"), '{ "type": "module" }');
    writeFileSync(join(folder, "good.ts"), `import { MteSlam, type Settings } from "mte-slam";
      const settings: Settings = { preset: "tiny" };
      const slam = new MteSlam();
      slam.on("metrics", (m) => console.log(m.index.toFixed(), m.ateCm));
      export const opened: Promise<boolean> = slam.open({ kind: "built-in", scene: "room", frames: 3, width: 64, noise: false }, settings);
    `);
    writeFileSync(join(folder, "bad.ts"), 'import { MteSlam } from "mte-slam";\nnew MteSlam().on("nonsense", () => {});\n');
    const check = (file) => execFileSync(process.execPath, [tsc, "--noEmit", "--strict", "--skipLibCheck", "false", "--types", "", "--target", "ES2022", "--lib", "ES2022,DOM,ESNext.Disposable", "--module", module, "--moduleResolution", resolution, file], { cwd: folder, encoding: "utf8", stdio: "pipe" });
    try {
      check("good.ts");
    } catch (e) {
      assert.fail(e.stdout);
    }
    assert.throws(() => check("bad.ts"), /status 2|Command failed/);
  });
