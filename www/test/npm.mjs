// `npm pack`, unpacked where a test wants it.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const npm = process.platform === "win32" ? "npm.cmd" : "npm";

/** Name, version, files and size of the tarball, whose content then lies in `folder`. */
export function pack(folder) {
  const scratch = mkdtempSync(join(tmpdir(), "mte-slam-pack-"));
  try {
    const out = execFileSync(npm, ["pack", "--json", "--loglevel=error", "--pack-destination", scratch], {
      cwd: fileURLToPath(new URL("..", import.meta.url)), encoding: "utf8", shell: process.platform === "win32",
    });
    // What `prepack` prints comes first.
    const [{ filename, name, version, size, files }] = JSON.parse(out.slice(out.search(/^\[/m)));
    mkdirSync(folder, { recursive: true });
    execFileSync("tar", ["-xzf", join(scratch, filename), "--strip-components=1", "-C", folder]);
    return { folder, name, version, size, files: files.map((f) => f.path) };
  } finally {
    rmSync(scratch, { recursive: true, force: true });
  }
}
