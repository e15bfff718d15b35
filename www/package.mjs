// The rest of what npm's package holds, after `vite build --mode package`: types, and the licenses.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
execFileSync(process.execPath, [here("node_modules/typescript/bin/tsc"), "--project", here("tsconfig.package.json")], { stdio: "inherit" });
// The sources leave endings out, as bundlers let them; Node's rules of resolution do not.
const types = here("lib/types");
for (const name of readdirSync(types)) {
  const text = readFileSync(`${types}/${name}`, "utf8");
  writeFileSync(`${types}/${name}`, text.replace(/(["'])(\.\/\w+)\1/g, "$1$2.js$1"));
}
// They import the module's types by this path.
mkdirSync(here("lib/pkg"), { recursive: true });
copyFileSync(here("pkg/mte_slam_web.d.ts"), here("lib/pkg/mte_slam_web.d.ts"));
for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) copyFileSync(here(`../${name}`), here(`lib/${name}`));
