"""Speed and accuracy of decimation, compared with that of the dual triangles by libigl and VTK.

Usage: SIMPLEXMESH_DATA=folder python tests/benchmarks/bench_decimate.py [words] [--store], where words are any of head,
fandisk, elephant, by default these three; within, what a tolerance leaves; picture.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from pathlib import Path

import igl
import numpy as np
import pyvista as pv
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.motion.targets.triangles import surface_distance
from tests.benchmarks.figures import Figures

PROTOCOL = """A simplex mesh of n vertices is dual to n triangles on n / 2 vertices. Ours is decimated to a number of
vertices; the dual triangles by the peers to as many triangles, and to as many vertices, which are twice the triangles.
Rms distance of 60,000 points of either surface to the other, in % of the diagonal, each result measured against its own
input; processor time of the fastest of three calls after a first one. Deterministic but for the time: one value. Within
a tolerance: three runs, vertices moved by 1e-12 of the diagonal."""
CASES = {"head": 4000, "fandisk": 1000, "elephant": 1000}
WITHIN = {"coupling": 1.0, "fandisk": 1.0, "elephant": 0.5}  # tolerances in % of the diagonal
SAMPLES = 60_000


def loaded(name: str) -> sm.SimplexMesh:
    """Return the dual of a file of triangles, or of marching cubes of the head CT at the skin."""
    folder = Path(os.environ["SIMPLEXMESH_DATA"])
    if name != "head":
        return sm.dual(sm.read_triangles(folder / f"{name}.off"))
    from skimage.measure import marching_cubes

    volume = sm.read_volume(folder / "head_ct.mhd")
    corners, faces, _, _ = marching_cubes(np.pad(np.asarray(volume.values, float), 1), 500)
    return sm.dual((volume.to_world(corners - 1), faces))


def sampled(vertices, faces):
    """Return points distributed uniformly over triangles."""
    rng = np.random.default_rng(0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    row = rng.choice(len(faces), SAMPLES, p=area / area.sum())
    u, v = rng.random((2, SAMPLES))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    return a[row] + u[:, None] * (b - a)[row] + v[:, None] * (c - a)[row]


def apart(before, after):
    """Return rms of the points of each surface to the other, and the largest of these distances."""
    there = surface_distance(sampled(*before), *after)
    back = surface_distance(sampled(*after), *before)
    return rms(there), rms(back), max(there.max(), back.max())


def rms(values):
    return float(np.sqrt((values**2).mean()))


def timed(job, times=3):
    """Return the result of a job, the time of its first call, and the smallest of the others."""
    seconds = []
    for _ in range(times + 1):
        began = time.process_time()
        out = job()
        seconds.append(time.process_time() - began)
    return out, seconds[0], min(seconds[1:])


def corners_and_faces(out):
    """Return the vertices and triangles of a peer's result."""
    if isinstance(out, pv.PolyData):
        return np.array(out.points, float), np.array(out.regular_faces, np.int64)
    vertices, faces = (part for part in out if isinstance(part, np.ndarray) and part.ndim == 2)
    return np.ascontiguousarray(vertices, float), np.ascontiguousarray(faces, np.int64)


def peers(triangles, count):
    """Return the peers by name, as jobs."""
    vertices, faces = np.array(triangles.vertices, float), np.array(triangles.faces, np.int64)
    polygons = pv.PolyData.from_regular_faces(vertices, faces)
    share = 1 - count / len(faces)
    return {
        "igl.qslim": lambda: igl.qslim(vertices, faces, count),
        "VTK quadrics": lambda: polygons.decimate(share),
        "VTK pro": lambda: polygons.decimate_pro(share, preserve_topology=True),
    }


