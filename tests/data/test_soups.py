"""Triangles that share no vertices, as in STL files: measures of them warn and advise to merge the vertices."""

import warnings

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.surface.curvature.estimate import METHODS

BALL = sm.sphere(8).triangulated("dual")
CORNERS = BALL.vertices[BALL.faces].reshape(-1, 3)
SOUP = sm.TriangleMesh(CORNERS, np.arange(len(CORNERS)).reshape(-1, 3))
ADVICE = r"; the triangles share no vertices, merge them with TriangleMesh\(vertices, faces\)\.welded\(\)$"


@pytest.mark.parametrize(
    "measure",
    [
        *(lambda surface, method=method: sm.curvature(surface, method) for method in sorted(METHODS)),
        sm.vertex_normals,
        lambda surface: sm.vertex_normals(surface, "quadric"),
        sm.saliency,
        sm.salient_points,
        sm.hk_classes,
    ],
    ids=[*sorted(METHODS), "normals", "quadric normals", "saliency", "salient_points", "hk_classes"],
)
def test_soups_are_reported(measure):
    with pytest.warns(sm.SimplexMeshWarning, match=ADVICE) as caught:
        measure(SOUP)
    assert len(caught) == 1


def test_the_advice_helps():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = sm.curvature(SOUP.welded(report=False), "sine")
    assert found.mean.mean() == pytest.approx(sm.curvature(BALL, "sine").mean.mean(), rel=1e-9)


def test_a_seam_is_reported_with_its_number_of_vertices():
    half = BALL.vertices[BALL.faces].mean(axis=1)[:, 2] > 0
    faces = np.where(half[:, None], BALL.faces, BALL.faces + BALL.n_vertices)  # two halves, each of its own vertices
    used, faces = np.unique(faces, return_inverse=True)
    seam = sm.TriangleMesh(np.concatenate([BALL.vertices, BALL.vertices])[used], faces.reshape(-1, 3))
    both = len(used) - BALL.n_vertices
    with pytest.warns(match=f"; {2 * both} of these lie where other vertices do, merge them with"):
        sm.curvature(seam, "discrete")


def test_open_surfaces_without_duplicates_give_no_advice():
    square = sm.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.warns(match="ring of faces$"):
        sm.curvature(square, "discrete")
