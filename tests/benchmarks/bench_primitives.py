"""Primitives of random plants of ten shapes beside other libraries, which are told the noise: shares, errors, CPU.

Usage: python tests/benchmarks/bench_primitives.py [scenes] [folder of peers] [methods, with commas between]

CGAL (GPL), Open3D and pyransac3d are no dependencies: install `cgal open3d pyransac3d` into a virtual environment of
their own and name its site-packages. What is not there is said and left out.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
import time
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.cloud.scenes.plant import plant_scene, scanned_plant
from tests.cloud.scenes.scoring import KINDS, score

CASES = {
    "1 mm": (plant_scene, 0.001, 0.0),
    "2 mm, 10 %": (plant_scene, 0.002, 0.1),
    "5 mm, 10 %": (plant_scene, 0.005, 0.1),
    "5 mm, 30 %": (plant_scene, 0.005, 0.3),
    "1 to 6 mm, 10 %": (plant_scene, (0.001, 0.006), 0.1),  # of each shape
    "scanned, 2 mm, 10 %": (scanned_plant, 0.002, 0.1),
    "scanned, 5 mm, 30 %": (scanned_plant, 0.005, 0.3),
}
LEAST = 100  # points of shapes that are asked for, and of those that peers may find
NEAR = 3  # deviations of the noise: within it points are of a shape
APART = 0.05  # metres between the points of one shape, at most, for CGAL
MOST = 10  # shapes by those who find one at a time
FEW = 1  # scenes of pyransac3d, which takes a minute each
COLUMNS = (
    *("case", "method", "precision", "recall", "planes", "cylinders", "tori", "spheres", "cones"),
    *("radius %", "bend %", "axis °", "tangent %", "ARI", "ARI off planes", "outliers claimed", "CPU s"),
)


def ours(scene):
    found = sm.extract_primitives(scene.points)
    return found.primitives, found.labels


def cgal(scene, probability=0.01):
    """CGAL's efficient RANSAC (Schnabel, Wahl and Klein 2007), all kinds; it puts points in another order."""
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Point_set_processing_3 import pca_estimate_normals
    from CGAL.CGAL_Shape_detection import efficient_RANSAC

    cloud = Point_set_3()
    numbers, shapes = cloud.add_int_map("number"), cloud.add_int_map("shape")
    for number, point in enumerate(scene.points.tolist()):
        numbers.set(cloud.insert(Point_3(*point)), number)
    pca_estimate_normals(cloud, 16)
    options = dict.fromkeys(("planes", "cones", "cylinders", "spheres", "tori"), True)
    reach = {"epsilon": NEAR * scene.noise, "cluster_epsilon": APART}
    lines = efficient_RANSAC(cloud, shapes, min_points=LEAST, probability=probability, **reach, **options)
    order = np.array([(numbers.get(index), shapes.get(index)) for index in cloud.indices()])
    labels = np.full(len(scene.points), -1)
    labels[order[:, 0]] = order[:, 1]
    return [read(line) for line in lines], labels


def careful_cgal(scene):
    return cgal(scene, probability=1e-4)


