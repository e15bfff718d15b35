#!/usr/bin/env python3
"""Computes the figures of `mte-slam eval` again, independently, and lists the differences.

    mte-slam run DATASET --out OUT
    mte-slam eval OUT DATASET --cull coslam,eslam,frustum --write-views VIEWS.json
    pip install evo numpy open3d pillow scipy trimesh
    check_metrics.py OUT DATASET VIEWS.json

DATASET is in Replica's (NICE-SLAM's) layout with a mesh.ply. Trajectory error is evo's; meshes are
ray-cast and measured by Open3D (Embree), sampled by trimesh, matched by scipy's k-d tree; culling
follows the peers' scripts in numpy. Views are those that were written out, and surface samples are
drawn with the same random numbers (PCG, here in numpy), so that nothing differs by chance; with
--own-samples they are trimesh's, and the limit is four standard errors where that is more. Ends
with 1 if a figure is further off than 1 % (or 0.01 cm, or 0.1 percentage points).
"""
import argparse
import json
import re
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
from evo.core import metrics as evo_metrics
from evo.core import sync
from evo.tools import file_interface
from PIL import Image
from scipy.spatial import cKDTree

SAMPLES = 200_000
TOLERANCE_M = 0.03  # Co-SLAM
TRUNCATION_M = 0.06  # ESLAM
FAR_M, MAX_DEPTH_M, MIN_PIXELS = 20.0, 19.0, 100


class Table:
    """Figures side by side."""

    def __init__(self):
        self.rows, self.bad = [], 0

    def add(self, name, ours, other, unit, chance=0.0):
        floor = {"cm": 0.01, "%": 0.1, "m2": 0.005, "dB": 0.01, "": 0.0}[unit]
        limit = max(0.01 * abs(other), floor, chance)
        ok = abs(ours - other) <= limit
        self.bad += not ok
        share = 100 * (ours - other) / other if other else 0.0
        self.rows.append(
            f"{name:46} {ours:12.4f} {other:12.4f} {ours - other:+10.4f} {unit:3} {share:+8.3f} %"
            f"{'' if ok else '   <-- differs'}"
        )

    def __str__(self):
        head = f"{'figure':46} {'mte-slam':>12} {'here':>12} {'difference':>10}"
        return "\n".join([head] + self.rows)


