"""Triangles that disagree on which side is outward: counted, and told, since signs near them mean nothing."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.orientation._kernels_consistency import clashing_edges
from simplexmesh.surface.curvature.estimate import METHODS
from simplexmesh.surface.sampled_surface import SampledSurface
from tests.surface import reference_normals

BALL = sm.sphere(4).triangulated("dual")
TOLD = r"^triangles disagree on which side is outward across {}, so that .* orient them with TriangleMesh"


def flipped(*which):
    faces = BALL.faces.copy()
    faces[list(which)] = faces[list(which), ::-1]
    return sm.TriangleMesh(BALL.vertices, faces)


def told(call):
    """What is said of triangles that disagree."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [
        str(w.message) for w in caught if issubclass(w.category, SimplexMeshWarning) and "outward" in str(w.message)
    ]


@given(st.lists(st.permutations(range(6)).map(lambda corners: corners[:3]), min_size=1, max_size=12))
def test_kernel_is_its_twin(faces):
    samples = SampledSurface(np.zeros((6, 3)), np.array(faces, np.int64))
    assert clashing_edges(*samples.wedges) == reference_normals.clashing_edges(faces)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_tells(method):
    (said,) = told(lambda: sm.curvature(flipped(0), method))
    assert "across 3 edges" in said
    assert told(lambda: sm.curvature(BALL, method)) == []


@pytest.mark.parametrize("method", ["area", "plane", "adaptive"])
def test_normals_tell(method):
    with pytest.warns(SimplexMeshWarning, match=TOLD.format("3 edges")):
        sm.vertex_normals(flipped(0), method)


def test_what_is_told_mends_it():
    mixed = flipped(*range(0, len(BALL.faces), 3))
    with pytest.warns(SimplexMeshWarning, match="^flipped"):
        mended = mixed.oriented()
    assert told(lambda: sm.curvature(mended, "sine")) == []
    assert (sm.curvature(mended, "sine").mean > 0).all()


def test_normals_of_the_callers_say_which_side_is_outward():
    assert told(lambda: sm.curvature(flipped(0), "sine", normals=BALL.vertices)) == []


def test_a_one_sided_surface_is_said_to_be_one():
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    out = 1 + 0.3 * np.array([[-1], [1]]) * np.cos(turn / 2)
    band = np.stack([out * np.cos(turn), out * np.sin(turn), 0.3 * np.array([[-1], [1]]) * np.sin(turn / 2)], axis=2)
    one, two = np.arange(40), np.arange(40, 80)
    after, beyond = np.append(one[1:], 40), np.append(two[1:], 0)  # the last meets the first with its sides exchanged
    faces = np.concatenate([np.stack([one, after, two], axis=1), np.stack([after, beyond, two], axis=1)])
    strip = sm.TriangleMesh(band.reshape(-1, 3), faces)
    with pytest.raises(sm.TopologyError):
        strip.oriented()
    (said,) = told(lambda: sm.curvature(strip, "sine"))
    assert said.endswith("the surface is one-sided, and has no right ones everywhere")


def test_one_edge_is_one_edge():
    pair = sm.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 2, 3]])
    assert "across 1 edge," in told(lambda: sm.vertex_normals(pair, "area"))[0]


@pytest.mark.parametrize("extra", [[0], [0, 1, 2]])
def test_copies_of_triangles_and_wings_do_not_disagree(extra):
    copied = sm.TriangleMesh(BALL.vertices, np.concatenate([BALL.faces, BALL.faces[extra]]))
    assert told(lambda: sm.curvature(copied, "sine")) == []
    a, b, _ = BALL.faces[0]
    winged = sm.TriangleMesh([*BALL.vertices, [0, 0, 0]], np.concatenate([BALL.faces, [[a, b, BALL.n_vertices]]]))
    assert told(lambda: sm.curvature(winged, "sine")) == []
