"""Signatures of real objects: any pose, any sampling, some noise."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from tests.recognition import reference as reference

FILES = ("spot.obj", "lion_head.off", "elephant.off", "mannequin.off", "kitten.xyz")


def sampled(data, rng, count=20_000, noise=0.005):
    """New points on the surface, or some of those there are, with noise in shares of the diagonal."""
    if isinstance(data, sm.TriangleMesh):
        points = data.sampled(count, rng=rng).points
    else:
        points = data.points[rng.permutation(len(data.points))[: int(0.9 * len(data.points))]]
    return points + noise * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape)


@pytest.mark.filterwarnings("ignore:.* of the data is far from the sphere")  # the legs of the elephant
@pytest.mark.nightly
@pytest.mark.parametrize("name", FILES)
def test_turned_and_sampled_anew_they_are_found_to_a_degree(data_folder, name):
    data = sm.read(data_folder / name)
    rng = np.random.default_rng(7)
    one, R = sm.sai(sampled(data, rng)), reference.random_rotation(rng)
    first, second, *_ = sm.match(one, sm.sai(sampled(data, rng) @ R.T))
    assert reference.angle(first.T_target_source[:3, :3], R) < 1.0
    assert first.distance < 0.8 * second.distance


@pytest.mark.nightly
def test_scans_fused_and_one_alone(data_folder):
    views = [data_folder / f"bun{angle:03d}.ply" for angle in (0, 45, 90, 180, 270, 315)]
    fused = sm.sai(views, poses=data_folder / "bun.conf")
    alone = sm.sai(views[0])
    assert fused.visible_fraction > 0.8
    assert 0.15 < alone.visible_fraction < 0.7
    assert alone.visible_area < 0.7 * fused.visible_area


@pytest.mark.nightly
def test_a_surface_with_handles_and_a_shell(data_folder):
    elephant, lion = (sm.sai(data_folder / name, 7) for name in ("elephant.off", "lion_head.off"))
    assert elephant.mesh.genus == 0
    assert lion.hidden.any()
    assert lion.visible_fraction > 0.8


def test_views_whose_lightest_phases_oscillate_have_a_signature(data_folder):
    """A film that no data holds left the box in three of nine views."""
    surface = sm.read_triangles(data_folder / "mannequin.off")
    seen = surface.vertex_normals[:, 1] > 0.2
    view = sm.PointCloud(surface.vertices[seen], surface.vertex_normals[seen])
    with pytest.warns(sm.SimplexMeshWarning, match="^few points: all within 4.* counts as seen"):
        found = sm.sai(view, frequency=9)
    assert np.quantile(found.mesh.vertices, [0, 1], axis=0) == pytest.approx(view.bounds, abs=4)
    assert sm.sai(view, frequency=9, tolerance=1.0).visible_fraction < found.visible_fraction - 0.1
