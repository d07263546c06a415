"""Waves of correlated noise are no primitives: crests of a product of sines, whose means over a crest are known."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cloud.extraction.joint import Parts, wave_of
from simplexmesh.cloud.extraction.working import working

NOISE, LENGTH, HIGH = 0.003, 0.25, 0.02


def told(waves, plate, seed):
    """Return what one crest, or a plate of its size that far above the plane, is a wave of."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 1, (2, 8000))
    part = (np.abs(x - 0.5 * LENGTH) < 0.5 * LENGTH) & (np.abs(y - 0.5 * LENGTH) < 0.5 * LENGTH)
    z = waves * np.sin(np.pi * x / LENGTH) * np.sin(np.pi * y / LENGTH) + plate * part
    work = working(np.stack([x, y, z + rng.normal(0, NOISE, len(x))], axis=1), NOISE, rng)
    planes = [sm.primitives.Plane((0, 0, height), (0, 0, 1)) for height in (0, plate + waves / 2)]
    return wave_of(work, Parts(planes, [], part.astype(int), [NOISE, NOISE]), 1, np.array([0]))


@pytest.mark.parametrize("seed", range(3))
def test_a_crest_among_crests_is_a_wave(seed):
    assert told(HIGH, 0.0, seed) == 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("waves", "plate"), [(0.0, 3 * NOISE), (0.0, HIGH), (HIGH, 10 * HIGH)])
def test_a_plate_higher_than_waves_is_none(waves, plate, seed):
    assert told(waves, plate, seed) is None


def test_a_wavy_box_before_a_depth_camera_is_not_split(data_folder):
    found = sm.extract_primitives(data_folder / "box_rgbd.ply", kinds="plane", noise=0.01)
    assert 3 <= len(found.primitives) <= 6
