#!/usr/bin/env python3
"""Scores an ONNX segmentation network on folders that the example training_views wrote.

    evaluate.py MODEL FOLDER... [--edge PIXELS] [--json FILE]

Pixels right: share of all pixels whose class is right. mIoU: mean over the classes that occur, of
intersection over union of all pixels of a folder. Flicker, for folders written with `pairs`: share
of the pixels of a view that the next view sees, too (within 2 cm by depth), whose predicted class
differs there; for the true labels the same, which is what edges and thin things cost.
"""
import argparse
import json
from pathlib import Path

import numpy as np
import onnxruntime as ort
import torch
from torch.nn import functional as F

import views

SAME_M = 0.02


def session(path):
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    return ort.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def predict(model, settings, image):
    """Returns the class of every pixel of an image (H, W, 3)."""
    h, w, _ = image.shape
    factor = settings["size"]["longest_edge"] / max(h, w)
    divisor = settings["size_divisor"]
    size = [max(divisor, divisor * round(n * factor / divisor)) for n in (h, w)]
    x = torch.from_numpy(image).permute(2, 0, 1)[None].float()
    x = F.interpolate(x, size, mode="bilinear", align_corners=False, antialias=True)
    x = x.numpy() * np.float32(settings["rescale_factor"])
    mean = np.array(settings["image_mean"], np.float32)[:, None, None]
    std = np.array(settings["image_std"], np.float32)[:, None, None]
    logits = model.run(["logits"], {"pixel_values": (x - mean) / std})[0]
    full = F.interpolate(torch.from_numpy(logits), (h, w), mode="bilinear", align_corners=False)
    return full.argmax(1)[0].numpy().astype(np.uint8)


def moved(depth, camera, poses):
    """Returns pixels of a first view that the second sees, too, and the pixels where (flat)."""
    fx, fy, cx, cy = camera
    h, w = depth[0].shape
    v, u = np.mgrid[0:h, 0:w]
    z = depth[0]
    points = np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z, np.ones_like(z)], -1).reshape(-1, 4)
    points = points @ (np.linalg.inv(poses[1]) @ poses[0]).T
    z = np.maximum(points[:, 2], 1e-6)
    x = np.rint(points[:, 0] / z * fx + cx).astype(int)
    y = np.rint(points[:, 1] / z * fy + cy).astype(int)
    inside = (points[:, 2] > 0.05) & (x >= 0) & (x < w) & (y >= 0) & (y < h)
    here = np.flatnonzero(inside)
    there = y[here] * w + x[here]
    seen = np.abs(depth[1].ravel()[there] - points[here, 2]) < SAME_M
    return here[seen], there[seen]


def score(model, settings, folder):
    names, _, _, unit, paired = views.classes(folder)
    n = len(names)
    confusion = np.zeros((n, n), np.int64)
    shared, flicker, true_flicker, rooms = 0, 0, 0, []
    for scene in views.scenes(folder):
        color, label, depth, pose, camera = (
            views.load(folder, scene, p) for p in ("color", "label", "depth", "pose", "camera")
        )
        guess = np.stack([predict(model, settings, image) for image in color])
        pairs = label.astype(np.int64).ravel() * n + guess.ravel()
        here = np.bincount(pairs, minlength=n * n).reshape(n, n)
        confusion += here
        rooms.append(float(np.trace(here) / here.sum()))
        for i in range(0, len(color), 2) if paired else []:
            a, b = moved(depth[i : i + 2] * unit, camera, pose[i : i + 2])
            shared += len(a)
            flicker += int((guess[i].ravel()[a] != guess[i + 1].ravel()[b]).sum())
            true_flicker += int((label[i].ravel()[a] != label[i + 1].ravel()[b]).sum())
    hits = np.diag(confusion)
    truth, guessed = confusion.sum(1), confusion.sum(0)
    occurs = truth > 0
    iou = hits / np.maximum(truth + guessed - hits, 1)
    return {
        "scenes": len(rooms),
        "pixels_right": float(hits.sum() / confusion.sum()),
        "worst_scene": min(rooms),
        "miou": float(iou[occurs].mean()),
        "shared_pixels": shared,
        "flicker": flicker / shared if shared else None,
        "flicker_of_truth": true_flicker / shared if shared else None,
        "classes": {
            names[i]: {
                "share": float(truth[i] / truth.sum()),
                "iou": float(iou[i]),
                "found": float(hits[i] / truth[i]),
            }
            for i in range(n)
            if occurs[i]
        },
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--edge", type=int, help="instead of the configuration's longest edge")
    parser.add_argument("--json", type=Path)
    a = parser.parse_args()
    torch.set_num_threads(1)
    settings = json.loads((a.model.parent / "preprocessor_config.json").read_text())
    if a.edge:
        settings["size"]["longest_edge"] = a.edge
    model = session(a.model)
    results = {}
    for folder in a.folders:
        results[folder] = r = score(model, settings, folder)
        text = f"{folder}: right {r['pixels_right']:.4f} (worst scene {r['worst_scene']:.4f}), mIoU {r['miou']:.4f}"
        if r["shared_pixels"]:
            text += f", flicker {r['flicker']:.4f} (truth {r['flicker_of_truth']:.4f}, {r['shared_pixels']} pixels)"
        print(text, flush=True)
    if a.json:
        a.json.write_text(json.dumps(results, indent=1) + "\n")


main()
