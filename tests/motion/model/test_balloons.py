"""Models that fold on their way do not balloon: they end on the data, or stop with a sentence."""

from __future__ import annotations

import warnings
from contextlib import suppress
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.model.state import MARGIN, RINGS, Release, mean_edge
from tests.motion.meshes import Everywhere, evolved

BALL = sm.sphere(6)


@cache
def torus(kind):
    """A target of a kind, of a torus."""
    if kind == "union":
        return sm.targets.Union([torus("triangles"), torus("isosurface")])
    if kind in ("triangles", "points"):
        surface = sm.torus(48, 18).triangulated()
        return sm.targets.Triangles(surface) if kind == "triangles" else sm.targets.Points(surface.vertices)
    x, y, z = np.mgrid[-16:17, -16:17, -8:9] * 0.1
    field, grid = 0.35 - np.hypot(np.hypot(x, y) - 1.0, z), {"spacing": (0.1,) * 3, "origin": (-1.6, -1.6, -0.8)}
    if kind == "labels":
        return sm.targets.LabelSurface(sm.Volume((field > 0).astype(np.uint8), **grid), 1)
    return sm.targets.Isosurface(sm.Volume(field, **grid), 0.0)


def box(start, target, share=MARGIN):
    """Return the box around a start and its data, grown by a share of its diagonal."""
    low, high = np.minimum(start.bounds[0], target.bounds[0]), np.maximum(start.bounds[1], target.bounds[1])
    edge = 2 * mean_edge(start) if share else 0.0
    margin = max(share * np.linalg.norm(high - low), edge)
    return low - margin, high + margin


def per_vertex(low, high):
    """Return a strategy of one number or one for each vertex, between two limits."""
    number = st.floats(low, high)
    return number | st.tuples(number, number).map(lambda ends: np.linspace(*ends, BALL.n_vertices))


