"""Safeguards, invalid input, interruption, and the states of a motion."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh._base.vectors import norm
from simplexmesh.motion.model.forces import pull
from tests.motion import reference as reference
from tests.motion.meshes import Everywhere, evolved, noisy_sphere, open_tube

# ---- safeguards


def test_the_height_asked_for_is_capped():
    flat = sm.sphere(3).moved(sm.sphere(3).vertices * [1, 1, 1e-3])
    size = reference.size_of_stars(flat.vertices, flat.neighbors)
    place = evolved(flat, 1, constraint="shape", reference=spiky(), alpha=0.5, metric=np.full((180, 3), 1 / 3))
    foot = flat.vertices[flat.neighbors].mean(axis=1)
    wanted = flat.vertices + 2 * (place.vertices - flat.vertices)
    short = norm(place.vertices - flat.vertices) < 0.499 * size  # the step was not limited
    assert (norm(wanted - foot)[short] <= size[short] * (1 + 1e-9)).all()
    assert short.any()


def spiky():
    """Return a sphere with every other vertex pulled far out: angles near pi."""
    ball = sm.sphere(3)
    return ball.moved(ball.vertices * np.where(np.arange(180) % 4 == 0, 4.0, 1.0)[:, None])


@pytest.mark.parametrize("huge", [1e3, 1e100])
def test_a_step_is_at_most_half_the_distance_to_the_neighbors(huge):
    ball = sm.sphere(4)
    size = reference.size_of_stars(ball.vertices, ball.neighbors)
    for options in ({"target": Everywhere(huge)}, {"forces": [lambda frame: huge * frame.normals]}):
        states = list((model := sm.DeformableModel(ball, **options)).run(1))
        moved = norm(model.mesh.vertices - ball.vertices)
        assert_allclose(moved, size / 2, rtol=1e-9)
        assert_allclose(states[0].move, moved.max(), rtol=1e-9)


def test_a_folded_vertex_is_not_pushed():
    ball = sm.sphere(4)
    v = np.array(ball.vertices)
    a, b, _ = ball.neighbors[0]
    v[[a, b]] = v[[b, a]]  # flips the plane of the neighbors of vertex 0
    folded = ball.moved(v)
    upright = (folded.normals * folded.normals[folded.neighbors].sum(axis=1)).sum(axis=1) > 0
    assert not upright[0]
    moved = norm(evolved(folded, 1, Everywhere(0.01), alpha=0.0, beta=1.0).vertices - v)
    assert_allclose(moved, np.where(upright, 0.01, 0.0), atol=1e-15)


class FailingFrom:
    """A target that answers with infinity from one iteration on."""

    def __init__(self, calls, value=np.inf):
        self.calls, self.value = calls, value

    def gap(self, vertices, normals, reach):
        self.calls -= 1
        return np.where((np.arange(len(vertices)) == 7) & (self.calls < 0), self.value, 0.01)


@pytest.mark.parametrize("mesh", [sm.sphere(4), open_tube()], ids=["closed", "open"])
@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e200])
def test_leaving_the_finite_numbers_stops_with_the_last_good_mesh(value, mesh):
    model = sm.DeformableModel(mesh, FailingFrom(3, value))
    good = evolved(mesh, 3, Everywhere(0.01))
    said = rf"vertex 7 diverged at iteration 4: FailingFrom.gap returned {value:g} there".replace("+", r"\+")
    with pytest.raises(sm.DivergedError, match=said) as caught:
        list(model.run(10))
    assert_array_equal(caught.value.mesh.vertices, good.vertices)
    assert_array_equal(model.mesh.vertices, good.vertices)
    assert model.iteration == 3
    model.target = Everywhere(0.01)  # without the cause, the model continues normally
    list(model.run(4))
    assert_array_equal(model.mesh.vertices, evolved(mesh, 7, Everywhere(0.01)).vertices)


def test_data_beyond_reach_does_not_draw():
    class Far:
        def gap(self, vertices, normals, reach):
            self.reach = reach
            return np.where(np.full(len(vertices), 0.5) <= reach, 0.5, np.nan)

    ball = sm.sphere(4, radius=1.0)
    far = Far()
    assert next(sm.DeformableModel(ball, far, reach=0.4).run(1)).reached == 0.0
    assert far.reach == 0.4
    state = next(sm.DeformableModel(ball, far, reach=0.5).run(1))
    assert (state.reached, state.gap) == (1.0, 0.5)
    next(sm.DeformableModel(ball, far).run(1))
    assert_allclose(far.reach, 0.2 * np.linalg.norm(np.ptp(ball.vertices, axis=0)))


def test_an_interrupted_run_keeps_the_last_whole_iteration():
    rough = noisy_sphere(frequency=3)

    class Impatient(Everywhere):
        def gap(self, vertices, normals, reach):
            self.calls = getattr(self, "calls", 0) + 1
            if self.calls == 4:
                raise KeyboardInterrupt
            return super().gap(vertices, normals, reach)

    model = sm.DeformableModel(rough, Impatient(0.01))
    with pytest.raises(KeyboardInterrupt):
        list(model.run(10))
    good = evolved(rough, 3, Everywhere(0.01))
    assert_array_equal(model.mesh.vertices, good.vertices)
    list(model.run(2))
    assert_allclose(model.mesh.vertices, evolved(rough, 5, Everywhere(0.01)).vertices, atol=1e-13)


@pytest.mark.parametrize("mesh", [noisy_sphere(frequency=3), open_tube()], ids=["closed", "open"])
@pytest.mark.parametrize("late", ["_step_surface", "_contours", "_user_displacement", "_adapted_metric"])
def test_an_interrupt_at_any_place_leaves_the_model_as_before_the_step(monkeypatch, mesh, late):
    options = {"forces": lambda frame: 0.01 * frame.normals, "adaptation": 0.1, "damping": 0.3}
    model = sm.DeformableModel(mesh, Everywhere(0.01), **options)
    if not mesh.n_holes and late == "_contours":
        return
    list(model.run(10))
    owner, late = (model._contours, "step") if late == "_contours" else (model, late)
    done = getattr(owner, late)

    def and_out(*arguments):
        done(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(owner, late, and_out)
    with pytest.raises(KeyboardInterrupt):
        model.step()
    monkeypatch.undo()
    assert model.iteration == 10
    list(model.run(5))
    whole = evolved(mesh, 15, Everywhere(0.01), **options)
    assert_array_equal(model.mesh.vertices, whole.vertices)
    assert_array_equal(model.mesh.data["metric"], whole.data["metric"])


def test_user_defined_targets_get_the_mesh_and_cannot_change_it():
    class Vandal:
        def __init__(self, which):
            self.which = which

        def gap(self, *given):
            given[self.which][:] = 0.0
            return np.zeros(len(given[0]))

    ball = sm.sphere(3)
    for which in (0, 1):
        for target in (Vandal(which), sm.targets.Union([Vandal(which)])):
            model = sm.DeformableModel(ball, target)
            with pytest.raises(ValueError, match="read-only"):
                model.step()
            assert_array_equal(model.mesh.vertices, ball.vertices)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"alpha": 0.7}, ValueError, "alpha must be between 0 and 0.5, not 0.7"),
        ({"beta": -1}, ValueError, "beta must be between 0 and 1, not -1"),
        ({"damping": 0}, ValueError, "damping must be between 0.001 and 1, not 0"),
        ({"reach": 0}, ValueError, "reach must be above 0, not 0"),
        ({"reach": "far"}, TypeError, "reach must be a number, not str"),
        ({"rigidity": -1}, ValueError, "rigidity must be between 0 and 1000, not -1"),
        ({"rigidity": 1.5}, TypeError, "rigidity must be a whole number of edges, not 1.5"),
        ({"rigidity": [1, 2]}, ValueError, r"rigidity must have shape \(180,\), not \(2,\)"),
        ({"alpha": np.linspace(0, 1, 180)}, ValueError, r"alpha must be between 0 and 0.5; alpha\[90\] is 0.50"),
        ({"constraint": "stiff"}, ValueError, "constraint must be one of 'free', .*, not 'stiff'"),
        ({"constraint": "shape"}, ValueError, "constraint 'shape' needs a reference mesh"),
        ({"constraint": "curvature"}, ValueError, "constraint 'curvature' needs the argument curvature"),
        ({"metric": np.full((180, 3), 0.5)}, ValueError, "metric must have rows that sum to 1; row 0 sums to 1.5"),
        ({"metric": np.ones(3)}, ValueError, r"metric must have shape \(180, 3\), not \(3,\)"),
        (
            {"constraint": "shape", "reference": sm.sphere(2)},
            ValueError,
            "reference must have the same connectivity as mesh",
        ),
        ({"adaptation": -0.1}, ValueError, "adaptation must be between 0 and 1, not -0.1"),
        ({"target": 3.0}, TypeError, r"target must have a method gap\(vertices, normals, reach\), not float"),
        ({"constraint": "shape", "reference": "x"}, TypeError, "reference must be a SimplexMesh, not str"),
        (
            {"reference": sm.sphere(3)},
            ValueError,
            "reference applies to vertices of constraint 'shape', but there are none",
        ),
        ({"curvature": 1.0}, ValueError, "curvature applies to vertices of constraint 'curvature', but there are none"),
        ({"reach": np.nan}, ValueError, "reach must be finite, not nan"),
        ({"reach": -np.inf}, ValueError, "reach must be finite, not -inf"),
        ({"forces": 3.0}, TypeError, "forces must be a function of a Frame or a sequence of them, not float"),
        ({"forces": [3.0]}, TypeError, r"forces must be functions of a Frame; forces\[0\] is a float"),
    ],
)
def test_wrong_arguments_are_named(options, error, message):
    with pytest.raises(error, match=message):
        sm.DeformableModel(sm.sphere(3), **options)


def test_only_a_mesh_can_be_deformed():
    with pytest.raises(TypeError, match="mesh must be a SimplexMesh, not ndarray"):
        sm.DeformableModel(sm.sphere(3).vertices)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"iterations": -1}, ValueError, "iterations must be at least 0, not -1"),
        ({"iterations": 2.5}, TypeError, "iterations must be a whole number"),
        ({"iterations": 5, "every": 0}, ValueError, "every must be at least 1, not 0"),
        ({"iterations": 5, "tolerance": -1.0}, ValueError, "tolerance must be at least 0, not -1"),
    ],
)
def test_wrong_arguments_of_a_run_are_named_at_once(arguments, error, message):
    with pytest.raises(error, match=message):
        sm.DeformableModel(sm.sphere(3)).run(**arguments)


def test_wrong_answers_of_targets_and_forces_are_named():
    class Short:
        def gap(self, vertices, normals, reach):
            return np.zeros(3)

    ball = sm.sphere(3)
    with pytest.raises(ValueError, match=r"target.gap must return shape \(180,\), not \(3,\)"):
        sm.DeformableModel(ball, Short()).step()
    with pytest.raises(ValueError, match=r"targets\[1\].gap must return shape \(180,\), not \(3,\)"):
        sm.DeformableModel(ball, sm.targets.Union([Everywhere(1.0), Short()])).step()
    with pytest.raises(ValueError, match="vertex must be one of the mesh's, 0 to 179, not 100000"):
        sm.DeformableModel(ball, forces=pull([0, 0, 0], vertex=100_000, extent=1.0)).step()
    with pytest.raises(ValueError, match=r"a force's displacements must have shape \(180, 3\), not \(180,\)"):
        sm.DeformableModel(ball, forces=[lambda frame: frame.mean_curvature]).step()
    with pytest.raises(ValueError, match="a force's displacements must be finite"):
        sm.DeformableModel(ball, forces=[lambda frame: np.full(frame.normals.shape, np.inf)]).step()


# ---- states


def test_states_are_yielded_every_so_often_and_at_the_end():
    rough = noisy_sphere(frequency=3)
    count = [s.iteration for s in sm.DeformableModel(rough).run(10, every=4)]
    assert count == [4, 8, 10]
    assert list(sm.DeformableModel(rough).run(0)) == []
    model = sm.DeformableModel(rough)
    assert [s.iteration for s in model.run(3)] + [s.iteration for s in model.run(2)] == [1, 2, 3, 4, 5]


def test_a_run_in_two_pieces_is_one_run():
    rough = noisy_sphere(frequency=3)
    model = sm.DeformableModel(rough, adaptation=0.1)
    list(model.run(17))
    list(model.run(13))
    assert_array_equal(model.mesh.vertices, evolved(rough, 30, adaptation=0.1).vertices)


def test_a_run_stops_when_nothing_moves_more_than_the_tolerance():
    rough = noisy_sphere(frequency=3)
    states = list(sm.DeformableModel(rough).run(5000, tolerance=1e-3))
    assert len(states) < 5000
    assert states[-1].move <= 1e-3 < states[-2].move
    sparse = list(sm.DeformableModel(rough).run(5000, every=1000, tolerance=1e-3))
    assert (sparse[-1].iteration, sparse[-1].move) == (states[-1].iteration, states[-1].move)


def test_a_state_has_energy_gap_and_move():
    ball = sm.sphere(4)
    model = sm.DeformableModel(ball, Everywhere(0.02), beta=0.5, metric=ball.metric)
    state = next(model.run(1))
    assert_allclose([state.energy, state.gap, state.move, state.reached], [0.5 * 0.5 * 0.02**2, 0.02, 0.01, 1.0])
    state = next(sm.DeformableModel(ball).run(1))
    assert np.isnan(state.gap)
    assert state.reached == 0.0


def test_the_start_is_left_as_it_was():
    rough = noisy_sphere(frequency=3)
    before = rough.vertices.copy()
    model = sm.DeformableModel(rough)
    list(model.run(5))
    early = model.mesh
    kept = early.vertices.copy()
    list(model.run(5))
    assert_array_equal(rough.vertices, before)
    assert_array_equal(early.vertices, kept)


def test_a_vertex_that_flies_off_ends_the_run_before_the_numbers_do():
    """Metric parameters far outside their triangle make every step larger than the last."""
    ball = sm.sphere(4)
    wild = ball.with_data(metric=np.tile([3.0, -1.0, -1.0], (ball.n_vertices, 1)))
    with pytest.raises(sm.DivergedError, match=r"vertex \d+ diverged at iteration \d+") as caught:
        for _ in sm.DeformableModel(wild).run(2000):
            pass
    assert np.isfinite(caught.value.mesh.vertices).all()
