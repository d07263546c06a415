"""How close reconstructions come to a known truth: noisy unoriented points, and 0/1 label volumes.

The bars are the best of other libraries on the same protocol: 20,000 points, noise in % of the bounding-box diagonal;
masks sampled at voxel centres. Run: python tests/benchmarks/bench_quality.py
"""

from __future__ import annotations

import time
import warnings

import numpy as np

import simplexmesh as sm


class Torus:
    """A torus about z, R = 1, r = 0.35."""

    ring, tube = 1.0, 0.35
    genus = 1
    half = np.array([1.35, 1.35, 0.35])

    def signed(self, points):
        """Return the signed distance, positive outside."""
        around = np.hypot(points[:, 0], points[:, 1])
        return np.hypot(around - self.ring, points[:, 2]) - self.tube

    def contains(self, points):
        """Return whether points are inside."""
        return self.signed(points) < 0

    def normals(self, points):
        """Return the outward unit normals of the surface nearest to the points."""
        around = np.hypot(points[:, 0], points[:, 1])[:, None]
        core = np.column_stack([points[:, :2] / around * self.ring, np.zeros(len(points))])
        out = points - core
        return out / np.linalg.norm(out, axis=1)[:, None]

    def sampled(self, count, rng):
        """Return area-uniform points."""
        u, v = rng.uniform(0, 2 * np.pi, (2, 4 * count))
        keep = rng.uniform(0, self.ring + self.tube, 4 * count) < self.ring + self.tube * np.cos(v)
        u, v = u[keep][:count], v[keep][:count]
        around = self.ring + self.tube * np.cos(v)
        return np.column_stack([around * np.cos(u), around * np.sin(u), self.tube * np.sin(v)])


class Ellipsoid:
    """Semi-axes 1, sqrt(1/2), 1/2."""

    genus = 0
    half = np.array([1.0, np.sqrt(0.5), 0.5])

    def _foot(self, points):
        """Return the closest points: Newton on the multiplier t of (half^2 p) / (t + half^2)."""
        squares = self.half**2
        t = (np.linalg.norm(points / self.half, axis=1) - 1) * squares.min()
        for _ in range(50):
            ratio = self.half * points / (t[:, None] + squares)
            value = (ratio**2).sum(axis=1) - 1
            slope = -2 * (ratio**2 / (t[:, None] + squares)).sum(axis=1)
            t = t - value / slope
        return squares * points / (t[:, None] + squares)

    def signed(self, points):
        """Return the signed distance, positive outside."""
        away = np.linalg.norm(points - self._foot(points), axis=1)
        return np.copysign(away, np.linalg.norm(points / self.half, axis=1) - 1)

    def contains(self, points):
        """Return whether points are inside."""
        return np.linalg.norm(points / self.half, axis=1) < 1

    def normals(self, points):
        """Return the outward unit normals at the closest points."""
        out = self._foot(points) / self.half**2
        return out / np.linalg.norm(out, axis=1)[:, None]

    def sampled(self, count, rng):
        """Return area-uniform points."""
        unit = rng.normal(size=(8 * count, 3))
        unit /= np.linalg.norm(unit, axis=1)[:, None]
        density = np.linalg.norm(unit / self.half, axis=1)
        keep = rng.uniform(0, density.max(), len(unit)) < density
        return (unit * self.half)[keep][:count]


