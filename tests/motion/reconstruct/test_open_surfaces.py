"""Points of surfaces with a border are kept open, those of solids that lack one side are not."""

import warnings

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.start.report import MOST_OPEN, StartReport
from tests.nightly.marks import nightly

NOISE = 0.01
ANGLES = np.linspace(0, 2 * np.pi, 400)
SIDES = np.linspace(-1, 1, 200)
SQUARE = np.concatenate([[(SIDES[k], s), (s, SIDES[k])] for k in range(200) for s in (-1.0, 1.0)])
SIDES_OF_BOX = ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0), (2, 1.0))
CIRCLE = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES])


def waves(xy):
    return np.column_stack([xy, 0.25 * np.sin(2 * xy[:, 0]) * np.cos(2 * xy[:, 1])])


def saddle(xy):
    return np.column_stack([xy, 0.5 * (xy[:, 0] ** 2 - xy[:, 1] ** 2)])


def half_ball(count, rng):
    points = rng.normal(size=(2 * count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points[points[:, 2] > 0], CIRCLE


def tube(count, rng):
    angle, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-1, 1, count)
    ends = np.concatenate([CIRCLE - np.array([0, 0, 1]), CIRCLE + np.array([0, 0, 1])])
    return np.column_stack([np.cos(angle), np.sin(angle), height]), ends


def noisy(points, rng):
    return points + NOISE * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape)


def sheet(shape):
    return lambda count, rng: (shape(rng.uniform(-1, 1, (count, 2))), shape(SQUARE))


