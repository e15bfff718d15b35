#!/usr/bin/env python3
"""Checks that every crate of the workspace compiles by itself with each of its features: with none,
with each one alone, and with all of them. (In a build of the whole workspace crates switch on each
other's features, which hides what a crate forgot to ask for.) Sets that are the same in the end are
checked once.

    scripts/features.py [--list] [CRATE...]
"""
import json
import subprocess
import sys


def closure(features, chosen):
    """All features of the crate itself that a choice switches on."""
    found, todo = set(), list(chosen)
    while todo:
        name = todo.pop()
        if name in features and name not in found:
            found.add(name)
            todo += features[name]
    return frozenset(found)


def combinations(features):
    names = sorted(n for n in features if n != "default")
    seen = {}
    for chosen in [[], *([n] for n in names), ["default"], names]:
        if all(n in features for n in chosen):
            seen.setdefault(closure(features, chosen) - {"default"}, chosen)
    return list(seen.values())


def main(arguments):
    listed = "--list" in arguments
    wanted = [a for a in arguments if not a.startswith("-")]
    metadata = subprocess.run(
        ["cargo", "metadata", "--locked", "--no-deps", "--format-version", "1"],
        check=True, stdout=subprocess.PIPE,
    )
    packages = sorted(json.loads(metadata.stdout)["packages"], key=lambda p: p["name"])
    unknown = set(wanted) - {p["name"] for p in packages}
    if unknown:
        sys.exit(f"features: no crate {', '.join(sorted(unknown))}; there are {', '.join(p['name'] for p in packages)}")
    count = 0
    for package in packages:
        if wanted and package["name"] not in wanted:
            continue
        for chosen in combinations(package["features"]):
            count += 1
            text = ",".join(chosen)
            print(f"features: {package['name']} with {text or 'no feature'}", flush=True)
            command = ["cargo", "check", "--quiet", "--locked", "-p", package["name"], "--no-default-features"]
            if not listed and subprocess.run([*command, "--features", text]).returncode != 0:
                sys.exit(f"features: {package['name']} with {text or 'no feature'}: FAILED")
    print(f"features: {count} sets of features {'listed' if listed else 'compile'}")


main(sys.argv[1:])
