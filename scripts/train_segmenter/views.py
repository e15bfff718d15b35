"""The arrays that the example `training_views` of crates/synth writes."""
import json
from pathlib import Path

import numpy as np


def scenes(folder):
    """Returns the names of a folder's scenes, sorted."""
    suffix = ".color.npy"
    names = sorted(p.name[: -len(suffix)] for p in Path(folder).glob("*" + suffix))
    if not names:
        raise SystemExit(f"{folder}: no *{suffix}; write views with the example training_views first")
    return names


def classes(folder):
    """Returns names, raw ids and colors of the classes, the unit of depth in meters, and whether views come in pairs."""
    table = json.loads((Path(folder) / "classes.json").read_text())
    return table["names"], table["raw_ids"], table["colors"], table["depth_unit_m"], table["pairs"]


def load(folder, scene, part):
    """Returns one array of a scene: color, label, depth, pose or camera."""
    return np.load(Path(folder) / f"{scene}.{part}.npy")


def load_all(folder):
    """Returns color (N, H, W, 3) and label (N, H, W) of all scenes, in the order of their names."""
    names = scenes(folder)
    parts = [np.concatenate([load(folder, n, part) for n in names]) for part in ("color", "label")]
    return parts[0], parts[1]
