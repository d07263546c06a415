"""Waves of correlated noise are no primitives: crests of a product of sines, whose means over a crest are known."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cloud.extraction import joint
from simplexmesh.cloud.extraction.growth import Grown, is_flat
from simplexmesh.cloud.extraction.joint import Parts, wave_of
from simplexmesh.cloud.extraction.patches import Limits
from simplexmesh.cloud.extraction.working import working
from tests.nightly.marks import nightly

NOISE, LENGTH, HIGH = 0.003, 0.25, 0.02


def told(waves, plate, seed, bow=0.0):
    """Return what one crest, or a plate of its size that far above the plane, which may be bowed, is a wave of."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 1, (2, 8000))
    part = (np.abs(x - 0.5 * LENGTH) < 0.5 * LENGTH) & (np.abs(y - 0.5 * LENGTH) < 0.5 * LENGTH)
    z = waves * np.sin(np.pi * x / LENGTH) * np.sin(np.pi * y / LENGTH) + plate * part
    z += bow * (12 * (y - 0.5) ** 2 - 1)
    work = working(np.stack([x, y, z + rng.normal(0, NOISE, len(x))], axis=1), NOISE, rng)
    planes = [sm.primitives.Plane((0, 0, height), (0, 0, 1)) for height in (0, plate + waves / 2)]
    return wave_of(work, Parts(planes, [], part.astype(int), [NOISE, NOISE]), 1, np.array([0]))


@pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
def test_a_crest_among_crests_is_a_wave(seed):
    assert told(HIGH, 0.0, seed) == 0


@pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
@pytest.mark.parametrize(
    ("waves", "plate", "bow"), [(0.0, 3 * NOISE, 0.0), (0.0, HIGH, 0.0), (HIGH, 10 * HIGH, 0.0), (0.0, HIGH, HIGH)]
)
def test_a_plate_higher_than_waves_is_none(waves, plate, bow, seed):
    """A plane that is bowed as a whole, as by twice as much as its mean square there, has no waves either."""
    assert told(waves, plate, seed, bow) is None


@pytest.mark.parametrize(("waves", "flat"), [(0.0, False), (1.0, True)])
def test_what_bends_less_than_its_waves_is_flat(waves, flat):
    """An arc with as much noise as its points are off a plane, in each point alone or in waves."""
    rng = np.random.default_rng(0)
    arc = sm.primitives.Cylinder((0, 0, 0), (0, 1, 0), 2.0)
    x, y = rng.uniform([-0.5, 0], [0.5, 1], (8000, 2)).T
    off = np.std(2 - np.sqrt(4 - x**2))
    wave = 2 * np.sin(np.pi * x / LENGTH) * np.sin(np.pi * y / LENGTH)
    radius = 2 + off * (waves * wave + (1 - waves) * rng.normal(size=len(x)))
    points = radius[:, None] * np.stack([x / 2, y * 0, np.sqrt(1 - x**2 / 4)], axis=1) + y[:, None] * [0, 1, 0]
    work = working(points, NOISE, rng)
    assert is_flat(work, Grown(arc, np.arange(len(work.points)), off, 0.0)) == flat


def test_what_joined_a_wave_goes_where_that_one_goes(monkeypatch):
    rng = np.random.default_rng(0)
    work = working(rng.uniform(0, 1, (3000, 3)) * [1, 1, 0], NOISE, rng)
    labels = 1 * (work.points[:, 0] < 0.4) + 1 * (work.points[:, 0] < 0.1)
    planes, limits = [sm.primitives.Plane((0, 0, 0), (0, 0, 1))] * 3, Limits(("plane",), (0.0, np.inf), 20)
    monkeypatch.setattr(joint, "wave_of", lambda work, state, part, others: part - 1 if part else None)
    state = Parts(planes, [], labels, [NOISE] * 3)
    kept = joint.without_superfluous(work, state, limits, joint.costs(work, state))
    assert len(kept.primitives) == 1
    assert (kept.labels == 0).all()


def test_a_wavy_box_before_a_depth_camera_is_not_split(data_folder):
    found = sm.extract_primitives(data_folder / "box_rgbd.ply", kinds="plane")
    assert 3 <= len(found.primitives) <= 8  # 11 and more when it is


@pytest.mark.parametrize("rng", [1, *nightly(0, 2, 3)])
def test_two_sides_of_a_wavy_box_are_planes(data_folder, rng):
    found = sm.extract_primitives(data_folder / "box_rgbd.ply", rng=rng)
    assert [each.kind for each in found.primitives[:2]] == ["plane", "plane"]  # without waves a ball among others
    assert np.isin(found.labels, [0, 1]).mean() > 0.8
