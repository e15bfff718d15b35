#!/usr/bin/env python3
"""Writes a small recording in every layout that MTE-SLAM reads, with numpy and Pillow alone.

    fixtures_writer.py RAW OUT

RAW holds meta.json (width, height, fx, fy, cx, cy, depth_unit_m, names, poses as 16 row-major
numbers world_from_camera) and, frame after frame, color.bin (RGB bytes), depth.bin (little-endian
u16) and labels.bin (bytes: index into names, 255 for none). OUT receives a folder a layout. The
layouts follow their data sets' own documentation and not MTE-SLAM's readers, so that a reader and
its writer cannot share a misunderstanding.
"""
import json
import struct
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np
from PIL import Image

NO_POSE = 1  # the frame without a pose, where a layout can say that


class Recording:
    def __init__(self, raw):
        self.meta = json.loads((raw / "meta.json").read_text())
        m = self.meta
        shape = (-1, m["height"], m["width"])
        self.color = np.fromfile(raw / "color.bin", np.uint8).reshape(*shape, 3)
        self.depth = np.fromfile(raw / "depth.bin", "<u2").reshape(shape)
        self.labels = np.fromfile(raw / "labels.bin", np.uint8).reshape(shape)
        self.poses = np.array(m["poses"]).reshape(-1, 4, 4)
        self.n = len(self.color)

    def depth_in(self, units):
        scaled = self.depth.astype(np.float64) * (self.meta["depth_unit_m"] * units)
        return np.floor(scaled + 0.5).astype(np.uint16)

    def matrix(self, factor=1, size=3):
        """Intrinsics of the images, or of images `factor` times as large."""
        m, out = self.meta, np.eye(size)
        out[0, 0], out[1, 1] = m["fx"] * factor, m["fy"] * factor
        out[0, 2], out[1, 2] = ((m[c] + 0.5) * factor - 0.5 for c in ("cx", "cy"))
        return out


def text(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)


def picture(path, array, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path, **options)