def read(line):
    """A primitive from CGAL's text about it."""
    kind = line.split()[1]
    values = np.array(re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", line.partition("#Pts")[0]), float)
    place, axis = values[:3], values[3:6]
    if kind == "plane":  # its sign of the offset is the other than printed
        return SimpleNamespace(kind=kind, normal=place, point=-values[3] * place)
    if kind == "sphere":
        return SimpleNamespace(kind=kind, center=place, radius=values[3])
    if kind == "cylinder":
        return SimpleNamespace(kind=kind, point=place, axis=axis, radius=values[6])
    if kind == "cone":
        return SimpleNamespace(kind=kind, point=place, axis=axis, half_angle=values[6])
    return SimpleNamespace(kind=kind, center=place, axis=axis, radius=values[6], tube_radius=values[7])


def open3d(scene):
    """Open3D's planes, one after the other: it has no other kinds."""
    import open3d

    def plane(points):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        values, rows = cloud.segment_plane(NEAR * scene.noise, 3, 1000)
        return plane_of(values), rows

    open3d.utility.random.seed(0)
    return one_by_one(scene, [[plane]] * MOST)


def pyransac3d(scene):
    """Two planes, then the best of cylinder and sphere."""
    import pyransac3d

    near = NEAR * scene.noise

    def plane(points):
        values, rows = pyransac3d.Plane().fit(points, near, maxIteration=600)
        return plane_of(values), rows

    def cylinder(points):
        place, axis, radius, rows = pyransac3d.Cylinder().fit(points, near, maxIteration=300)
        return SimpleNamespace(kind="cylinder", point=np.array(place), axis=np.array(axis), radius=radius), rows

    def sphere(points):
        place, radius, rows = pyransac3d.Sphere().fit(points, near, maxIteration=300)
        return SimpleNamespace(kind="sphere", center=np.array(place), radius=radius), rows

    return one_by_one(scene, [[plane]] * 2 + [[cylinder, sphere]] * (MOST - 2))


def plane_of(values):
    normal = np.array(values[:3])
    return SimpleNamespace(kind="plane", normal=normal, point=-values[3] * normal / (normal @ normal))


def one_by_one(scene, rounds):
    """The best of some fits to what is left, round by round."""
    labels, found = np.full(len(scene.points), -1), []
    for fits in rounds:
        left = np.flatnonzero(labels < 0)
        if len(left) < LEAST:
            break
        primitive, rows = max((fit(scene.points[left]) for fit in fits), key=lambda each: len(each[1]))
        if len(rows) >= LEAST:
            labels[left[rows]] = len(found)
            found.append(primitive)
    return found, labels


METHODS = {"ours": ours, "CGAL": cgal, "careful CGAL": careful_cgal, "Open3D": open3d, "pyransac3d": pyransac3d}
PEERS = {"CGAL": "CGAL", "careful CGAL": "CGAL", "Open3D": "open3d", "pyransac3d": "pyransac3d"}


def scored(method, scene):
    """The score, and seconds of all threads."""
    began = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):  # Open3D and CGAL talk
        primitives, labels = METHODS[method](scene)
    return score(primitives, labels, scene, LEAST), time.process_time() - began


def cells(scores, seconds):
    """Means over scenes, counts of all, medians of median errors with the greatest of all beside them."""
    found, true = (sum((getattr(each, name) for each in scores), Counter()) for name in ("found", "true"))

    def values(name, factor=1.0):
        some = np.array([getattr(each, name) for each in scores]) * factor
        return some[np.isfinite(some)]

    def mean(name):
        return f"{values(name).mean():.2f}" if len(values(name)) else "–"

    def errors(name, factor):
        middle, most = values(name, factor), values(f"worst_{name}", factor)
        return f"{np.median(middle):.2f}/{most.max():.1f}" if len(middle) else "–"

    tangency = values("tangency", 100)
    return [
        mean("precision"),
        mean("recall"),
        *(f"{found[kind]}/{true[kind]}" for kind in KINDS),
        errors("radius", 100),
        errors("bend_radius", 100),
        errors("axis", np.degrees(1)),
        f"{tangency.max():.2g}" if len(tangency) else "–",
        mean("index"),
        mean("curved_index"),
        mean("claimed"),
        f"{np.mean(seconds):.1f}",
    ]


def main() -> None:
    scenes, folder, names = [*sys.argv[1:], *("5", "", ",".join(METHODS))[len(sys.argv) - 1 :]]
    sys.path += [folder] if folder else []
    methods = names.split(",")
    for name in [name for name in methods if name in PEERS and find_spec(PEERS[name]) is None]:
        print(f"{name}: not installed, left out")
        methods.remove(name)
    if "ours" in methods:
        ours(plant_scene(0, count=5000))  # compiles
    print(f"{scenes} random scenes a row; errors median/worst; tangent: worst, of tube radii; least points {LEAST}")
    print("|", " | ".join(COLUMNS), "|\n|" + " --- |" * len(COLUMNS), flush=True)
    for case, (make, noise, outliers) in CASES.items():
        for method in methods:
            seeds = range(min(int(scenes), FEW) if method == "pyransac3d" else int(scenes))
            each = [scored(method, make(seed, noise, outliers)) for seed in seeds]
            print(f"| {case} | {method} |", " | ".join(cells(*zip(*each, strict=True))), "|", flush=True)


if __name__ == "__main__":
    main()
