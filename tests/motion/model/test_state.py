"""When a motion is at rest."""

import numpy as np
import pytest

from simplexmesh.motion.model.state import State, is_at_rest


def states(energies, move=0.3):
    """States of these energies, in which some vertex moves by 0.3 edges in every step."""
    return [State(k, float(energy), 0.01, 1.0, move) for k, energy in enumerate(energies)]


STEPS = np.arange(40)


@pytest.mark.parametrize("seed", range(5))
def test_an_energy_that_only_fluctuates_is_at_rest(seed):
    noise = np.random.default_rng(seed).normal(size=300)
    assert any(is_at_rest(states(1 + 0.2 * noise)[:k], 1.0) for k in range(30, 301, 10))


@pytest.mark.parametrize(
    "energy", [1 - 0.01 * STEPS, np.exp(-0.02 * STEPS), np.exp(-STEPS / 2) + 0.01, 1 + 0.1 * STEPS]
)
def test_an_energy_that_falls_or_rises_steadily_is_not(energy):
    assert not is_at_rest(states(energy)[:20], 1.0)


def test_a_fall_is_told_from_the_fluctuation_on_it():
    noise = np.random.default_rng(0).normal(size=40)
    fall = states(1 - 0.02 * STEPS + 0.02 * noise)
    assert not any(is_at_rest(fall[:k], 1.0) for k in (20, 30, 40))


def test_what_hardly_moves_is_at_rest_and_early_no_motion_is():
    assert is_at_rest(states(1 - 0.02 * STEPS[:20], move=0.009), 1.0)
    assert not is_at_rest(states(np.ones(19)), 1.0)