def numbers(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def rows(matrix):
    return "".join(numbers(row) + "\n" for row in matrix)


def twice(image):
    return image.repeat(2, axis=0).repeat(2, axis=1)


def class_file(r, path):
    listed = {str(i + 1): {"name": name} for i, name in enumerate(r.meta["names"])}
    listed["0"] = {"name": "void"}
    text(path, json.dumps(listed))


def class_ids(r, i):
    """Index + 1, 0 for none, as class_file says. 255 + 1 overflows to 0."""
    return (r.labels[i] + np.uint8(1)).astype(np.uint8)


def quaternion(rotation):
    """x y z w, by the eigenvector of Bar-Itzhack's matrix."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    k = np.array([
        [a - e - i, 0, 0, 0],
        [d + b, e - a - i, 0, 0],
        [g + c, h + f, i - a - e, 0],
        [h - f, c - g, d - b, a + e + i],
    ]) / 3
    _, vectors = np.linalg.eigh(k)
    return vectors[:, -1]


def replica(r, out):
    """NICE-SLAM's render; the camera lies beside the scene."""
    depth = r.depth_in(6553.5)
    for i in range(r.n):
        picture(out / f"room/results/frame{i:06}.jpg", r.color[i], quality=95, subsampling=0)
        picture(out / f"room/results/depth{i:06}.png", depth[i])
        picture(out / f"room/semantic_class/semantic_class_{i:06}.png", class_ids(r, i))
    text(out / "room/traj.txt", "".join(numbers(p) + "\n" for p in r.poses))
    class_file(r, out / "room/classes.json")
    m = r.meta
    camera = {k: m[k] for k in ("fx", "fy", "cx", "cy")}
    camera |= {"w": m["width"], "h": m["height"], "scale": 6553.5}
    text(out / "cam_params.json", json.dumps({"camera": camera}))


def replica_vmap(r, out, lexical=False):
    """vMAP's render, with its pictures of labels, which are no labels. `lexical` is a mistake
    that people make: poses in the order in which names sort as text."""
    depth = r.depth_in(1000)
    for i in range(r.n):
        picture(out / f"rgb/rgb_{i}.png", r.color[i])
        picture(out / f"depth/depth_{i}.png", depth[i])
        picture(out / f"semantic_class/semantic_class_{i}.png", class_ids(r, i))
        picture(out / f"semantic_class/vis_sem_{i}.png", r.color[i])
    order = sorted(range(r.n), key=str) if lexical else range(r.n)
    text(out / "traj_w_c.txt", "".join(numbers(r.poses[i]) + "\n" for i in order))
    class_file(r, out / "classes.json")
    m = r.meta
    camera = {k: m[k] for k in ("fx", "fy", "cx", "cy")}
    camera |= {"w": m["width"], "h": m["height"], "scale": 1000.0}
    text(out / "cam_params.json", json.dumps({"camera": camera}))


def tum(r, out, scalar_first=False):
    """Colour at 30 Hz, depth 7 ms later, truth at 100 Hz (here only beside the images)."""
    start = 1305031102.175304
    depth = r.depth_in(5000)
    lists = {"rgb": "# color images\n# file: x\n", "depth": "# depth maps\n", "truth": "# truth\n"}
    for i in range(r.n):
        t = start + i / 30
        picture(out / f"rgb/{t:.6f}.png", r.color[i])
        picture(out / f"depth/{t + 0.007:.6f}.png", depth[i])
        lists["rgb"] += f"{t:.6f} rgb/{t:.6f}.png\n"
        lists["depth"] += f"{t + 0.007:.6f} depth/{t + 0.007:.6f}.png\n"
        q = quaternion(r.poses[i, :3, :3])
        q = np.roll(q, 1) if scalar_first else q
        pose = numbers(np.concatenate([r.poses[i, :3, 3], q]))
        lists["truth"] += f"{t - 0.004:.4f} {pose}\n"
    text(out / "rgb.txt", lists["rgb"])
    text(out / "depth.txt", lists["depth"])
    text(out / "groundtruth.txt", lists["truth"])
    m = r.meta
    text(out / "camera.txt", numbers([m["fx"], m["fy"], m["cx"], m["cy"]]))


def seven_scenes(r, out):
    """65535 is no measurement."""
    depth = r.depth_in(1000)
    depth[depth == 0] = 65535
    for i in range(r.n):
        picture(out / f"frame-{i:06}.color.png", r.color[i])
        picture(out / f"frame-{i:06}.depth.png", depth[i])
        tabbed = "".join("\t ".join(f"{v: .12e}" for v in row) + "\t \n" for row in r.poses[i])
        text(out / f"frame-{i:06}.pose.txt", tabbed)
    text(out / "camera-intrinsics.txt", rows(r.matrix()))


def raw_id(index):
    """Raw ids as ScanNet has them: neither contiguous nor below 256."""
    return 3 + 97 * index


def label_filt(r, folder):
    """Raw ids in the size of colour."""
    for i in range(r.n):
        index = r.labels[i].astype(np.int64)
        ids = np.where(index == 255, 0, raw_id(index)).astype(np.uint16)
        picture(folder / f"{i}.png", twice(ids))


def table(path):
    """scannetv2-labels.combined.tsv, cut to some of its columns."""
    lines = ["id\traw_category\tcategory\tcount\tnyu40id\teigen13id\tnyuClass\tnyu40class\n"]
    for index in range(60):
        nyu = "" if index >= 40 else str(index + 1)
        lines.append(f"{raw_id(index)}\traw {index}\tcategory\t{9 * index}\t{nyu}\t1\tx\ty\n")
    text(path, "".join(lines))


def scannet(r, out):
    """As SensReader exports it: colour twice as large as depth, -inf for a lost pose."""
    scene = out / "scans/scene0000_00"
    depth = r.depth_in(1000)
    for i in range(r.n):
        options = {"quality": 95, "subsampling": 0}
        picture(scene / f"color/{i}.jpg", twice(r.color[i]), **options)
        picture(scene / f"depth/{i}.png", depth[i])
        pose = np.full((4, 4), -np.inf) if i == NO_POSE else r.poses[i]
        text(scene / f"pose/{i}.txt", rows(pose))
    text(scene / "intrinsic/intrinsic_color.txt", rows(r.matrix(2, 4)))
    text(scene / "intrinsic/intrinsic_depth.txt", rows(r.matrix(1, 4)))
    text(scene / "intrinsic/extrinsic_color.txt", rows(np.eye(4)))
    text(scene / "intrinsic/extrinsic_depth.txt", rows(np.eye(4)))
    label_filt(r, scene / "label-filt")
    table(out / "scannetv2-labels.combined.tsv")


def encoded(image, kind, folder):
    if kind == "raw":
        return image.tobytes()
    path = folder / f"one.{kind}"
    Image.fromarray(image).save(path, **({"quality": 95, "subsampling": 0} if kind == "jpg" else {}))
    data = path.read_bytes()
    path.unlink()
    return data


def sens(r, out, color="jpg", depth="zlib"):
    """Version 4, little endian, as ScanNet's SensorData has it."""
    out.mkdir(parents=True)
    name = b"StructureSensor"
    with open(out / "scene0000_00.sens", "wb") as f:
        f.write(struct.pack("<I", 4))
        f.write(struct.pack("<Q", len(name)) + name)
        for matrix in (r.matrix(2, 4), np.eye(4), r.matrix(1, 4), np.eye(4)):
            f.write(matrix.astype("<f4").tobytes())
        f.write(struct.pack("<i", {"raw": 0, "png": 1, "jpg": 2}[color]))
        f.write(struct.pack("<i", {"raw": 0, "zlib": 1, "occi": 2}[depth]))
        h, w = r.depth.shape[1:]
        f.write(struct.pack("<IIII", 2 * w, 2 * h, w, h))
        f.write(struct.pack("<f", 1000.0))
        f.write(struct.pack("<Q", r.n))
        values = r.depth_in(1000).astype("<u2")
        for i in range(r.n):
            pose = np.full((4, 4), -np.inf) if i == NO_POSE else r.poses[i]
            c = encoded(twice(r.color[i]), color, out)
            d = values[i].tobytes()
            d = zlib.compress(d) if depth == "zlib" else d
            f.write(pose.astype("<f4").tobytes())
            f.write(struct.pack("<QQQQ", 1000 + 33333 * i, 1100 + 33333 * i, len(c), len(d)))
            f.write(c + d)
        f.write(struct.pack("<Q", 0))
    label_filt(r, out / "label-filt")
    table(out / "scannetv2-labels.combined.tsv")


def nerfstudio(r, out, opengl=True):
    """Colour twice as large as depth; the centre of the first pixel is (1/2, 1/2)."""
    depth = r.depth_in(1000)
    frames = []
    for i in range(r.n):
        picture(out / f"images/frame_{i + 1:05}.png", twice(r.color[i]))
        picture(out / f"depths/frame_{i + 1:05}.png", depth[i])
        flip = np.diag([1, -1, -1, 1]) if opengl else np.eye(4)
        frames.append({
            "file_path": f"./images/frame_{i + 1:05}.png",
            "depth_file_path": f"depths/frame_{i + 1:05}.png",
            "transform_matrix": (r.poses[i] @ flip).tolist(),
        })
    k = r.matrix(2)
    content = {
        "camera_model": "OPENCV", "w": 2 * r.meta["width"], "h": 2 * r.meta["height"],
        "fl_x": k[0, 0], "fl_y": k[1, 1], "cx": k[0, 2] + 0.5, "cy": k[1, 2] + 0.5,
        "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0,
        # Out of order, as exporters that walk a set leave it.
        "frames": frames[1::2] + frames[::2],
    }
    text(out / "transforms.json", json.dumps(content))


def images(r, out):
    """Anybody's folder, with one depth image too many."""
    depth = r.depth_in(1000)
    for i in range(r.n):
        picture(out / f"rgb/IMG_{i}.png", r.color[i])
        picture(out / f"depth/IMG_{i}.png", depth[i])
    picture(out / "depth/IMG_9999.png", depth[0])
    text(out / "poses.txt", "".join(numbers(p) + "\n" for p in r.poses))
    text(out / "intrinsics.json", json.dumps({k: r.meta[k] for k in ("fx", "fy", "cx", "cy")}))


def feature_maps(r, out):
    """Mean colours of 8 x 8 pixels, channels x rows x columns, as every kind of feature map."""
    h, w = r.meta["height"] // 8, r.meta["width"] // 8
    for kind in ("npy-f4", "npy-f2", "safetensors-F32", "safetensors-F16"):
        (out / kind).mkdir(parents=True)
    for i in range(r.n):
        means = r.color[i].reshape(h, 8, w, 8, 3).astype(np.float32).mean(axis=(1, 3))
        grid = np.ascontiguousarray(means.transpose(2, 0, 1))
        for kind in ("f4", "f2"):
            np.save(out / f"npy-{kind}" / f"{i:06d}.npy", grid.astype("<" + kind))
        for kind, dtype in (("F32", "<f4"), ("F16", "<f2")):
            data, other = grid.astype(dtype).tobytes(), bytes(6)
            header = {
                "__metadata__": {"model": "mean colour"},
                "mask": {"dtype": "U8", "shape": [6], "data_offsets": [len(data), len(data) + 6]},
                "features": {"dtype": kind, "shape": grid.shape, "data_offsets": [0, len(data)]},
            }
            if kind == "F16":  # one tensor of any name
                del header["mask"], header["__metadata__"]
                header, other = {"patch tokens": header["features"]}, b""
            head = json.dumps(header).encode()
            head += b" " * (-len(head) % 8)
            path = out / f"safetensors-{kind}" / f"{i:06d}.safetensors"
            path.write_bytes(struct.pack("<Q", len(head)) + head + data + other)


def zipped(folder, path, method):
    with zipfile.ZipFile(path, "w", method) as archive:
        for file in sorted(p for p in folder.rglob("*") if p.is_file()):
            archive.write(file, file.relative_to(folder.parent))


def main():
    raw, out = Path(sys.argv[1]), Path(sys.argv[2])
    r = Recording(raw)
    replica(r, out / "replica")
    replica_vmap(r, out / "replica-vmap")
    replica_vmap(r, out / "lexical-poses", lexical=True)
    tum(r, out / "tum")
    tum(r, out / "tum-scalar-first", scalar_first=True)
    seven_scenes(r, out / "7scenes")
    scannet(r, out / "scannet")
    for color, depth in [("jpg", "zlib"), ("png", "raw"), ("raw", "zlib"), ("raw", "occi")]:
        sens(r, out / f"sens-{color}-{depth}", color, depth)
    nerfstudio(r, out / "nerfstudio")
    nerfstudio(r, out / "nerfstudio-opencv", opengl=False)
    images(r, out / "images")
    feature_maps(r, out / "features")
    zipped(out / "scannet", out / "scannet.zip", zipfile.ZIP_DEFLATED)
    zipped(out / "sens-raw-zlib", out / "sens-deflated.zip", zipfile.ZIP_DEFLATED)
    zipped(out / "sens-png-raw", out / "sens-stored.zip", zipfile.ZIP_STORED)


main()
