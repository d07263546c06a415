"""A vase, made from a cylinder by five contours.

Foot, belly and lip are circles at which the surface has no mean curvature. Between them two wavy contours, smooth lines
through four pins each, hold the surface at 45 degrees: opening upward at the stem, closing at the neck.
"""

import numpy as np

import simplexmesh as sm

CONTOURS = {"foot": (0.6, 0.0), "stem": (0.75, 0.6), "belly": (1.15, 1.35), "neck": (0.7, 2.2), "lip": (0.75, 2.9)}
"""Radius and height of each."""

WAVE = 0.12  # of stem and neck, up and down
ANGLES = {"stem": np.radians(-45), "neck": np.radians(45)}


def main(size="large"):
    """Return the cylinder and the vase with their contours, and how far its normals point up at the wavy ones."""
    tube = with_rings(sm.cylinder(*((48, 44) if size == "large" else (24, 22))))
    x, y, z = tube.vertices.T
    turn, (radii, heights) = np.arctan2(y, x), np.transpose(list(CONTOURS.values()))
    start, conditions = np.stack([x, y, z], axis=1) * np.interp(z, heights, radii)[:, None] ** [1, 1, 0], []
    for name, ring in tube.contours.items():
        radius, height = CONTOURS[name]
        at = turn[ring.vertices]
        wavy = height + (WAVE if name in ANGLES else 0.0) * np.cos(2 * at)
        start[ring.vertices] = np.stack([radius * np.cos(at), radius * np.sin(at), wavy], axis=1)
        if name in ANGLES:
            four = ring.vertices[np.arange(4) * len(ring) // 4]
            conditions += [sm.pinned(name, at=four), sm.smooth(name, tangent=ANGLES[name])]
        else:
            conditions += [sm.pinned(name), sm.smooth(name, mean_curvature=0.0)]
    model = sm.DeformableModel(tube.moved(start), damping=0.1, contours=conditions)
    for _ in model.run(3000, every=100, tolerance=1e-6):
        pass
    vase = model.mesh
    up = {name: float(np.arcsin(vase.normals[vase.contours[name].vertices, 2]).mean()) for name in ANGLES}
    return {"meshes": {"a cylinder": tube, "a vase": vase}, "angles": up}


def with_rings(tube):
    """Return a cylinder as tall as the vase with its contours, which have their lower side on the left."""
    low, high = tube.bounds[:, 2]
    tube = tube.moved((tube.vertices - [0, 0, low]) * [1, 1, CONTOURS["lip"][1] / (high - low)])
    foot, lip = sorted(sm.Contour.of_holes(tube), key=lambda rim: tube.vertices[rim.vertices, 2].mean())
    c = tube.connectivity
    height = np.add.reduceat(tube.vertices[c.face_vertices, 2], c.face_offsets[:-1]) / c.face_sizes
    rings = {"foot": foot, "lip": lip}
    for name in ("stem", "belly", "neck"):
        (rings[name],) = sm.Contour.of_faces(tube, height < CONTOURS[name][1])
    return tube.with_contours(**rings)


def show(out):
    """Draw the cylinder and the vase."""
    plotter = sm.plot.stage(columns=2)
    for k, (name, mesh) in enumerate(out["meshes"].items()):
        plotter.subplot(0, k)
        sm.plot.surface(mesh, contours=True, title=name, plotter=plotter)
    return sm.plot.looked_at(plotter, (0.5, -1.0, 0.3), up="z")


if __name__ == "__main__":
    show(main()).show()
