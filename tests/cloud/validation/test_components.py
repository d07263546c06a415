"""Patches of one sign."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import ConvexHull

from simplexmesh.cloud.validation import components
from tests.cloud.validation.fitted import are_uniform, told


def test_edges_are_delaunays():
    """3 n - 3 - b edges, with b points on the hull; the nearest of every point is joined with it."""
    at = np.random.default_rng(0).uniform(-1, 1, (100, 2))
    edges = components.delaunay_edges(at)
    nearest = np.argsort(np.linalg.norm(at[:, None] - at[None], axis=2), axis=1)[:, 1]
    pairs = set(map(tuple, edges.tolist()))
    assert all((min(i, j), max(i, j)) in pairs for i, j in enumerate(nearest.tolist()))
    assert len(edges) == 3 * 100 - 3 - len(ConvexHull(at).vertices)
    assert np.all(edges[:, 0] < edges[:, 1])
    x = np.linspace(-1, 1, 30)
    assert len(components.delaunay_edges(np.stack([x, x], axis=1))) >= 29


@pytest.mark.parametrize("diagonal", [False, True])
def test_grid_components_are_those_of_images(diagonal):
    """Every sign's labels by scipy, on a grid with empty cells."""
    rng = np.random.default_rng(1)
    at = rng.uniform(-1, 1, (250, 2))
    sums, edges = components.grid_cells(rng.normal(size=250), at, 12, diagonal=diagonal)
    cell = np.floor((at + 1) / 2 * 12).astype(int)
    image = np.zeros((12, 12))
    rng = np.random.default_rng(1)
    rng.uniform(-1, 1, (250, 2))
    np.add.at(image, tuple(cell.T), rng.normal(size=250))
    assert (image == 0).any()
    assert np.sort(sums) == pytest.approx(np.sort(image[image != 0]))
    shape = np.ones((3, 3)) if diagonal else None
    sizes = [np.bincount(ndimage.label(side, shape)[0].ravel())[1:] for side in (image > 0, image < 0)]
    found = components.component_sizes(sums > 0, edges)
    assert np.array_equal(np.sort(found), np.sort(np.concatenate(sizes)))
    assert components.component_count(sums > 0, edges) == sum(map(len, sizes))
    assert components.largest_component(sums > 0, edges) == max(side.max() for side in sizes)


def test_joins_of_a_path():
    edges = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    assert components.joins(np.array([1, 1, 0, 0, 1, 0], bool), edges) == 3


STATISTICS = [components.component_count, components.largest_component, components.joins]


@pytest.mark.parametrize("statistic", STATISTICS)
def test_law_by_trials(statistic):
    """Never more rejected than the level, for whole statistics less; relief is what joins find."""
    found = {"noise": [], "relief": []}
    for seed in range(60):
        rng = np.random.default_rng(seed)
        at, noise = rng.uniform(-1, 1, (150, 2)), rng.normal(size=150)
        edges = components.delaunay_edges(at)
        for name, d in (("noise", noise), ("relief", noise + np.sin(4 * at[:, 0]))):
            found[name].append(components.components_test(d, edges, rng, statistic=statistic, trials=99).p_value)
    rejected = {name: int(np.sum(np.less_equal(p, 0.05))) for name, p in found.items()}
    told(f"{statistic.__name__}: {rejected} of 60")
    assert rejected["noise"] <= 10
    if statistic is components.joins:
        assert are_uniform(found["noise"])
        assert rejected["relief"] >= 45
