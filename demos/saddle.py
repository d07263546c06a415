"""Soap films on wires: a saddle.

The rim of a disk is a contour that four pins hold, two high and two low. Straight between them it has corners, as a
polygon; with continuous curvature it is a smooth wire. The film, of no mean curvature, follows. Last, the same wire
with a film that meets it at an angle of its own.
"""

import numpy as np

import simplexmesh as sm

HEIGHT = 0.5  # of the pins, over and under the middle
ANGLE = np.radians(-60)  # of the last surface to the wire


def main(size="large"):
    """Return films on the polygon, the wire, and at an angle, and their largest mean curvatures."""
    disk, rim = round_disk(20 if size == "large" else 8)
    pins = rim.vertices[np.arange(4) * len(rim) // 4]
    turn = np.arctan2(disk.vertices[:, 1], disk.vertices[:, 0]) - np.arctan2(*disk.vertices[pins[0], 1::-1])
    radius = np.linalg.norm(disk.vertices, axis=1)
    bent = disk.moved(disk.vertices + HEIGHT * (radius**2 * np.cos(2 * turn))[:, None] * [0, 0, 1])
    held = sm.pinned(rim, at=pins)
    film = {"mean_curvature": 0.0}
    surfaces = {
        "corners": at_rest(bent, [held, sm.smooth(rim, continuity="normal", **film)]),
        "a smooth wire": at_rest(bent, [held, sm.smooth(rim, **film)]),
    }
    wire = surfaces["a smooth wire"]
    surfaces["at an angle"] = at_rest(wire, [sm.pinned(rim), sm.smooth(rim.reversed(), tangent=ANGLE)])
    inner = np.setdiff1d(np.arange(disk.n_vertices), rim.vertices)
    curvature = {name: float(np.abs(mesh.sphere_curvature[inner]).max()) for name, mesh in surfaces.items()}
    return {"meshes": {name: mesh.with_contours(rim=rim) for name, mesh in surfaces.items()}, "curvature": curvature}


def round_disk(count):
    """Return a disk of radius 1 with its rim."""
    disk = sm.plane(count, count)
    (rim,) = sm.Contour.of_holes(disk)
    turn = np.linspace(0, 2 * np.pi, 721)
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    disk = disk.moved(2 * (disk.vertices - disk.vertices.mean(axis=0)))
    return at_rest(disk, sm.pinned(rim, circle)), rim


def at_rest(mesh, contours):
    """Return the mesh after a motion under its contours only."""
    model = sm.DeformableModel(mesh, rigidity=4, damping=0.1, contours=contours)
    for _ in model.run(3000, every=100, tolerance=1e-6):
        pass
    return model.mesh


def show(out):
    """Draw the three in panels, with the wire."""
    plotter = sm.plot.stage(columns=3)
    for k, (name, mesh) in enumerate(out["meshes"].items()):
        plotter.subplot(0, k)
        sm.plot.surface(mesh, contours=True, title=name, plotter=plotter)
    return sm.plot.looked_at(plotter, (0.5, -1.0, 0.6), up="z")


if __name__ == "__main__":
    show(main()).show()
