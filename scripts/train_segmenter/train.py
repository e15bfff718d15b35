#!/usr/bin/env python3
"""Trains the built-in segmentation network and writes it as ONNX with its configuration.

    train.py TRAIN OUT [--validation VAL] [--steps N] [--seed S]

TRAIN and VAL are folders that crates/synth's example training_views wrote. One thread.
"""
import argparse
import json
import time
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional as F

import network as net
import views

# Size that the network is trained at \[pixels\], and how much of a view a crop takes.
WIDTH, HEIGHT = 192, 144
CROP = (0.6, 1.0)
MEAN, STD = 0.5, 0.25
LONGEST_EDGE = 256


def crop(rng, color, label, batch):
    """Returns a batch (B, H, W, 3) in 0..1 of random crops, with labels at a quarter of its size."""
    n, h, w, _ = color.shape
    images = np.empty((batch, HEIGHT, WIDTH, 3), np.float32)
    labels = np.empty((batch, HEIGHT // 4, WIDTH // 4), np.int64)
    for k, i in enumerate(rng.integers(n, size=batch)):
        part = rng.uniform(*CROP)
        ch, cw = round(part * h), round(part * w)
        y0, x0 = rng.integers(h - ch + 1), rng.integers(w - cw + 1)
        window = torch.from_numpy(color[i, y0 : y0 + ch, x0 : x0 + cw])
        window = window.permute(2, 0, 1)[None].float()
        resized = F.interpolate(
            window, (HEIGHT, WIDTH), mode="bilinear", align_corners=False, antialias=True
        )
        # A logit stands for 4 x 4 pixels: it learns from any of them.
        at = rng.uniform(0.0, 4.0, 2)
        rows = y0 + ((np.arange(HEIGHT // 4) * 4 + at[0]) * ch / HEIGHT).astype(int)
        columns = x0 + ((np.arange(WIDTH // 4) * 4 + at[1]) * cw / WIDTH).astype(int)
        image, truth = resized[0].permute(1, 2, 0).numpy(), label[i][rows][:, columns]
        if rng.random() < 0.5:
            image, truth = image[:, ::-1], truth[:, ::-1]
        images[k], labels[k] = image / 255.0, truth
    return images, labels


def distort(rng, images):
    """Changes brightness, contrast, color and noise of each image."""
    batch = len(images)

    def each(low, high, channels=1):
        return rng.uniform(low, high, (batch, 1, 1, channels)).astype(np.float32)

    gray = images.mean(3, keepdims=True)
    images = gray + (images - gray) * each(0.5, 1.3)
    mean = images.mean((1, 2, 3), keepdims=True)
    images = mean + (images - mean) * each(0.75, 1.25)
    images = images * each(0.7, 1.3) * each(0.88, 1.12, 3)
    noise = rng.standard_normal(images.shape, dtype=np.float32)
    return np.clip(images + noise * each(0.0, 0.04), 0.0, 1.0)


def right(model, folder):
    """Returns the share of pixels of a folder that the network names right, at LONGEST_EDGE."""
    color, label = views.load_all(folder)
    model.eval()
    hits = 0
    with torch.no_grad():
        for image, truth in zip(color, label):
            x = torch.from_numpy(image).permute(2, 0, 1)[None].float() / 255.0
            h = 16 * round(LONGEST_EDGE * image.shape[0] / image.shape[1] / 16)
            x = F.interpolate(x, (h, LONGEST_EDGE), mode="bilinear", antialias=True)
            y = model((x - MEAN) / STD)
            y = F.interpolate(y, truth.shape, mode="bilinear", align_corners=False)
            hits += int((y.argmax(1)[0].numpy() == truth).sum())
    model.train()
    return hits / label.size


def write_configuration(out, names, raw_ids, colors):
    config = {
        "architectures": ["MteSlamBuiltInSegmenter"],
        "model_type": "mte-slam-built-in",
        "num_labels": len(names),
        "id2label": {str(i): n for i, n in enumerate(names)},
        "label2id": {n: i for i, n in enumerate(names)},
        # Ids of the classes in the built-in scenes' label images.
        "raw_ids": raw_ids,
        "colors": colors,
    }
    preprocessor = {
        "do_resize": True,
        "size": {"longest_edge": LONGEST_EDGE},
        "size_divisor": 16,
        "resample": 2,
        "do_rescale": True,
        "rescale_factor": 1.0 / 255.0,
        "do_normalize": True,
        "image_mean": [MEAN] * 3,
        "image_std": [STD] * 3,
    }
    for name, value in [("config.json", config), ("preprocessor_config.json", preprocessor)]:
        (out / name).write_text(json.dumps(value, indent=2) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("train")
    parser.add_argument("out")
    parser.add_argument("--validation")
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--rate", type=float, default=4e-3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--every", type=int, default=1000, help="steps between validations")
    a = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(a.seed)
    torch.use_deterministic_algorithms(True, warn_only=True)
    rng = np.random.default_rng(a.seed)
    names, raw_ids, colors, *_ = views.classes(a.train)
    color, label = views.load_all(a.train)
    share = np.bincount(label.ravel(), minlength=len(names)) / label.size
    weights = np.clip((1.0 / len(names) / np.maximum(share, 1e-6)) ** 0.25, 0.7, 2.0)
    weights = torch.tensor(weights, dtype=torch.float32)
    model = net.Network(len(names)).to(memory_format=torch.channels_last)
    parameters = sum(p.numel() for p in model.parameters())
    print(f"{len(color)} views, {parameters} parameters, seed {a.seed}", flush=True)
    decay = [p for p in model.parameters() if p.ndim > 1]
    others = [p for p in model.parameters() if p.ndim <= 1]
    groups = [{"params": decay, "weight_decay": 0.01}, {"params": others, "weight_decay": 0.0}]
    optimizer = torch.optim.AdamW(groups, lr=a.rate)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, a.rate, total_steps=a.steps, pct_start=0.08
    )
    out = Path(a.out)
    out.mkdir(parents=True, exist_ok=True)
    write_configuration(out, names, raw_ids, colors)
    started, total = time.time(), 0.0
    for step in range(1, a.steps + 1):
        images, labels = crop(rng, color, label, a.batch)
        images = distort(rng, images)
        x = torch.from_numpy((images - MEAN) / STD).permute(0, 3, 1, 2)
        loss = F.cross_entropy(model(x), torch.from_numpy(labels), weight=weights)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()
        schedule.step()
        total += loss.item()
        if step % 100 == 0:
            print(f"step {step} loss {total / 100:.4f} {time.time() - started:.0f} s", flush=True)
            total = 0.0
        if step % a.every == 0 or step == a.steps:
            if a.validation:
                print(f"step {step} right {right(model, a.validation):.4f}", flush=True)
            net.export(model, len(names), out / "model.onnx")
            model.train()


main()
