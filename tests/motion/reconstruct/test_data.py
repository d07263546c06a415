"""Reconstructions of the real volumes, scans and meshes in the data folder meet their bounds of error."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance
from tests.nightly.marks import nightly

pytestmark = pytest.mark.data

CLOSED = {
    "ellipsoid.off": 0,
    "torus.stl": 1,
    "knot1.off": 1,
    "eight.off": 2,
    "elephant.off": 3,
    "spot.obj": 0,
}


def diagonal(points):
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def points_of(path, seed):
    """The vertices and area-uniform samples of a mesh, 20,000 in all, without normals."""
    surface = sm.read_triangles(path)
    samples = surface.sampled(20_000 - len(surface.vertices), rng=seed).points
    return np.concatenate([surface.vertices, samples])


def assert_sound(model, genus):
    assert model.mesh.genus == genus
    assert model.mesh.n_holes == 0
    assert model.mesh.n_components == 1
    report = model.mesh.check(self_intersections=True)
    assert report.ok, str(report)
    assert model.tangled == 0
    assert model.mesh.volume > 0


@pytest.mark.nightly
@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")  # spot's texture seams are welded
def test_closed_shapes_from_points_without_normals(data_folder, name):
    points = points_of(data_folder / name, seed=3)
    model = sm.reconstruct(points, vertices=4000)
    assert_sound(model, CLOSED[name])
    assert model.distance.data_to_mesh.rms < 0.0025 * diagonal(points)
    assert abs(model.mesh.n_vertices - 4000) <= 400


def test_a_scanned_figurine(data_folder):
    model = sm.reconstruct(data_folder / "kitten.xyz", vertices=4000)
    assert_sound(model, 1)
    assert model.distance.data_to_mesh.rms < 0.0025 * diagonal(sm.read(data_folder / "kitten.xyz").points)


@pytest.mark.parametrize(
    ("name", "level", "vertices"),
    [
        *nightly(("head_ct.mhd", 500, 3000), ("head_ct.mhd", 500, 12_000), ("tooth.nhdr", 655, 4000)),
        ("head_mr.mhd", 8, 3000),
    ],
)
@pytest.mark.filterwarnings("ignore:filled cavities")  # the pulp of the tooth
def test_volumes_are_met_to_a_quarter_of_a_voxel(data_folder, name, level, vertices):
    volume = sm.read_volume(data_folder / name)
    model = sm.reconstruct(volume, level=level, vertices=vertices, tunnels=40.0 if vertices == 12_000 else None)  # nose
    assert_sound(model, 0)
    assert model.distance.mesh_to_data.rms < 0.25 * volume.spacing.min()
    low, high = volume.bounds
    assert (model.mesh.vertices > low - volume.spacing.max()).all()
    assert (model.mesh.vertices < high + volume.spacing.max()).all()
    at = np.rint(volume.to_index(model.mesh.vertices - 2 * volume.spacing.max() * model.mesh.normals)).astype(int)
    at = np.clip(at, 0, np.array(volume.shape) - 1)
    assert (volume.values[tuple(at.T)] > level).mean() > 0.85  # two voxels inwards is inside


@pytest.mark.parametrize(
    ("name", "level", "vertices"),
    [("head_ct.mhd", 500, 3000), *nightly(("fandisk.off", None, 2000), ("lion_head.off", None, 3000))],
)
@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")  # the lion's head is open
def test_vertices_are_spent_where_the_data_asks_for_them(data_folder, name, level, vertices):
    data = sm.read(data_folder / name)
    models = [
        sm.reconstruct(data, level=level, vertices=vertices, placement=placement, creases="none")
        for placement in ("even", "adaptive")
    ]
    points = as_input(data, level=level).points[::3]
    closed, away = np.zeros(len(points), bool), []
    for model in models:
        surface = model.mesh.triangulated(method="fan")
        away.append(surface_distance(points, surface.vertices, surface.faces))
        if level is not None:  # walls of airways that a model closes over
            closed |= (away[-1] > 4) & inside_surface(points, surface.vertices, surface.faces)
    assert closed.mean() < 0.25
    even, adaptive = (np.sqrt((distance[~closed] ** 2).mean()) for distance in away)
    assert models[1].mesh.n_vertices <= models[0].mesh.n_vertices
    assert adaptive < 0.75 * even
    sizes = models[1].mesh.connectivity.face_sizes
    assert len(models[1].topology.exceptions) < 0.01 * len(sizes)


@pytest.mark.nightly
def test_six_range_scans_become_one_body(data_folder):
    scans = [data_folder / f"bun{angle}.ply" for angle in ("000", "045", "090", "180", "270", "315")]
    model = sm.reconstruct(scans, poses=data_folder / "bun.conf", vertices=4000, holes="none")  # no scan saw the bottom
    assert_sound(model, 0)
    size = diagonal(model.mesh.vertices)
    assert size == pytest.approx(0.25, abs=0.01)  # the bunny in meters
    assert model.distance.data_to_mesh.rms < 0.0025 * size


def test_a_vase_is_hollow_and_open(data_folder):
    model = sm.reconstruct(data_folder / "vase_ct.vti", level=100, vertices=4000)
    assert model.mesh.genus == 1  # as marching cubes find
    report = model.mesh.check(self_intersections=True)
    assert report.ok, str(report)
    assert model.distance.mesh_to_data.p95 < 0.25
