"""How close reconstructions come to a known truth: noisy unoriented points, and 0/1 label volumes, beside peers.

Run: python tests/benchmarks/bench_quality.py [points|masks] [--store]; five minutes. Peers that are not installed are
said and left out.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks.figures import Figures, installed

PROTOCOL = """Torus of radii 1 and 0.35, ellipsoid of half axes 1, 0.71, 0.5. Points: 20,000 without normals, Gaussian
noise in % of the diagonal, three seeds; 12,000 vertices. Masks: 0/1, 64 or 128 samples along the longest axis of a box
a tenth larger than the shape, three placements within a voxel; 20,000 vertices. Mean distance of 40,000 points of the
surface to the truth, in % of the diagonal, and mean error of the normals of its triangles. Peers of points get normals
by Open3D, of 20 neighbors, oriented along a minimum spanning tree; Poisson has depth 8, or of 5 to 8 the one that turns
out best; APSS a filter scale of 4. The peer of masks: VTK's flying edges, then windowed sinc, 30 passes, band 0.02."""
PEERS = ("open3d", "pymeshlab", "compas_cgal")
SEEDS = (1, 2, 3)


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


def mask(truth, size, shift):
    """Return a 0/1 volume with `size` samples along the longest axis of a box a little larger than the shape.

    The grid is shifted by parts of a sample.
    """
    spacing = 2 * truth.half.max() * 1.1 / (size - 1)
    counts = np.ceil(2 * truth.half * 1.1 / spacing).astype(int) + 1
    origin = spacing * (shift - 0.5 * (counts - 1))
    axes = [o + spacing * np.arange(n) for o, n in zip(origin, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = truth.contains(grid).reshape(counts)
    return sm.Volume(inside.astype(np.uint8), spacing=spacing, origin=origin)


def windowed_sinc(volume):
    """Return the triangles of the peer of masks."""
    import pyvista as pv

    image = pv.ImageData(dimensions=volume.shape, spacing=tuple(volume.spacing), origin=tuple(volume.origin))
    image["mask"] = volume.values.astype(np.float32).ravel(order="F")
    surface = image.contour([0.5], scalars="mask", method="flying_edges").smooth_taubin(n_iter=30, pass_band=0.02)
    return surface.points, surface.regular_faces


def poisson(oriented, depth):
    """Return the triangles of Open3D's screened Poisson reconstruction."""
    import open3d as o3d

    found, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(oriented, depth=depth)
    return np.asarray(found.vertices), np.asarray(found.triangles)


def apss(oriented):
    """Return the triangles of PyMeshLab's algebraic point set surfaces, by marching cubes."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=np.asarray(oriented.points), v_normals_matrix=oriented.normals))
    meshes.generate_marching_cubes_apss(filterscale=4)
    found = meshes.current_mesh()
    return found.vertex_matrix(), found.face_matrix()


def poisson_of_cgal(oriented):
    """Return the triangles of CGAL's Poisson reconstruction."""
    from compas_cgal.reconstruction import poisson_surface_reconstruction

    return poisson_surface_reconstruction(np.asarray(oriented.points), np.asarray(oriented.normals), sm_radius=5.0)


def of_peers(points, libraries):
    """Yield name and triangles of each peer of points."""
    if "open3d" not in libraries:
        return
    o3d = libraries["open3d"]
    oriented = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    oriented.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
    oriented.orient_normals_consistent_tangent_plane(20)
    height = np.asarray(oriented.points)[:, 2]
    if np.asarray(oriented.normals)[height.argmax(), 2] < 0:
        oriented.normals = o3d.utility.Vector3dVector(-np.asarray(oriented.normals))
    for depth in (8, 7, 6, 5):
        yield f"Open3D Poisson, depth {depth}", poisson(oriented, depth)
    if "pymeshlab" in libraries:
        yield "PyMeshLab APSS", apss(oriented)
    if "compas_cgal" in libraries:
        yield "CGAL Poisson", poisson_of_cgal(oriented)


def of_triangles(vertices, faces, truth, rng):
    """Return the quality of a peer's triangles, turned outward if they face inward."""
    triangles = sm.TriangleMesh(np.array(vertices, dtype=float), np.array(faces, dtype=np.int64))
    found = SimpleNamespace(vertices=triangles.vertices, genus="", n_holes="", triangulated=lambda method: triangles)
    out = quality(found, truth, rng)
    return {**out, "normals deg": min(out["normals deg"], 180 - out["normals deg"])}


class Rows(dict):
    """Values of every figure, over seeds."""

    def add(self, case, who, found):
        """Keep distance and error of normals."""
        self.setdefault((case, who), []).append((found["surface %"], found["normals deg"]))

    def tell(self, figures):
        """Print and keep the figures."""
        for (case, who), values in self.items():
            for column, (what, unit) in enumerate((("distance", "% of the diagonal"), ("normals", "degrees"))):
                figures.add(f"{case}, {who}, {what}", [each[column] for each in values], unit)


def of_points(figures, libraries):
    """Tell the figures of noisy points."""
    truth, rows = Torus(), Rows()
    diagonal = 2 * np.linalg.norm(truth.half)
    for noise in (0.2, 1.0):
        case = f"torus points, {noise:g} % noise"
        for seed in SEEDS:
            rng = np.random.default_rng(seed)
            points = truth.sampled(20_000, rng)
            points = points + rng.normal(scale=noise / 100 * diagonal, size=points.shape)
            rows.add(case, "simplexmesh", quality(sm.reconstruct(points, vertices=12_000).mesh, truth, rng))
            depths = []
            for who, triangles in of_peers(points, libraries):
                found = of_triangles(*triangles, truth, rng)
                rows.add(case, who, found)
                if "depth" in who:
                    depths.append(found)
            if depths:
                best = min(depths, key=lambda found: found["surface %"])
                rows.add(case, "Open3D Poisson, best depth", best)
    rows.tell(figures)


def of_masks(figures):
    """Tell the figures of masks."""
    rows = Rows()
    for truth in (Torus(), Ellipsoid()):
        for size in (64, 128):
            case = f"{type(truth).__name__.lower()} mask, {size} samples"
            for seed in SEEDS:
                rng = np.random.default_rng(seed)
                volume = mask(truth, size, rng.uniform(-0.5, 0.5, 3))
                rows.add(
                    case, "simplexmesh", quality(sm.reconstruct(volume, label=1, vertices=20_000).mesh, truth, rng)
                )
                rows.add(case, "windowed sinc", of_triangles(*windowed_sinc(volume), truth, rng))
    rows.tell(figures)


def main():
    """Tell the figures named, by default all."""
    warnings.simplefilter("ignore")
    libraries = installed(*PEERS)
    figures = Figures("quality", PROTOCOL, list(libraries))
    if "masks" not in sys.argv:
        of_points(figures, libraries)
    if "points" not in sys.argv:
        of_masks(figures)
    figures.keep()


if __name__ == "__main__":
    main()