def surface_samples(mesh, count, rng):
    """Return area-uniform points of the fan triangulation, and the unit normals there."""
    surface = mesh.triangulated(method="fan")
    corners = surface.vertices[surface.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(cross, axis=1)
    rows = rng.choice(len(areas), count, p=areas / areas.sum())
    a, b = np.sqrt(rng.uniform(size=count)), rng.uniform(size=count)
    weights = np.stack([1 - a, a * (1 - b), a * b], axis=1)
    return (weights[:, :, None] * corners[rows]).sum(axis=1), cross[rows] / areas[rows, None]


def quality(mesh, truth, rng):
    """Return mean distance of vertices and of the surface in % of the diagonal, mean normal error in degrees."""
    diagonal = 2 * np.linalg.norm(truth.half)
    points, normals = surface_samples(mesh, 40_000, rng)
    facing = np.clip((normals * truth.normals(points)).sum(axis=1), -1, 1)
    return {
        "vertices %": 100 * np.abs(truth.signed(np.array(mesh.vertices))).mean() / diagonal,
        "surface %": 100 * np.abs(truth.signed(points)).mean() / diagonal,
        "normals deg": np.degrees(np.arccos(facing)).mean(),
        "genus": mesh.genus,
        "holes": mesh.n_holes,
    }


def mask(truth, size):
    """Return a 0/1 volume with `size` samples along the longest axis of a box a little larger than the shape."""
    spacing = 2 * truth.half.max() * 1.1 / (size - 1)
    counts = np.ceil(2 * truth.half * 1.1 / spacing).astype(int) + 1
    origin = -0.5 * spacing * (counts - 1)
    axes = [o + spacing * np.arange(n) for o, n in zip(origin, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = truth.contains(grid).reshape(counts)
    return sm.Volume(inside.astype(np.uint8), spacing=spacing, origin=origin)


def windowed_sinc(volume, truth, rng):
    """Return the same numbers for the peer: VTK flying edges, then windowed sinc smoothing (30 passes, band 0.02)."""
    import pyvista as pv

    image = pv.ImageData(dimensions=volume.shape, spacing=tuple(volume.spacing), origin=tuple(volume.origin))
    image["mask"] = volume.values.astype(np.float32).ravel(order="F")
    start = time.perf_counter()
    surface = image.contour([0.5], scalars="mask", method="flying_edges").smooth_taubin(n_iter=30, pass_band=0.02)
    seconds = time.perf_counter() - start
    triangles = sm.TriangleMesh(np.array(surface.points, dtype=float), surface.regular_faces)

    class Peer:
        vertices, genus, n_holes = triangles.vertices, "", ""

        @staticmethod
        def triangulated(method):
            return triangles

    out = quality(Peer, truth, rng)
    if out["normals deg"] > 90:
        out["normals deg"] = 180 - out["normals deg"]
    return {**out, "seconds": seconds}


def show(name, numbers):
    """Print one row."""
    cells = "  ".join(
        f"{key} {value:.3f}" if isinstance(value, float) else f"{key} {value}" for key, value in numbers.items()
    )
    print(f"{name:42s} {cells}")


def main():
    """Print the two tables."""
    warnings.simplefilter("ignore")
    for truth in (Torus(), Ellipsoid()):
        name = type(truth).__name__.lower()
        diagonal = 2 * np.linalg.norm(truth.half)
        for noise in (0.0, 0.2, 1.0):
            for vertices in (4000, 12_000):
                rng = np.random.default_rng(1)
                points = truth.sampled(20_000, rng)
                points = points + rng.normal(scale=noise / 100 * diagonal, size=points.shape) if noise else points
                start = time.perf_counter()
                model = sm.reconstruct(points, vertices=vertices)
                seconds = time.perf_counter() - start
                show(
                    f"{name} points, noise {noise} %, {vertices} vertices",
                    {**quality(model.mesh, truth, rng), "seconds": seconds},
                )
    for truth in (Torus(), Ellipsoid()):
        name = type(truth).__name__.lower()
        for size in (64, 128):
            rng = np.random.default_rng(2)
            volume = mask(truth, size)
            start = time.perf_counter()
            model = sm.reconstruct(volume, label=1, vertices=20_000)
            seconds = time.perf_counter() - start
            show(f"{name} mask {size}, simplexmesh", {**quality(model.mesh, truth, rng), "seconds": seconds})
            show(f"{name} mask {size}, windowed sinc", windowed_sinc(volume, truth, rng))


if __name__ == "__main__":
    main()