@given(
    target=st.sampled_from(["isosurface", "labels", "points", "triangles", "union"]),
    radius=st.floats(0.05, 2.5),
    center=st.tuples(*[st.floats(-1.5, 1.5)] * 3),
    constraint=st.sampled_from(["mean_curvature", "angle", "orientation", "free"]),
    rigidity=st.integers(0, 30),
    reach=st.floats(0.05, 10.0),
    alpha=per_vertex(0.0, 0.5),
    beta=per_vertex(0.0, 1.0),
    damping=per_vertex(0.001, 1.0),
)
@settings(max_examples=settings.default.max_examples // 3)
def test_no_vertex_leaves_the_start_and_the_data(target, radius, center, **options):
    start, target = BALL.moved(center + radius * BALL.vertices), torus(target)
    low, high = box(start, target)
    model = sm.DeformableModel(start, target, **options)
    with suppress(sm.DivergedError):
        for _ in model.run(40, warnings=False):
            assert ((model.mesh.vertices >= low) & (model.mesh.vertices <= high)).all()
    assert ((model.mesh.vertices >= low) & (model.mesh.vertices <= high)).all()


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore:.* no data within reach")
@pytest.mark.parametrize("options", [{}, {"rigidity": 6}, {"reach": 5.0}], ids=str)
def test_a_sphere_around_a_body_with_limbs_lands_on_it(data_folder, options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sm.SimplexMeshWarning)  # texture seams are welded
        target = sm.targets.Triangles(data_folder / "spot.obj")
    start = sm.sphere(12, radius=1.2)
    model = sm.DeformableModel(start, target, **options)
    with pytest.warns(sm.SimplexMeshWarning, match="vertices are folded, or off the data beside folds"):
        *_, last = model.run(150)
    distance = target.closest(model.mesh.vertices)[0]
    assert 0.0 < last.released < 0.3
    assert distance.mean() < 0.02 * np.linalg.norm(np.ptp(target.bounds, axis=0))
    low, high = box(start, target, 0.0)
    assert ((model.mesh.vertices >= low) & (model.mesh.vertices <= high)).all()


def test_vertices_without_data_are_told_beside_folds():
    """Most of a ball that is beside the data."""
    target = sm.targets.Triangles(sm.sphere(8).triangulated())
    with pytest.warns(sm.SimplexMeshWarning) as told:
        list(sm.DeformableModel(sm.sphere(12, radius=1.0, center=(1.5, 0, 0)), target).run(300))
    assert len(told) == 2
    assert "folded" in str(told[0].message)
    assert float(str(told[1].message).split("%")[0]) > 50


def test_where_nothing_folds_nothing_is_released():
    states = list(sm.DeformableModel(BALL, Everywhere(0.05)).run(20))
    assert [state.released for state in states] == [0.0] * 20


def test_a_fold_releases_the_vertices_without_data_around_it_until_it_heals():
    normals, gaps = BALL.vertices.copy(), np.full(BALL.n_vertices, np.nan)
    normals[0] *= -1
    gaps[BALL.vertices[:, 2] < 0] = 0.0
    held, release = ~np.isnan(gaps), Release(BALL.n_vertices)
    for rings in range(40):
        release.update(normals, BALL.neighbors, gaps, np.zeros(BALL.n_vertices, bool))
        near = np.arange(BALL.n_vertices) == 0
        for _ in range(min(rings, RINGS - 1)):
            near |= near[BALL.neighbors].any(axis=1) & ~held
        assert_array_equal(release.mask, near)
    normals[0] *= -1
    assert release.mask.sum() > 50
    for _ in range(RINGS):
        release.update(normals, BALL.neighbors, gaps, np.zeros(BALL.n_vertices, bool))
    assert not release.mask.any()


def test_a_model_without_data_in_reach_stays_and_says_so():
    target = sm.targets.Triangles(BALL.triangulated())
    far = BALL.moved(BALL.vertices + np.array([5.0, 0, 0]))
    model = sm.DeformableModel(far, target, reach=1.0)
    with pytest.warns(sm.SimplexMeshWarning, match=r"100% of the vertices have no data within reach \(1\)"):
        *_, last = model.run(5)
    assert np.abs(np.linalg.norm(model.mesh.vertices - [5.0, 0, 0], axis=1) - 1).max() < 0.01
    list(model.run(5, warnings=False))
    assert last.released == 0.0


@pytest.mark.parametrize(("end", "told"), [(0.8, True), (0.999, False)])
def test_a_film_over_a_hole_of_the_data_is_told_with_its_distance_from_what_the_others_reach(end, told):
    class Below(Everywhere):
        def gap(self, vertices, normals, reach):
            return np.where(vertices[:, 2] < end, 0.0, np.nan)

    model = sm.DeformableModel(sm.sphere(14), Below(0.0), alpha=0.0)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        list(model.run(2))
    z = model.mesh.vertices[:, 2]
    apex = model.mesh.vertices[z.argmax()]
    away = np.linalg.norm(model.mesh.vertices[z < end] - apex, axis=1).min()
    assert [str(each.message) for each in said] == [
        f"{100 * (z >= end).mean():.3g}% of the vertices have no data within reach ({model.reach:.3g}) along their "
        f"normals, and are up to {away:.3g} from what the others reach"
    ] * told


def test_a_vertex_that_leaves_start_and_data_ends_the_run_unless_a_force_moves_it():
    class Bounded(Everywhere):
        bounds = np.array([[-1.0] * 3, [1.0] * 3])

    with pytest.raises(sm.DivergedError, match=r"vertex \d+ diverged at iteration \d+: it left the box") as caught:
        list(sm.DeformableModel(BALL, Bounded(0.1)).run(100))
    assert np.abs(caught.value.mesh.vertices).max() <= box(BALL, Bounded)[1].max()
    out = evolved(BALL, 100, Bounded(0.1), forces=lambda frame: 0.0 * frame.normals)
    assert np.abs(out.vertices).max() > 1.5
    assert np.abs(evolved(BALL, 100, sm.targets.Union([Bounded(0.1), Everywhere(0.1)])).vertices).max() > 1.5