class Mesh:
    """Vertices, faces, and a ray caster over them."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces
        self.scene = o3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(
            o3d.core.Tensor(np.ascontiguousarray(vertices, np.float32)),
            o3d.core.Tensor(np.ascontiguousarray(faces, np.uint32)),
        )

    @staticmethod
    def read(path):
        m = trimesh.load(path, process=False, maintain_order=True)
        return Mesh(np.asarray(m.vertices, np.float64), np.asarray(m.faces))

    def depth(self, camera, pose, far=np.inf):
        """Depth along z through the centre of every pixel, 0 where there is nothing."""
        u, v = np.meshgrid(np.arange(camera["width"]), np.arange(camera["height"]))
        rays = np.stack(
            [(u - camera["cx"]) / camera["fx"], (v - camera["cy"]) / camera["fy"], np.ones(u.shape)], -1
        )
        directions = rays @ pose[:3, :3].T
        origins = np.broadcast_to(pose[:3, 3], directions.shape)
        both = np.concatenate([origins, directions], -1).astype(np.float32)
        # Directions have length 1 along z, so the ray's parameter is the depth.
        t = self.scene.cast_rays(o3d.core.Tensor(both))["t_hit"].numpy()
        return np.where(np.isfinite(t) & (t <= far), t, 0)

    def part(self, keep):
        faces = self.faces[keep]
        used = np.unique(faces)
        new = np.full(len(self.vertices), -1)
        new[used] = np.arange(len(used))
        return Mesh(self.vertices[used], new[faces])

    def as_trimesh(self):
        return trimesh.Trimesh(self.vertices, self.faces, process=False)


def project(camera, pose, points):
    """Pixel positions and depth."""
    q = (points - pose[:3, 3]) @ pose[:3, :3]
    z = q[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = camera["fx"] * q[:, 0] / z + camera["cx"]
        v = camera["fy"] * q[:, 1] / z + camera["cy"]
    return u, v, z


def in_frustum(camera, pose, points):
    u, v, z = project(camera, pose, points)
    inside = (z > 0) & (u >= 0) & (v >= 0) & (u <= camera["width"] - 1) & (v <= camera["height"] - 1)
    return inside, u, v, z


def nearest_pixel(image, inside, u, v):
    return image[np.floor(v[inside] + 0.5).astype(int), np.floor(u[inside] + 0.5).astype(int)]


def any_vertex(mesh, flags):
    return flags[mesh.faces].any(axis=1)


def cull_coslam(mesh, camera, real, virtual):
    framed = np.zeros(len(mesh.vertices), bool)
    visible = framed.copy()
    for k, pose in enumerate(list(real) + list(virtual)):
        inside, u, v, z = in_frustum(camera, pose, mesh.vertices)
        if k < len(real):
            framed |= inside
        depth = nearest_pixel(mesh.depth(camera, pose), inside, u, v)
        visible[inside] |= (depth > 0) & (z[inside] < depth + TOLERANCE_M)
    return mesh.part(any_vertex(mesh, framed) & any_vertex(mesh, visible))


def cull_frustum(mesh, camera, real):
    framed = np.zeros(len(mesh.vertices), bool)
    for pose in real:
        framed |= in_frustum(camera, pose, mesh.vertices)[0]
    return mesh.part(any_vertex(mesh, framed))


def cull_eslam(mesh, camera, real, depths):
    seen = np.zeros(len(mesh.vertices), bool)
    for pose, depth in zip(real, depths):
        u, v, z = project(camera, pose, mesh.vertices)
        # To the pixels' outer edges.
        w, h = camera["width"], camera["height"]
        inside = (z > 1e-6) & (u >= -0.5) & (v >= -0.5) & (u < w - 0.5) & (v < h - 0.5)
        d = nearest_pixel(depth, inside, u, v)
        seen[inside] |= (d > 0) & (z[inside] < d + TRUNCATION_M)
    return mesh.part(any_vertex(mesh, seen))


def pcg(x):
    """A permuted congruential hash of 32 bits (Jarzynski and Olano 2020)."""
    state = (x * np.uint32(747796405) + np.uint32(2891336453)).astype(np.uint32)
    word = ((state >> ((state >> np.uint32(28)) + np.uint32(4))) ^ state) * np.uint32(277803737)
    return (word >> np.uint32(22)) ^ word


def same_samples(mesh, stream, seed):
    """The samples that mte-slam draws: number i of a stream depends on seed, stream and i alone."""
    i = np.arange(SAMPLES, dtype=np.uint32)
    own = pcg(np.uint32([stream])) ^ pcg(i)
    key = pcg(np.uint32([seed]) + pcg(own))
    numbers = [pcg(pcg(np.uint32([k])) ^ key).astype(np.uint64) for k in range(1, 7)]
    join = lambda a, b: ((a << np.uint64(21)) ^ (b >> np.uint64(11))).astype(float) / 2.0**53
    pick, root, along = (join(numbers[k], numbers[k + 1]) for k in (0, 2, 4))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    cumulative = np.cumsum(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
    t = np.searchsorted(cumulative, pick * cumulative[-1], side="right").clip(0, len(a) - 1)
    root, along = np.sqrt(root)[:, None], along[:, None]
    return a[t] * (1 - root) + b[t] * (root * (1 - along)) + c[t] * (root * along)


def surface(table, name, ours, truth, report, own_samples):
    """Accuracy, completion and ratio; both meshes are culled already."""
    if "-icp@" in report["protocol_id"]:
        clouds = []
        for mesh in (ours, truth):
            points = trimesh.sample.sample_surface(mesh.as_trimesh(), SAMPLES, seed=7)[0]
            clouds.append(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)))
        icp = o3d.pipelines.registration
        moved = icp.registration_icp(
            *clouds, 0.1, np.eye(4), icp.TransformationEstimationPointToPoint(),
            icp.ICPConvergenceCriteria(1e-9, 1e-9, 60),
        ).transformation
        ours = Mesh(ours.vertices @ moved[:3, :3].T + moved[:3, 3], ours.faces)
    a, b = ours.as_trimesh(), truth.as_trimesh()
    table.add(f"{name}: area, ours", report["estimated_area_m2"], a.area, "m2")
    table.add(f"{name}: area, truth", report["true_area_m2"], b.area, "m2")
    if own_samples:
        draw = lambda mesh, k: trimesh.sample.sample_surface(mesh.as_trimesh(), SAMPLES, seed=k)[0]
    else:
        draw = lambda mesh, k: same_samples(mesh, k, report["seed"])
    p, q, again = draw(ours, 0), draw(truth, 1), draw(truth, 2)
    error = lambda values: 4 * np.sqrt(2) * values.std() / np.sqrt(SAMPLES) if own_samples else 0.0
    q_tree = cKDTree(q)
    exact = lambda points, mesh: mesh.scene.compute_distance(
        o3d.core.Tensor(points.astype(np.float32))
    ).numpy()
    for kind, accuracy, completion in [
        ("point_to_point", q_tree.query(p)[0], cKDTree(p).query(q)[0]),
        ("point_to_surface", exact(p, truth), exact(q, ours)),
    ]:
        r, short = report[kind], kind.replace("point_to_", "to ")
        for figure, key, values, unit in [
            ("accuracy", "accuracy_cm", 100 * accuracy, "cm"),
            ("completion", "completion_cm", 100 * completion, "cm"),
            ("completion ratio", "completion_ratio_percent", 100.0 * (completion < 0.05), "%"),
        ]:
            table.add(f"{name}: {figure}, {short}", r[key], values.mean(), unit, error(values))
    floor = 100 * q_tree.query(again)[0]
    table.add(f"{name}: floor by sampling", report["sampling_floor_cm"], floor.mean(), "cm", error(floor))


def depth_l1(table, ours, truth, views, report):
    camera = views["depth_camera"]
    errors, both_errors, pixels, missing = [], [], 0, 0
    for pose in views["depth"]:
        t, e = (m.depth(camera, pose, FAR_M) for m in (truth, ours))
        valid = (t > 0) & (t < MAX_DEPTH_M)
        if valid.sum() <= MIN_PIXELS:
            continue
        errors.append(np.abs(t - e)[valid].mean())
        both = valid & (e > 0)
        both_errors.append(np.abs(t - e)[both].mean())
        pixels += valid.sum()
        missing += (valid & (e == 0)).sum()
    table.add("depth L1, mesh: views", report["views"], len(errors), "")
    table.add("depth L1, mesh", report["l1_cm"], 100 * np.mean(errors), "cm")
    both = 100 * np.mean(both_errors)
    table.add("depth L1, mesh: where both are", report["l1_of_both_cm"], both, "cm")
    table.add("depth L1, mesh: missing", report["missing_percent"], 100 * missing / pixels, "%")


def check_views(table, truth, culled, views):
    """That the views are what the protocol says."""
    camera, unseen = views["depth_camera"], np.array(views["unseen"]).reshape(-1, 3)
    if len(unseen):
        framed = sum(in_frustum(views["camera"], p, unseen)[0].sum() for p in views["real"])
        table.add("unseen points in a frame's frustum", framed, 0, "")
        d = truth.scene.compute_distance(o3d.core.Tensor(unseen.astype(np.float32))).numpy()
        table.add("unseen points off the true surface", int((d > 1e-4).sum()), 0, "")
        shown = sum(in_frustum(camera, p, unseen)[0].sum() for p in views["depth"])
        table.add("unseen points in depth views", shown, 0, "")
    to_origin, extents = trimesh.bounds.oriented_bounds(culled.as_trimesh())
    eyes = np.array([p[:3, 3] for p in views["depth"]]) - [0, 0, 0.4]
    local = eyes @ to_origin[:3, :3].T + to_origin[:3, 3]
    # Extents come shortest first. A box found in another way may be off by a little.
    outside = np.abs(local) > 0.5 * extents * [0.3, 0.7, 0.7] + 0.05
    table.add("depth views from outside the box", int(outside.any(axis=1).sum()), 0, "")


def class_ids(dataset):
    """Ids that mean something; classes.json is a list, or a table by id."""
    listed = json.loads((dataset / "classes.json").read_text())
    listed = listed.get("classes", listed)
    if isinstance(listed, dict):
        listed = [{"id": int(i), **c} for i, c in listed.items()]
    return {c["id"] for c in listed if c["name"] not in ("void", "unlabelled", "unlabeled")}


def pictures(table, out, dataset, metrics):
    """Depth, colour and classes of the rendered frames, from the picture files."""
    camera = json.loads((dataset / "cam_params.json").read_text())["camera"]
    raw = class_ids(dataset)
    void = metrics["renders"]["unlabelled_id"]
    errors, psnr, pairs = [], [], []
    for index in metrics["renders"]["frames"]:
        read = lambda kind: np.array(Image.open(out / f"renders/{index:06}.{kind}.png"))
        sensor = np.array(Image.open(dataset / f"results/depth{index:06}.png")) / camera["scale"]
        depth = read("depth") / 1000
        valid = (sensor > 0) & (depth > 0)
        errors.append(np.abs(depth - sensor)[valid])
        name = next((dataset / "results").glob(f"frame{index:06}.*"))
        truth = np.array(Image.open(name).convert("RGB")).astype(float)
        psnr.append(10 * np.log10(255**2 / ((read("color") - truth) ** 2).mean()))
        labels = dataset / f"semantic_class/semantic_class_{index:06}.png"
        pairs.append((np.array(Image.open(labels)).astype(int), read("class").astype(int)))
    # Depth pictures hold whole millimetres.
    mean = 100 * np.concatenate(errors).mean()
    table.add("depth L1, views", metrics["depth"]["l1_cm"], mean, "cm")
    table.add("PSNR, views", metrics["color"]["mean_of_psnr_db"], np.mean(psnr), "dB")
    if "semantics" not in metrics:
        return
    truth, found = (np.concatenate([p[k].ravel() for p in pairs]) for k in (0, 1))
    known = np.isin(truth, list(raw))
    truth, found = truth[known], found[known]
    iou = []
    for c in sorted(raw):
        union = ((truth == c) | (found == c)).sum()
        if union:
            iou.append(((truth == c) & (found == c)).sum() / union)
    s = metrics["semantics"]
    table.add("mIoU", s["miou_percent"], 100 * np.mean(iou), "%")
    table.add("pixel accuracy", s["pixel_accuracy_percent"], 100 * (truth == found).mean(), "%")


def trajectory(table, out, metrics):
    truth = file_interface.read_tum_trajectory_file(str(out / "trajectory_gt.txt"))
    estimate = file_interface.read_tum_trajectory_file(str(out / "trajectory.txt"))
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=1e-4)
    for name, key in [("unaligned", "unaligned_cm"), ("aligned", "aligned_cm")]:
        if name == "aligned":
            estimate.align(truth, correct_scale=False)
        ape = evo_metrics.APE(evo_metrics.PoseRelation.translation_part)
        ape.process_data((truth, estimate))
        for statistic in ("rmse", "mean", "max"):
            ours = metrics["trajectory"][key][statistic]
            table.add(f"ATE {statistic}, {name} (evo)", ours, 100 * ape.get_all_statistics()[statistic], "cm")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("out", type=Path)
    arguments.add_argument("dataset", type=Path)
    arguments.add_argument("views", type=Path)
    arguments.add_argument("--own-samples", action="store_true", help="let trimesh draw the samples")
    arguments = arguments.parse_args()
    out, dataset, own = arguments.out, arguments.dataset, arguments.own_samples
    metrics = json.loads((out / "eval.json").read_text())
    views = json.loads(arguments.views.read_text())
    for key in ("real", "culling", "depth"):
        views[key] = [np.array(p).reshape(4, 4) for p in views[key]]
    table = Table()
    trajectory(table, out, metrics)
    pictures(table, out, dataset, metrics)

    ours, truth = Mesh.read(out / "mesh.ply"), Mesh.read(dataset / "mesh.ply")
    camera, real = views["camera"], views["real"]
    if "mesh" in metrics:
        files = sorted(
            (dataset / "results").glob("depth*.png"), key=lambda p: int(re.findall(r"\d+", p.stem)[0])
        )
        scale = json.loads((dataset / "cam_params.json").read_text())["camera"]["scale"]
        depths = [np.array(Image.open(f)) / scale for f in files[: len(real)]]
        pair = [cull_eslam(m, camera, real, depths) for m in (ours, truth)]
        surface(table, "ESLAM", *pair, metrics["mesh"], own)
    if "mesh_frustum" in metrics:
        pair = [cull_frustum(m, camera, real) for m in (ours, truth)]
        surface(table, "frustum", *pair, metrics["mesh_frustum"], own)
    if "mesh_coslam" in metrics:
        pair = [cull_coslam(m, camera, real, views["culling"]) for m in (ours, truth)]
        surface(table, "Co-SLAM", *pair, metrics["mesh_coslam"], own)
        if "mesh_depth" in metrics:
            check_views(table, truth, pair[1], views)
            depth_l1(table, *pair, views, metrics["mesh_depth"])
    print(table)
    print(f"{table.bad} of {len(table.rows)} figures differ by more than 1 % (0.01 cm, 0.1 points)")
    return 1 if table.bad else 0


if __name__ == "__main__":
    sys.exit(main())
