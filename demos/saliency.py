"""Saliency and surface types of solids on a plate.

Hemisphere, half ring, cylinder, cone and prism stand on a plate. The signs of mean and Gaussian curvature classify them
by surface type; tips and corners are salient points, and the rim of the cylinder is a circle of high curvature. Left:
mean curvature with the salient points. Right: surface types.
"""

import numpy as np
import pyvista as pv

import simplexmesh as sm

BALL, RING, TUBE, CONE, PRISM = (-2.2, 0.8), (-0.4, 0.7), (1.5, 0.8), (-1.6, -1.1), (0.8, -1.1)
HEIGHT = 1.0


def main(size="large"):
    """Classify the plate; return the surface type of each solid, and the errors of the tips and the rim found."""
    mesh = phantom(0.035 if size == "large" else 0.06)
    curvature = sm.curvature(mesh)
    kinds = sm.hk_classes(mesh, curvature=curvature)
    salient = sm.salient_points(mesh, of="mean", curvature=curvature)
    rim = sm.rim_circle(mesh, (*TUBE, HEIGHT), radius=0.75, curvature=curvature)
    tip = np.array([*CONE, HEIGHT])
    return {
        "mesh": mesh,
        "curvature": curvature,
        "kinds": kinds,
        "salient": salient,
        "named": {name: named(kinds, part) for name, part in parts(mesh.vertices).items()},
        "tip": float(np.linalg.norm(salient.points - tip, axis=1).min()),
        "corners": float(max(np.linalg.norm(salient.points - corner, axis=1).min() for corner in corners())),
        "rim": float(np.linalg.norm(rim.center - [*TUBE, HEIGHT])),
        "rim_radius": rim.radius,
    }


def phantom(step):
    """Return the plate with its solids, from their distance functions."""
    x, y, z = np.mgrid[-3.2:2.6:step, -2:1.8:step, -0.3:1.2:step]

    def away(place):
        return np.hypot(x - place[0], y - place[1])

    prism = np.maximum(np.maximum(np.abs(x - PRISM[0]) - 0.7, np.abs(y - PRISM[1]) - 0.4), z - 0.7)
    solids = [
        z,
        np.hypot(away(BALL), z) - 0.7,
        np.hypot(away(RING) - 0.6, z) - 0.25,
        np.maximum(away(TUBE) - 0.5, z - HEIGHT),
        (away(CONE) * HEIGHT + (z - HEIGHT) * 0.7) / np.hypot(HEIGHT, 0.7),
        prism,
    ]
    grid = pv.ImageData(dimensions=x.shape, spacing=(step,) * 3, origin=(x.min(), y.min(), z.min()))
    grid["away"] = np.min(solids, axis=0).ravel(order="F")
    found = grid.contour([0.0], scalars="away", method="flying_edges").clean()
    mesh = sm.TriangleMesh(np.asarray(found.points, dtype=float), found.regular_faces)
    return mesh if mesh.face_vectors[:, 2].sum() > 0 else sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def corners():
    """Return the upper corners of the prism."""
    return [(PRISM[0] + i * 0.7, PRISM[1] + j * 0.4, 0.7) for i in (-1, 1) for j in (-1, 1)]


def parts(at):
    """Return masks of the vertices well within each surface."""
    x, y, z = at.T
    ring, tube, cone = (np.hypot(x - place[0], y - place[1]) for place in (RING, TUBE, CONE))
    inner = np.hypot(ring - 0.6, z) < 0.3
    return {
        "hemisphere": (np.hypot(x - BALL[0], y - BALL[1]) < 0.5) & (z > 0.3),
        "ring outside": inner & (ring > 0.72) & (z > 0.12),
        "ring inside": inner & (ring < 0.48) & (z > 0.12),
        "cylinder": (tube < 0.55) & (z > 0.25) & (z < 0.75),
        "cone": (cone < 0.6) & (z > 0.25) & (z < 0.65),
        "prism's top": (np.abs(x - PRISM[0]) < 0.45) & (np.abs(y - PRISM[1]) < 0.2) & (z > 0.6),
    }


def named(kinds, part):
    """Return the most frequent type among some vertices, and its share."""
    count = np.bincount(kinds.labels[part])
    return kinds.names[count.argmax()], float(count.max() / count.sum())


def show(out):
    """Color the plate by its curvature and by its surface types."""
    plotter = sm.plot.stage(columns=2)
    sm.plot.heat(
        out["mesh"], out["curvature"].mean, name="mean curvature", limits=(-6, 6), marks=out["salient"], plotter=plotter
    )
    plotter.subplot(0, 1)
    whole = sm.regions(out["mesh"], out["kinds"])
    kinds = whole.classes[whole.labels]
    sm.plot.classes(out["mesh"], kinds, names=out["kinds"].names, colors=out["kinds"].colors, plotter=plotter)
    return sm.plot.looked_at(plotter, (0.1, -0.9, 1.0))


if __name__ == "__main__":
    show(main()).show()
