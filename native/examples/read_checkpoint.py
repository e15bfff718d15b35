#!/usr/bin/env python3
"""Shows what a checkpoint of mte-slam holds, with nothing but the safetensors package.

    pip install safetensors numpy
    python3 read_checkpoint.py out/mine/checkpoint.safetensors [trajectory.txt]

The second argument writes the camera's path, `t x y z` a line [s, m].
"""
import json
import sys

import numpy as np
from safetensors import safe_open

# Compared with the program's own by its tests.
FORMAT = "mte-slam-6"


def main(path, trajectory=None):
    with safe_open(path, framework="numpy") as f:
        metadata = f.metadata()
        if metadata["format"] != FORMAT:
            sys.exit(f"{path}: format: found {metadata['format']}, expected {FORMAT}")
        tensors = {name: f.get_tensor(name) for name in f.keys()}
    state = json.loads(metadata["state"])
    print("configuration", metadata["configuration"], "data", metadata["data"])
    print("seed", state["config"]["seed"], "tracker", state["config"]["tracking"]["tracker"])
    print("box [m]", state["bounds"]["min"], "to", state["bounds"]["max"])
    print("classes", [c["name"] for c in state["sequence"]["classes"]["classes"]])
    for name, values in tensors.items():
        print(f"{name:32} {values.dtype!s:8} {values.shape}")

    # world_from_camera, row by row: rotation and translation [m].
    poses = tensors["frames.world_from_camera"]
    lost = np.flatnonzero(tensors["frames.status"] == 2)
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    print(f"{len(poses)} frames, {len(lost)} lost, path of {steps.sum():.3f} m")
    touched = np.any(tensors["planes.geometry.moment2"] != 0, axis=1).mean()
    print(f"{100 * touched:.1f} % of the geometry planes' cells were ever trained")
    if trajectory:
        rows = np.column_stack([tensors["frames.time_s"], poses[:, :3, 3]])
        np.savetxt(trajectory, rows, fmt="%.9f")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(*sys.argv[1:])
