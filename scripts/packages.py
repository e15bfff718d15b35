#!/usr/bin/env python3
"""Looks into the package of every crate that is meant for others, as `cargo publish` would send it:
what crates.io needs is said, licenses and a readme are there, and every file that the sources include
(the kernels' WGSL above all) is inside.

    scripts/packages.py [--verify]      with --verify each package is also built by itself
"""
import json
import re
import subprocess
import sys
from pathlib import Path

INCLUDE = re.compile(r'include_(?:str|bytes)!\(\s*(?:concat!\(\s*env!\("CARGO_MANIFEST_DIR"\),\s*)?"([^"]+)"')


def cargo(*arguments):
    done = subprocess.run(["cargo", *arguments], check=True, stdout=subprocess.PIPE)
    return done.stdout.decode()


def problems(package):
    folder = Path(package["manifest_path"]).parent
    name = package["name"]
    for key in ("description", "license", "readme", "keywords", "categories"):
        if not package[key]:
            yield f"no {key} in its Cargo.toml"
    if len(package["keywords"]) > 5:
        yield "more than 5 keywords"
    for dependency in package["dependencies"]:
        if dependency.get("path") and dependency["kind"] != "dev" and dependency["req"] == "*":
            yield f"the dependency {dependency['name']} has no version"
    files = set(cargo("package", "--quiet", "--locked", "--allow-dirty", "--list", "-p", name).split("\n"))
    for file in ("LICENSE-MIT", "LICENSE-APACHE"):
        if file not in files:
            yield f"{file} is not in it"
    for file in sorted(f for f in files if f.endswith(".rs")):
        text = (folder / file).read_text()
        for found in INCLUDE.findall(text):
            start = folder if found.startswith("/") else (folder / file).parent
            path = (start / found.lstrip("/")).resolve()
            if not path.exists():
                continue  # in the text of a test or of a comment
            inside = path.is_relative_to(folder.resolve())
            if not inside or path.relative_to(folder.resolve()).as_posix() not in files:
                yield f"{file} includes {found}, which is not in it"
    # Shaders that are joined by a build script or a macro of ours.
    for path in sorted(folder.rglob("*.wgsl")):
        file = path.relative_to(folder).as_posix()
        if not file.startswith("target/") and file not in files:
            yield f"{file} is not in it"
    print(f"packages: {name} {package['version']}: {len(files) - 1} files, {sum(f.endswith('.wgsl') for f in files)} WGSL")


def main(arguments):
    metadata = json.loads(cargo("metadata", "--locked", "--no-deps", "--format-version", "1"))
    # `publish = false` is an empty list of registries.
    packages = [p for p in metadata["packages"] if p["publish"] != []]
    bad = [f"{p['name']}: {what}" for p in packages for what in problems(p)]
    shaders = sum(1 for p in packages if p["name"] in ("mte-slam-shaders", "mte-slam-core"))
    if shaders != 2:
        bad.append("mte-slam-shaders and mte-slam-core are not among the packages")
    if bad:
        sys.exit("\n".join(f"packages: {line}" for line in bad))
    # All at once: they need each other, and none has been published yet.
    names = [a for p in packages for a in ("-p", p["name"])]
    verify = [] if "--verify" in arguments else ["--no-verify"]
    subprocess.run(["cargo", "package", "--quiet", "--locked", "--allow-dirty", *verify, *names], check=True)
    print(f"packages: {len(packages)} are complete")


main(sys.argv[1:])
