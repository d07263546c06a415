"""The choices of the user alone: defaults, what they imply, what is refused; stages of motion, by their definitions."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.model.parameters import MOST_RIGID
from simplexmesh.motion.model.state import Stage, mean_edge
from simplexmesh.motion.reconstruct import changes
from simplexmesh.motion.reconstruct.options import FEWEST_VERTICES, MOST_VERTICES, Options, stages_from

UNSAID = dict.fromkeys(("tunnels", "adaptation", "placement", "holes", "handles", "refine"))
BALL = sm.sphere(3)


def options(**given):
    usual = {"init": "auto", "vertices": 1000, "components": "auto", "iterations": 100, "rigidity": 1}
    return Options(**UNSAID | usual | given)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, ("auto", 0.05, "closed", "open", "none", "open")),
        ({"init": "sphere"}, ("largest", 0.05, "closed", "auto", "auto", "auto")),
        ({"init": "ellipsoid", "holes": "none"}, ("largest", 0.05, "closed", "none", "auto", "auto")),
        ({"init": "sphere", "holes": [[1]]}, ("largest", 0.05, "closed", [[1]], "none", "auto")),
        ({"init": "torus"}, ("largest", 0.05, "closed", "auto", "none", "auto")),
        ({"init": BALL}, ("largest", 0.05, "even", "none", "none", "none")),
        ({"init": BALL, "placement": "adaptive"}, ("largest", 0.05, "adaptive", "none", "none", "none")),
        ({"placement": "even"}, ("auto", 0.0, "even", "open", "none", "open")),
        ({"placement": "even", "adaptation": 0.2}, ("auto", 0.2, "even", "open", "none", "open")),
        ({"adaptation": 0.0}, ("auto", 0.0, "even", "open", "none", "open")),
        ({"holes": "auto", "components": "all"}, ("all", 0.05, "closed", "auto", "none", "open")),
        ({"refine": "fine", "handles": "auto"}, ("auto", 0.05, "closed", "open", "auto", "fine")),
        ({"handles": np.array([[3, 4]])}, ("auto", 0.05, "closed", "open", [[3, 4]], "open")),
    ],
)
def test_what_is_not_said_follows_from_what_is(given, expected):
    found = options(**given)
    names = ("components", "adaptation", "placement", "holes", "handles", "refine")
    values = [getattr(found, name) for name in names]
    values[4] = [row.tolist() for row in values[4]] if isinstance(values[4], list) else values[4]
    assert tuple(values) == expected


@pytest.mark.parametrize(
    "given",
    [{"adaptation": 0.25}, {"vertices": FEWEST_VERTICES}, {"vertices": MOST_VERTICES}, {"tunnels": 0.0},
     {"iterations": 0}, {"rigidity": 0}, {"rigidity": MOST_RIGID}],
)  # fmt: skip
def test_limits_belong_to_what_is_allowed(given):
    ((name, value),) = given.items()
    assert getattr(options(**given), name) == value


def test_tunnels_are_sealed_in_starts_found_in_the_data():
    assert options(init="sphere", tunnels=2.0).tunnels == options(tunnels=2.0).tunnels == 2.0


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"adaptation": 0.26}, ValueError, "adaptation must be between 0 and 0.25"),
        ({"vertices": FEWEST_VERTICES - 1}, ValueError, "vertices must be at least 20"),
        ({"vertices": MOST_VERTICES + 1}, ValueError, "vertices must be at most 20000000"),
        ({"iterations": -1}, ValueError, "iterations must be at least 0"),
        ({"rigidity": -1}, ValueError, "rigidity must be at least 0"),
        ({"tunnels": -0.1}, ValueError, "tunnels must be at least 0"),
        ({"rigidity": MOST_RIGID + 1}, ValueError, "rigidity must be at most"),
        ({"init": BALL, "components": "all"}, ValueError, "components='all' needs init='auto'"),
        ({"init": "torus", "handles": "auto"}, ValueError, "handles are found from init='sphere'"),
        ({"handles": lambda pair: True}, ValueError, "handles are found from init='sphere'"),
        ({"init": BALL, "handles": callable}, ValueError, "handles are found from init='sphere'"),
        ({"init": "sphere", "holes": callable, "handles": callable}, ValueError, "handles are found from init="),
        ({"init": "sphere", "holes": [[1]], "handles": "auto"}, ValueError, "handles are found from init='sphere'"),
        ({"init": BALL, "tunnels": 1.0}, ValueError, "tunnels needs init='auto'"),
        ({"init": "torus", "tunnels": 1.0}, ValueError, "tunnels needs init='auto'"),
        ({"init": "sphere", "handles": "none", "tunnels": 1.0}, ValueError, "tunnels needs init='auto'"),
        ({"holes": 3}, TypeError, "holes must be 'auto', 'none', a function or a sequence, not int"),
        ({"init": 3}, TypeError, "init must be a name, a path or a SimplexMesh, not int"),
    ],
)
def test_what_cannot_be_is_refused(given, error, message):
    with pytest.raises(error, match=message):
        options(**given)


@pytest.mark.parametrize(
    ("vertices", "first"), [(20, 16), (100, 80), (900, 720), (1000, 720), (1715, 720), (2000, 840), (10000, 4200)]
)
def test_refinement_begins_with_less_than_half_of_the_vertices_but_enough_for_holes(vertices, first):
    assert options(init="sphere", vertices=vertices).first_vertices == first
    assert options(vertices=vertices).first_vertices == vertices


class TestStages:
    edge = mean_edge(BALL)

    def stages(self, cell, resolution, *, layered=False, **given):
        data = SimpleNamespace(diagonal=13.0, resolution=resolution, layered=layered)
        return stages_from(BALL, data, options(**given), cell=cell)

    def test_from_afar_are_five(self):
        last = 0.5
        assert self.stages(None, 0.25) == [
            Stage(20, 13.0, 150, alpha=0.5, beta=0.03),
            Stage(10, 5.2, 60, alpha=0.5, beta=0.05),
            Stage(6, 2.6, 100, beta=0.1),
            Stage(1, 0.16 * 6.5, 100, beta=0.3, adaptation=0.05),
            Stage(1, max(last, self.edge), 50, beta=0.4),
        ]
        assert [stage.rigidity for stage in self.stages(None, 1.0, rigidity=12)] == [20, 12, 12, 12, 12]
        assert self.stages(None, 2.0)[-1].reach == 4

    @pytest.mark.parametrize(
        ("cell", "resolution", "layered", "reach"),
        [
            (0.3, 0.2, False, max(0.6, 2 * edge)),
            (0.3, 0.4, False, 1.2),
            (0.3, 9.0, False, 1.3),
            (0.5, 0.1, True, 0.625),
            (0.1, 0.3, True, 1.25 * max(0.3, min(1.2 * edge, 0.45))),
            (0.01, 0.15, True, 1.25 * 0.225),
            (0.1, 0.9, True, 1.25 * max(0.9, min(1.2 * edge, 1.35))),
        ],
    )
    def test_from_nearby_are_three(self, cell, resolution, layered, reach):
        reach = min(reach, 0.2 * 6.5)
        assert self.stages(cell, resolution, layered=layered, iterations=90) == [
            Stage(2, pytest.approx(reach), 40, beta=0.2),
            Stage(1, pytest.approx(reach), 90, beta=0.4, adaptation=0.05),
            Stage(1, pytest.approx(min(max(2 * resolution, self.edge), reach)), 45, beta=0.4),
        ]
        assert [stage.rigidity for stage in self.stages(cell, resolution, rigidity=5)] == [5, 5, 5]


@pytest.mark.parametrize(
    ("placement", "holes", "found", "layered", "thick", "wanted"),
    [
        ("adaptive", 1, None, True, 0.1, True),
        ("even", 0, True, True, 9.0, False),
        ("closed", 1, True, True, 9.0, False),
        ("closed", 1, None, False, 9.0, False),
        ("closed", 0, None, True, 0.1, True),
        ("closed", 0, True, False, 0.1, True),
        ("closed", 0, True, True, 1.01, True),
        ("closed", 0, True, True, 0.99, False),
    ],
)
def test_vertices_are_redistributed_but_for_thin_bodies_and_holes(placement, holes, found, layered, thick, wanted):
    """A ball is as thick as two thirds of its radius; relative to its edges, `thick` times as thick as is thin."""
    body = SimpleNamespace(area=3.0, volume=0.5 * thick * changes.THIN * 3.0 * mean_edge(BALL), vertices=BALL.vertices)
    body.neighbors, body.connectivity = BALL.neighbors, BALL.connectivity
    run = SimpleNamespace(
        options=SimpleNamespace(placement=placement),
        mesh=SimpleNamespace(n_holes=holes),
        found=found,
        data=SimpleNamespace(layered=layered),
        start=body,
    )
    assert changes._is_wanted(run) == wanted


@pytest.mark.parametrize("away", [0.5, 1.5])
def test_holes_are_opened_near_a_wide_border_of_the_data_only(away, monkeypatch):
    border, run = BALL.vertices[:20], SimpleNamespace(target=None, options=SimpleNamespace(holes="auto"))
    run.tree, run.data = cKDTree(BALL.vertices), SimpleNamespace(diagonal=3.4)
    monkeypatch.setattr(changes, "wide_border", lambda target, edge: border)
    line = SimpleNamespace(
        mesh=SimpleNamespace(vertices=border + np.array([0, 0, away * changes.FAR_FROM_BORDER * 0.001])),
        vertices=np.arange(20),
    )
    line = SimpleNamespace(contour=line, vertices=np.arange(20))
    answer = changes._near_border(run, 0.001)(line)
    assert answer is True if away < 1 else answer == "the data ends 0.009 away"
    assert changes._near_border(run, 0.001)(SimpleNamespace(contour=None)) == "the data has no border wide enough"
    border = border[:0]
    assert changes._near_border(run, 0.001)(line) == "the data has no border wide enough"
