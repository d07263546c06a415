"""Sharp edges of volumes, told from round ones by how their isosurface turns."""

import numpy as np
import pytest
from scipy.special import ndtr

import simplexmesh as sm
from simplexmesh.motion.creases.blurred import are_sharp, blur_of
from simplexmesh.motion.creases.line import CreaseLine

HALF = np.array([14.0, 11.0, 8.0])
AXES = [np.arange(-half - 7, half + 8) for half in HALF]


def blurred_box(blur, noise=0.0):
    """A box seen through a Gaussian: the product of three differences of normal distributions."""
    x, y, z = (ndtr((a + half) / blur) - ndtr((a - half) / blur) for a, half in zip(AXES, HALF, strict=True))
    values = x[:, None, None] * y[:, None] * z
    values += noise * np.random.default_rng(0).normal(size=values.shape)
    return sm.Volume(values, origin=[a[0] for a in AXES])


def rounded_box(radius, blur):
    """The same with edges rounded, by its distance."""
    p = np.abs(np.stack(np.meshgrid(*AXES, indexing="ij"), axis=-1)) - HALF + radius
    away = np.linalg.norm(np.maximum(p, 0), axis=-1) + np.minimum(p.max(axis=-1), 0) - radius
    return sm.Volume(ndtr(-away / blur), origin=[a[0] for a in AXES])


def top_edge(inset=0.0):
    """A line along the edge of the box at positive y and z, on its isosurface or below."""
    y, z = HALF[1:] - inset
    return CreaseLine(
        np.column_stack([np.linspace(-10, 10, 30), np.full(30, y), np.full(30, z)]), closed=False, angle=1.5
    )


@pytest.fixture(scope="module")
def smooth():
    return sm.reconstruct(blurred_box(1.0), level=0.5, vertices=900, creases="none").mesh


@pytest.mark.parametrize("blur", [0.8, 1.0, 1.6])
def test_the_blur_of_a_box_is_found(smooth, blur):
    found = blur_of(sm.targets.Isosurface(blurred_box(blur), 0.5), smooth)
    assert found == pytest.approx(np.hypot(blur, 0.4), abs=0.12)  # linear interpolation blurs some more


def test_the_unit_and_the_side_do_not_matter(smooth):
    volume = blurred_box(1.0)
    known = blur_of(sm.targets.Isosurface(volume, 0.5), smooth)
    larger = sm.Volume(1 - volume.values, spacing=2.0, origin=2 * volume.origin)
    target = sm.targets.Isosurface(larger, 0.5, inside="below")
    assert blur_of(target, smooth.moved(2 * smooth.vertices)) == pytest.approx(2 * known)


def test_values_that_rise_steadily_have_no_blur(smooth):
    ball = sm.Volume(np.linalg.norm(np.stack(np.meshgrid(*AXES, indexing="ij")), axis=0), origin=[a[0] for a in AXES])
    target = sm.targets.Isosurface(ball, 9.0, inside="below")
    assert blur_of(target, sm.sphere(8).moved(9 * sm.sphere(8).vertices)) == np.inf


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_a_sharp_edge_is_told_from_a_fillet(smooth, noise):
    sharp = sm.targets.Isosurface(blurred_box(1.0, noise), 0.5)
    fillet = sm.targets.Isosurface(rounded_box(5.0, 1.0), 0.5)
    side = CreaseLine(top_edge().points - [0, 5.0, 0], closed=False, angle=1.0)
    blur = blur_of(sharp, smooth)
    assert are_sharp([top_edge(0.5), side], smooth, sharp, blur).tolist() == [True, False]
    assert are_sharp([top_edge(5.0 * (1 - np.sqrt(0.5)))], smooth, fillet, blur).tolist() == [False]


def test_a_box_has_its_edges_and_a_rounded_one_none():
    volume = blurred_box(1.0, noise=0.02)
    sharp, smooth = (sm.reconstruct(volume, level=0.5, vertices=900, creases=each) for each in ("auto", "none"))
    assert (len(sharp.creases), len(smooth.creases)) == (12, 0)
    assert sum(line.length for line in sharp.creases) == pytest.approx(8 * HALF.sum(), rel=0.15)  # pieces may fold
    points = np.concatenate([line.points for line in sharp.creases])
    off = np.sort(np.abs(np.abs(points) - HALF), axis=1)[:, 1]  # of the second of two sides, in voxels
    assert np.sqrt((off**2).mean()) < 0.2
    assert off.max() < 1.3  # half an edge
    assert abs(sharp.mesh.volume - 8 * HALF.prod()) < 0.3 * abs(smooth.mesh.volume - 8 * HALF.prod())
    assert sharp.mesh.check(self_intersections=True).ok
    assert sharp.distance.mesh_to_data.rms < 0.2  # each vertex to its own side, not to where the blur is round
    assert sm.reconstruct(rounded_box(5.0, 1.0), level=0.5, vertices=900).creases == ()
