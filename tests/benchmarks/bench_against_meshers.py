"""How close reconstructions of noisy unoriented points come to bodies of all kinds, beside APSS and Poisson.

Run: python tests/benchmarks/bench_against_meshers.py [SEED ...] [--store]; half an hour of processor time a seed. Peers
that are not installed are said and left out; SIMPLEXMESH_DATA adds the bodies of that folder.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks.bench_quality import apss, poisson
from tests.benchmarks.figures import Figures, installed
from tests.benchmarks.smooth_bodies import bodies

PROTOCOL = """30,000 points without normals on closed bodies, smooth or with small fillets, some from the data folder,
the others drawn at random from implicit forms (smooth_bodies.py); Gaussian noise in % of the diagonal. Mean of the
distances of 40,000 points of the result to the body and of as many of the body to the result; of both the larger 99.9 %
quantile and maximum, all in % of the diagonal; mean error of normals in degrees; genus, but of
what is open or in pieces. Models of 20,000 vertices, as curved fans. Peers: PyMeshLab's APSS with filter scale 4,
Open3D's Poisson with depths 6, 7 and 8, both with Open3D's normals of 20 neighbors, oriented along a minimum spanning
tree, and APSS with PyMeshLab's own normals; of the best peer each figure is the least, the maximum of closed ones."""
NOISES, DEPTHS = (0.0, 0.2, 0.5, 1.0), (6, 7, 8)
POINTS, VERTICES, SAMPLES = 30_000, 20_000, 40_000


class Quality(NamedTuple):
    """How close a surface is to a body: lengths in % of its diagonal, in both directions."""

    mean: float
    p999: float
    worst: float
    normals: float  # degrees
    genus: float  # NaN where the surface is not closed or in pieces


def quality(found: sm.TriangleMesh, body: sm.TriangleMesh) -> Quality:
    """Compare a surface with a body."""
    here, there = found.sampled(SAMPLES, rng=0), body.sampled(SAMPLES, rng=0)
    away, nearest, _ = igl.point_mesh_squared_distance(here.points, body.vertices.copy(), body.faces.astype(np.int64))
    back, *_ = igl.point_mesh_squared_distance(there.points, found.vertices.copy(), found.faces.astype(np.int64))
    scale = 100 / np.linalg.norm(np.ptp(body.vertices, axis=0))
    ways = scale * np.sqrt(away), scale * np.sqrt(back)
    true = body.face_vectors[nearest] / np.linalg.norm(body.face_vectors[nearest], axis=1)[:, None]
    error = np.degrees(np.arccos(np.clip((here.normals * true).sum(axis=1), -1, 1))).mean()
    return Quality(
        float(np.mean([way.mean() for way in ways])),
        float(max(np.quantile(way, 0.999) for way in ways)),
        float(max(way.max() for way in ways)),
        float(min(error, 180 - error)),
        genus(found.faces),
    )


def genus(faces: np.ndarray) -> float:
    """Return the genus of triangles, NaN where they bound no solid in one piece."""
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    used, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    linked = coo_array((np.ones(len(ends)), ends.T), shape=(len(used), len(used)))
    if (uses != 2).any() or connected_components(linked)[0] > 1:
        return float("nan")
    return 1 - (len(used) - len(edges) + len(faces)) / 2


def points_on(body: sm.TriangleMesh, noise: float, seed: int) -> np.ndarray:
    """Return noisy points of a body."""
    rng = np.random.default_rng(seed)
    error = noise / 100 * np.linalg.norm(np.ptp(body.vertices, axis=0))
    return body.sampled(POINTS, rng=rng).points + rng.normal(0, 1, (POINTS, 3)) * error


def of_peers(points: np.ndarray, libraries: dict) -> Iterator[tuple[str, sm.TriangleMesh]]:
    """Yield name and surface of each peer."""
    if "open3d" in libraries:
        o3d = libraries["open3d"]
        oriented = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        oriented.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
        oriented.orient_normals_consistent_tangent_plane(20)
        for depth in DEPTHS:
            yield f"Poisson {depth}", as_surface(*poisson(oriented, depth))
        if "pymeshlab" in libraries:
            yield "APSS", as_surface(*apss(oriented))
    if "pymeshlab" in libraries:
        meshes = libraries["pymeshlab"].MeshSet()
        meshes.add_mesh(libraries["pymeshlab"].Mesh(vertex_matrix=points))
        meshes.compute_normal_for_point_clouds(k=20)
        own = SimpleNamespace(points=points, normals=meshes.current_mesh().vertex_normal_matrix())
        yield "APSS, own normals", as_surface(*apss(own))


def as_surface(vertices: np.ndarray, faces: np.ndarray) -> sm.TriangleMesh:
    """Return a peer's triangles, without those of area zero."""
    surface = sm.TriangleMesh(np.array(vertices, float), np.array(faces, np.int64))
    return replace(surface, faces=surface.faces[(surface.face_vectors != 0).any(axis=1)])


def best(peers: list[Quality]) -> Quality:
    """Return the least of each figure of the peers, the maximum of those that are closed."""
    closed = [each.worst for each in peers if not np.isnan(each.genus)]
    mean, p999, _, normals, _ = (min(values) for values in zip(*peers, strict=True))
    return Quality(mean, p999, min(closed, default=np.nan), normals, np.nan)


def keep(rows: dict[str, list[Quality]], libraries: dict) -> None:
    """Tell and store the figures of each case, but for those that are NaN."""
    figures = Figures("against_meshers", PROTOCOL, list(libraries))
    units = Quality("% of the diagonal", "% of the diagonal", "% of the diagonal", "degrees", "")
    for case, values in rows.items():
        for what, unit, each in zip(Quality._fields, units, zip(*values, strict=True), strict=True):
            if not np.isnan(each).any():
                figures.add(f"{case}, {what}", each, unit)
    figures.keep()


def main() -> None:
    """Tell the figures of the seeds given, by default of 1."""
    warnings.simplefilter("ignore")
    libraries, rows = installed("open3d", "pymeshlab"), {}
    for seed in [int(argument) for argument in sys.argv[1:]] or [1]:
        for name, body in bodies(seed):
            for noise in NOISES:
                points = points_on(body, noise, seed)
                ours = sm.reconstruct(points, vertices=VERTICES).mesh.triangulated("curved")
                found = {who: quality(surface, body) for who, surface in of_peers(points, libraries)}
                if found:
                    found["best peer"] = best(list(found.values()))
                for who, each in {"simplexmesh": quality(ours, body), **found}.items():
                    rows.setdefault(f"{name}, {noise:g} % noise, {who}", []).append(each)
                    print(f"seed {seed}, {name}, {noise:g} % noise, {who}: {each}", flush=True)
    keep(rows, libraries)


if __name__ == "__main__":
    main()