def told(figures: Figures, name: str) -> None:
    """Tell times and distances of our decimation and of the peers' for one mesh."""
    mesh, count = loaded(name), CASES[name]
    percent = 100 / float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    out, cold, ours = timed(lambda: sm.decimate(mesh, vertices=count))
    problems = out.mesh.check(self_intersections=True).problems
    print(f"\n{name}: {mesh} to {out.mesh}")
    print(f"first call {cold:.2f} s, {len(out.exceptions)} exceptions, problems: {'; '.join(problems) or 'none'}")
    fan, dual = mesh.triangulated(method="fan"), mesh.triangulated(method="dual")
    found = [("decimate", ours, fan, out.mesh.triangulated(method="fan"))]
    for title, triangles in (("as many triangles", count), ("as many vertices", 2 * count)):
        for peer, job in peers(dual, triangles).items():
            got, _, seconds = timed(job)
            found.append((f"{peer}, {title}", seconds, dual, sm.TriangleMesh(*corners_and_faces(got))))
    for title, seconds, before, after in found:
        measured = apart((before.vertices, before.faces), (after.vertices, after.faces))
        for what, value in zip(("to the new surface", "back", "largest"), measured, strict=True):
            figures.add(f"{name}, {title}, {what}", [percent * value], "% of the diagonal")
        figures.add(f"{name}, {title}, time", [seconds], "s")
        figures.add(f"{name}, {title}, time over ours", [seconds / ours], "")


def within(figures: Figures, name: str) -> None:
    """Tell what a tolerance leaves of a mesh, as it is and moved by 1e-12 of its diagonal, twice."""
    mesh, left, largest = loaded(name), [], []
    diagonal = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    for seed in range(3):
        off = (1e-12 * diagonal if seed else 0.0) * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
        out = sm.decimate(mesh.moved(mesh.vertices + off), tolerance=0.01 * WITHIN[name] * diagonal)
        left.append(out.mesh.n_vertices)
        largest.append(100 * out.largest / diagonal)
    figures.add(f"{name}, {mesh.n_vertices:,} vertices, within {WITHIN[name]:g} %, left", left, "vertices")
    figures.add(f"{name}, within {WITHIN[name]:g} %, largest", largest, "% of the diagonal")


def picture(path: str = "decimated.jpg") -> None:
    """Draw head, fandisk and elephant before and after."""
    views = {
        "head": ((0.6, -1, -0.2), (0, 0, -1)),
        "fandisk": ((-1, 0.8, 0.3), (0, 0, 1)),
        "elephant": ((0.5, 0.2, 1), (0, 1, 0)),
    }
    plotter = pv.Plotter(off_screen=True, shape=(2, 3), window_size=(1200, 800), border=False)
    for column, (name, view) in enumerate(views.items()):
        mesh = loaded(name)
        for row, shown in enumerate((mesh, sm.decimate(mesh, vertices=CASES[name]).mesh)):
            plotter.subplot(row, column)
            look = {"show_edges": True, "edge_color": "#4a545c", "line_width": 1.0 if row else 0.3, "ambient": 0.25}
            plotter.add_mesh(shown.to_pyvista(), color="#c9d3dc", **look)
            plotter.add_text(f"{shown.n_vertices:,} vertices", position="lower_edge", font_size=9, color="#4a545c")
            plotter.view_vector(*view)
            plotter.camera.zoom(1.35)
    Image.fromarray(plotter.screenshot(return_img=True)).save(path, quality=85, optimize=True)
    plotter.close()


def main() -> None:
    """Print the tables given by name, by default all."""
    warnings.simplefilter("ignore", sm.SimplexMeshWarning)
    if "SIMPLEXMESH_DATA" not in os.environ:
        print("set SIMPLEXMESH_DATA to the folder of real data")
        return
    if "picture" in sys.argv:
        picture()
        return
    figures = Figures("decimate", PROTOCOL, ["libigl", "vtk"])
    for name in [name for name in CASES if name in sys.argv] or ([] if "within" in sys.argv else CASES):
        told(figures, name)
        figures.keep()
    for name in WITHIN if "within" in sys.argv else ():
        within(figures, name)
        figures.keep()


if __name__ == "__main__":
    main()
