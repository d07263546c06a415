"""Lines of meshes that CAD programs made: the sharp edges that their triangles show."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from tests.surface.features.scoring import lengths, networks, paths, share_near

pytestmark = pytest.mark.data


def sharp_edges(mesh, degrees):
    """The edges (k, 2, 3) between triangles at more than an angle, and the median length of all edges."""
    body = mesh.to_pyvista().compute_normals(cell_normals=True, point_normals=False, consistent_normals=False)
    normals, faces = np.asarray(body.cell_data["Normals"], float), np.asarray(mesh.faces, np.int64)
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    two = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    one, other = order[two], order[two + 1]
    bent = np.einsum("ij,ij->i", normals[one // 3], normals[other // 3]) < np.cos(np.radians(degrees))
    edges = mesh.vertices[ends[one]]
    return edges[bent], float(np.median(lengths(edges)))


@pytest.mark.parametrize(
    ("name", "recall", "precision", "loose"),
    [
        ("fandisk.off", 0.97, 0.97, 4),
        ("anchor.off", 0.97, 0.97, 0),
        ("coupling.off", 0.85, 0.97, 6),
        ("featuretype.stl", 0.97, 0.97, 0),
        ("fixed_top.ply", 0.97, 0.97, 0),
        ("tray_bottom.stl", 0.85, 0.85, 2),
    ],
)
def test_sharp_edges_are_lines_that_close(data_folder, name, recall, precision, loose):
    network = sm.feature_lines(data_folder / name)
    sharp, edge = sharp_edges(network.mesh, 30)
    lines = paths(network)
    segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    assert share_near(sharp, segments, 0.75 * edge) > recall
    bent = sharp_edges(network.mesh, 10)[0]
    assert share_near(segments, bent, 0.75 * edge) > precision
    assert networks(lines, 1e-9 * network.mesh.diagonal)[1] <= loose
    assert 0.85 < lengths(segments).sum() / lengths(sharp).sum() < 1.25  # softer ones are not in `sharp`


def test_the_fading_crease_of_the_fandisk_ends_inside_a_zone(data_folder):
    zones = sm.zones(data_folder / "fandisk.off")
    assert any(one == other for _, (one, other) in zones.boundaries)
