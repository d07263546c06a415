"""Registration of a partial, noisy scan of a kidney to the whole.

The scan is randomly rotated, noisy and cut off at a plane; neither pose nor noise is given. The signatures of the whole
in two poses are also compared under all rotations: there is one peak, so the pose is unambiguous.
"""

import numpy as np
import pyvista as pv
from pyvista import examples

import simplexmesh as sm

BRAIN, KIDNEY = 2, 8


def main(size="large"):
    """Register a part of an organ to the whole, and compare the signatures of the whole in two poses."""
    rng = np.random.default_rng(5)
    whole = isosurface(KIDNEY if size == "large" else BRAIN)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = random_rotation(rng), 3 * whole.diagonal * rng.normal(size=3)
    noise = 0.002 * whole.diagonal * rng.normal(size=whole.vertices.shape)
    noisy = sm.TriangleMesh(whole.vertices + noise, whole.faces).transformed(T)
    side = whole.vertices @ [0.5, 0.3, -1.0]
    seen = side > np.quantile(side, 0.4)
    scan = sm.TriangleMesh(noisy.vertices, noisy.faces[seen[noisy.faces].all(axis=1)])
    found = sm.register(scan, whole)
    error = noisy.transformed(found.T_target_source).vertices - whole.vertices - noise
    frequency = 9 if size == "large" else 5
    one, two = sm.sai(whole, frequency), sm.sai(noisy, frequency)
    first, second, *_ = matches = sm.match(two, one)
    return {
        "scan": scan,
        "whole": whole,
        "registration": found,
        "signatures": (two, one),
        "matches": matches,
        "error": float(np.linalg.norm(error, axis=1).max() / whole.diagonal),
        "degrees": angle(first.T_target_source[:3, :3], np.linalg.inv(T)[:3, :3]),
        "distances": (first.distance, second.distance),
    }


def isosurface(label):
    """Return the surface of an organ of the frog that comes with PyVista, smoothed by two voxels."""
    frog = examples.load_frog_tissues()
    inside = np.asarray(frog.active_scalars).reshape(frog.dimensions, order="F") == label
    low, high = (end(np.argwhere(inside), axis=0) for end in (np.min, np.max))
    box = np.pad(inside[tuple(map(slice, low, high + 1))], 8).astype(np.float32)
    image = pv.ImageData(dimensions=box.shape, spacing=frog.spacing)
    image["inside"] = box.ravel(order="F")
    surface = image.gaussian_smooth(std_dev=2.0).contour([0.5], method="flying_edges").connectivity("largest")
    surface = surface.triangulate().clean()
    return sm.TriangleMesh(np.asarray(surface.points, dtype=float), surface.regular_faces).oriented()


def random_rotation(rng):
    """Return a uniformly distributed random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def angle(one, other):
    """Return the angle between two rotations in degrees."""
    return float(np.degrees(np.arccos(np.clip((np.trace(one @ other.T) - 1) / 2, -1, 1))))


def show(out):
    """Draw the scan and the whole, before and after registration."""
    found = out["registration"]
    return sm.plot.overlay(out["scan"], out["whole"], found.T_target_source, view="yx")


def show_landscape(out):
    """Plot the similarity of the two signatures over all rotations."""
    return sm.plot.landscape(*out["signatures"], found=out["matches"])


if __name__ == "__main__":
    show(main()).show()