@pytest.mark.parametrize(
    ("shell", "holes", "area", "noise"),
    [
        pytest.param(half_ball, 1, 2 * np.pi, 0.0, id="half a ball", marks=pytest.mark.nightly),
        pytest.param(half_ball, 1, 2 * np.pi, 0.005, id="half a noisy ball", marks=pytest.mark.nightly),
        pytest.param(tube, 2, 4 * np.pi, 0.0, id="tube", marks=pytest.mark.nightly),
        pytest.param(tube, 2, 4 * np.pi, 0.005, id="noisy tube"),
        pytest.param(sheet(waves), 1, 4.249, 0.0, id="waves", marks=pytest.mark.nightly),
        pytest.param(sheet(waves), 1, 4.249, 0.005, id="noisy waves", marks=pytest.mark.nightly),
        pytest.param(sheet(saddle), 1, 5.123, 0.0, id="saddle", marks=pytest.mark.nightly),
        pytest.param(sheet(saddle), 1, 5.123, 0.005, id="noisy saddle", marks=pytest.mark.nightly),
    ],
)
def test_open_surfaces_are_kept_open(shell, holes, area, noise):
    """The areas are those of the integrals; corners are rounded off by an edge or so."""
    points, border = shell(6000, np.random.default_rng(5))
    points = points + noise * np.linalg.norm(np.ptp(points, axis=0)) * np.random.default_rng(6).normal(
        size=points.shape
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        model = sm.reconstruct(points, vertices=1200)
    assert any("the data is an open surface: the model is kept open" in str(each.message) for each in told)
    mesh, c = model.mesh, model.mesh.connectivity
    assert (mesh.n_holes, mesh.genus, mesh.n_components) == (holes, 0, 1)
    assert mesh.n_vertices == pytest.approx(1200, rel=0.1)
    assert mesh.area == pytest.approx(area, rel=0.05)
    rim = mesh.vertices[c.face_is_hole[c.vertex_faces].any(axis=1)]
    assert cKDTree(border).query(rim)[0].mean() < mean_edge(mesh)
    assert cKDTree(rim).query(border)[0].mean() < mean_edge(mesh)


@pytest.mark.parametrize("size", [(1, 1, 1), *nightly(((2, 1, 1),), ((1, 1, 2),))])
def test_boxes_without_a_bottom_are_closed(size):
    rng = np.random.default_rng(7)
    sides = [np.insert(rng.random((2000, 2)), axis, end, axis=1) for axis, end in SIDES_OF_BOX]
    points = np.concatenate(sides) * size
    with pytest.warns(sm.SimplexMeshWarning, match="of the model's area has no data nearby"):
        model = sm.reconstruct(points, vertices=800, creases="none")
    assert model.mesh.n_holes == 0
    assert 0 < model.found.openness < MOST_OPEN
    assert model.mesh.volume == pytest.approx(np.prod(size), rel=0.06)


@pytest.mark.nightly
@pytest.mark.parametrize(("count", "shell"), [(6000, waves), (30_000, waves), (6000, saddle)])
def test_sheets_as_thick_as_their_noise_are_no_solids(count, shell):
    points = noisy(sheet(shell)(count, rng := np.random.default_rng(5))[0], rng)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        model = sm.reconstruct(points, vertices=1200)
    assert any("the data is an open surface" in str(each.message) for each in told)
    assert any("noise hides whether" in str(each.message) for each in told) == (model.found.doubled > MOST_OPEN)
    assert (model.mesh.n_holes, model.mesh.genus) == (1, 0)
    assert model.distance.mesh_to_data.rms < NOISE * np.linalg.norm(np.ptp(points, axis=0))


@pytest.mark.parametrize(("noises", "height", "closed"), [*nightly((2, 1, False)), (3, 0, True)])
def test_a_plate_thicker_than_its_noise_is_closed(noises, height, closed):
    """Of two normal distributions, two standard deviations apart, the sum has one maximum."""
    rng = np.random.default_rng(5)
    plate = np.array([2, 2, noises * NOISE * np.sqrt(8)])
    areas = plate.prod() / plate
    points, across = plate * (rng.random((6000, 3)) - 0.5), rng.choice(3, 6000, p=areas / areas.sum())
    points[np.arange(6000), across] = (plate / 2)[across] * rng.choice([-1, 1], 6000)
    points[:, 2] += height * waves(points[:, :2])[:, 2]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        model = sm.reconstruct(noisy(points, rng), vertices=1200)
    assert (model.mesh.n_holes == 0) is closed
    assert any("the data is an open surface" in str(each.message) for each in told) is not closed


def test_what_is_open_is_told_by_the_start():
    told = [str(StartReport((9, 9, 9), 0.1, 0, 1, openness=share)) for share in (MOST_OPEN, 1.01 * MOST_OPEN)]
    assert ["open surface" in each for each in told] == [False, True]


def test_a_sheet_cannot_be_closed():
    points = sheet(saddle)(3000, np.random.default_rng(8))[0]
    with pytest.raises(sm.TopologyError, match="an open surface that no lid closes; holes='auto' leaves it open"):
        sm.reconstruct(points, vertices=600, holes="none")


@pytest.mark.nightly
def test_normals_of_a_sheet_tell_its_outer_side():
    points = sheet(waves)(4000, np.random.default_rng(9))[0]
    for sign in (1.0, -1.0):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)
            model = sm.reconstruct(sm.PointCloud(points, np.tile([0, 0, sign], (len(points), 1))), vertices=600)
        assert model.mesh.n_holes == 1
        assert sign * model.mesh.normals[:, 2].mean() > 0.8


@pytest.mark.parametrize("inward", [*nightly(False), True])
def test_open_triangles_may_face_either_way(inward):
    ball = sm.sphere(20).triangulated("dual")
    faces = ball.faces[(ball.vertices[ball.faces, 2] > 0).all(axis=1)]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        model = sm.reconstruct(sm.TriangleMesh(ball.vertices, faces[:, ::-1] if inward else faces), vertices=600)
    assert (model.mesh.n_holes, model.mesh.genus) == (1, 0)
    assert model.distance.mesh_to_data.max < 0.05
    assert any("the triangles face inwards and were flipped" in str(each.message) for each in told) is inward
