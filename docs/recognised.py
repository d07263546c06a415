"""Draw images/recognised.jpg, single views on the models they were recognized as: `python docs/recognised.py`.

The bodies are those of `tests/benchmarks/bench_recognise.py`; `SIMPLEXMESH_DATA` names the folder of their files.
"""

import os
import sys
import tempfile
from pathlib import Path

os.environ["PYVISTA_OFF_SCREEN"] = "true"
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from PIL import Image

import simplexmesh as sm
from tests import reference_recognition as reference
from tests.benchmarks import bench_recognise

PICTURE = Path(__file__).parent / "images" / "recognised.jpg"
SHOWN = {  # name: direction to the camera of the picture, and the axis that points up
    "elephant": ((1.0, 0.35, 0.6), (0.0, 1.0, 0.0)),
    "spot": ((0.8, 0.35, -1.0), (0.0, 1.0, 0.0)),
    "mannequin": ((0.8, -1.0, 0.3), (0.0, 0.0, 1.0)),
}
NEAR = np.cos(np.radians(35))  # the scanner is at most so far from the camera of the picture, so that its points show
NOISE = 0.003  # of the diagonal
MODEL, SCAN = "#a9bac6", "#c2502e"


def found_views():
    """Yield the name, the model, the points of one view placed on it, and the score, of each body shown."""
    bodies = bench_recognise.bodies()
    with tempfile.TemporaryDirectory() as folder:
        library = bench_recognise.filled(Path(folder) / "bodies.sml", bodies)
        for name, (toward, up) in SHOWN.items():
            points, model = bodies[name]
            seed = seed_of_view(np.array(toward) / np.linalg.norm(toward))
            seen = bench_recognise.seen(points, np.random.default_rng(seed))
            scan, _ = bench_recognise.turned(seen, NOISE, np.random.default_rng(1))
            best = library.recognise(scan)[0]
            if best.name != name:
                raise RuntimeError(f"the view of {name} was recognized as {best.name}")
            T = picture_axes(toward, up)
            placed = sm.PointCloud(scan).transformed(T @ np.linalg.inv(best.T_scan_model))
            yield name, model.transformed(T), placed, best.score


def seed_of_view(toward):
    """Return the first seed with which `seen` looks from near a direction."""
    return next(
        seed for seed in range(1000) if -reference.random_rotation(np.random.default_rng(seed))[2] @ toward > NEAR
    )


def picture_axes(toward, up):
    """Return the (4, 4) rotation to axes right, up and toward the camera."""
    toward = np.array(toward) / np.linalg.norm(toward)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = right, np.cross(toward, right), toward
    return T


def main():
    plotter = sm.plot.stage(columns=len(SHOWN), size=(1500, 560))
    for column, (name, model, scan, score) in enumerate(found_views()):
        plotter.subplot(0, column)
        sm.plot.surface(model, color=MODEL, edges=False, title=f"{name}, score {score:.2f}", plotter=plotter)
        plotter.add_mesh(scan.points, color=SCAN, point_size=5, render_points_as_spheres=True)
    sm.plot.looked_at(plotter, "xy")
    Image.fromarray(plotter.screenshot(return_img=True)).save(PICTURE, quality=85, optimize=True)
    plotter.close()
    print(f"written: {PICTURE}, {PICTURE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    sys.exit(main())
