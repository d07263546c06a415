"""Arrays of points and vertices, and the unit: what becomes of them in all that makes new objects."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning

BALL = sm.sphere(4)
N = BALL.n_vertices
DATA = {"height": BALL.vertices[:, 2], "label": np.arange(N), "colors": np.zeros((N, 3), np.uint8)}
CLOUD = sm.PointCloud(BALL.vertices, BALL.normals, DATA, "mm")
DUAL = BALL.triangulated("dual")
SURFACE = sm.TriangleMesh(DUAL.vertices, DUAL.faces, {"height": DUAL.vertices[:, 2]}, "mm")
MESH = sm.SimplexMesh(BALL.vertices, BALL.connectivity, DATA, "mm")
VOLUME = sm.Volume(np.arange(27.0).reshape(3, 3, 3), spacing=(1, 2, 3), origin=(5, 6, 7), unit="mm")
ALL = [CLOUD, SURFACE, MESH, VOLUME]


@pytest.mark.parametrize("thing", ALL[:3], ids=lambda thing: type(thing).__name__)
class TestArrays:
    def test_are_read_only_copies(self, thing):
        mine = np.zeros(len(thing.data["height"]))
        kept = thing.with_data(mine=mine)
        mine[:] = 1
        assert not kept.data["mine"].any()
        with pytest.raises(ValueError, match="read-only"):
            kept.data["mine"][0] = 1
        with pytest.raises(TypeError):
            kept.data["other"] = mine
        assert "mine" not in kept.with_data(mine=None).data
        assert kept.unit == "mm"

    @pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
    def test_are_copied_and_pickled(self, thing, again):
        other = again(thing)
        assert other.data.keys() == thing.data.keys()
        assert other.unit == "mm"
        assert_array_equal(other.data["height"], thing.data["height"])
        assert not other.data["height"].flags.writeable

    def test_come_along_in_a_transform(self, thing):
        moved = thing.transformed(np.diag([2.0, 3.0, 4.0, 1.0]))
        assert_array_equal(moved.data["height"], thing.data["height"])
        assert moved.unit == "mm"

    @pytest.mark.parametrize(
        ("data", "error", "message"),
        [
            ([1], TypeError, "data must be a Mapping, not list"),
            ({"a": ["x"]}, TypeError, "data 'a' must be numbers, not <U1"),
            ({"a": [1, 2]}, ValueError, "data 'a' must have [0-9]+ rows, one for each (point|vertex), not shape"),
            ({"a": [[1], [2, 3]]}, ValueError, "data 'a' must be an array, but its rows have different lengths"),
        ],
    )
    def test_that_do_not_fit_are_refused(self, thing, data, error, message):
        with pytest.raises(error, match=message):
            type(thing)(*list(thing.__dict__.values())[:2], data)


@pytest.mark.parametrize("thing", ALL, ids=lambda thing: type(thing).__name__)
class TestUnits:
    def test_are_converted_exactly(self, thing):
        meters = thing.in_unit("m")
        assert meters.unit == "m"
        assert_allclose(meters.bounds * 1000, thing.bounds, rtol=1e-15)
        assert thing.in_unit("mm", "mm").bounds.tolist() == thing.bounds.tolist()
        assert_allclose(meters.in_unit("in").bounds, thing.bounds / 25.4, rtol=1e-14)

    def test_scaling_keeps_the_unit(self, thing):
        assert thing.scaled(2).unit == "mm"
        assert_allclose(thing.scaled(2).bounds, 2 * thing.bounds)
        for factor in (0, -1, np.nan):
            with pytest.raises(ValueError, match="factor must be"):
                thing.scaled(factor)

    def test_that_contradict_are_refused(self, thing):
        with pytest.raises(ValueError, match="given must be 'mm', the unit that is known, or left out, not 'm'"):
            thing.in_unit("mm", "m")
        with pytest.raises(ValueError, match="unit must be one of"):
            thing.in_unit("furlong")


def test_an_unknown_unit_must_be_given():
    bare = sm.PointCloud(BALL.vertices)
    assert bare.unit is None
    with pytest.raises(ValueError, match="given must be the unit of the coordinates, which is unknown"):
        bare.in_unit("mm")
    assert_allclose(bare.in_unit("mm", "m").points, 1000 * bare.points)
    with pytest.raises(ValueError, match="unit must be one of"):
        sm.PointCloud(BALL.vertices, unit="parsec")


def test_a_cloud_is_an_array():
    assert_array_equal(np.asarray(CLOUD), CLOUD.points)
    assert np.asarray(CLOUD, dtype=np.float32).dtype == np.float32
    mine = np.array(CLOUD)
    mine[:] = 0
    assert CLOUD.points.any()
    with pytest.raises(ValueError, match="points must be copied to become float32"):
        np.asarray(CLOUD, dtype=np.float32, copy=False)


def test_a_part_in_front_of_a_plane():
    for cap in (False, True):
        part = sm.clipped(SURFACE.with_data(label=np.arange(SURFACE.n_vertices)), (0, 0, 0.1), (1, 2, 3), cap=cap)
        assert_allclose(part.data["height"], part.vertices[:, 2], atol=1e-9)
        nearest = np.linalg.norm(part.vertices - SURFACE.vertices[part.data["label"]], axis=1)
        assert nearest.max() <= 0.5 * np.linalg.norm(np.diff(SURFACE.vertices[SURFACE.faces], axis=1), axis=2).max()
        assert part.unit == "mm"


@pytest.mark.parametrize("operation", ["difference", "union", "intersection"])
def test_a_boolean_of_surfaces(operation):
    label = np.zeros(SURFACE.n_vertices, int)
    one = SURFACE.with_data(label=label, only=label)
    other = SURFACE.transformed(np.diag([0.8, 0.8, 0.8, 1]) + np.array([[0, 0, 0, s] for s in (0.7, 0.1, 0.4, 0)]))
    other = other.with_data(height=other.vertices[:, 2], label=label + 1)
    with pytest.warns(SimplexMeshWarning, match="arrays that not all parts have were left out: only$"):
        out = sm.boolean(one, other, operation)
    assert list(out.data) == ["height", "label"]
    assert_allclose(out.data["height"], out.vertices[:, 2], atol=1e-9)
    assert set(out.data["label"]) == {0, 1}
    far = np.linalg.norm(out.vertices, axis=1) > 1.05
    assert (out.data["label"][far] == 1).all()
    assert out.unit == "mm"
    with pytest.raises(ValueError, match="first and second must have one unit, not m and mm"):
        sm.boolean(one, other.in_unit("m"), operation)


@pytest.mark.parametrize("surface", [SURFACE, sm.clipped(SURFACE, (0, 0, 0), (1, 2, 3))], ids=["closed", "open"])
def test_a_dual_has_means(surface):
    mesh = sm.dual(surface.with_data(label=np.full(surface.n_vertices, 7)))
    assert_allclose(mesh.data["height"], mesh.vertices[:, 2], atol=1e-12)
    assert (mesh.data["label"] == 7).all()
    small = sm.decimate(surface, vertices=60).mesh
    assert np.corrcoef(small.data["height"], small.vertices[:, 2])[0, 1] > 0.9


def test_a_selection_and_a_union_of_clouds():
    upper = CLOUD.selected(CLOUD.points[:, 2] > 0)
    lower = CLOUD.selected(np.flatnonzero(CLOUD.points[:, 2] <= 0)).with_data(colors=None)
    with pytest.warns(SimplexMeshWarning, match="arrays that not all parts have were left out: colors$"):
        both = sm.PointCloud.joined([upper.with_data(metric=upper.points), lower])
    assert sorted(both.data) == ["height", "label"]
    assert both.unit == "mm"
    assert_array_equal(both.data["height"], both.points[:, 2])
    assert_allclose(both.normals, CLOUD.normals[both.data["label"]], atol=1e-15)
    with pytest.raises(ValueError, match="clouds must have one unit, not m and mm: use in_unit"):
        sm.PointCloud.joined([upper.with_data(colors=None), lower.in_unit("m")])
    with pytest.raises(ValueError, match="data 'label' must have the same shape in all parts"):
        sm.PointCloud.joined([upper.with_data(colors=None), lower.with_data(label=np.zeros((len(lower), 2)))])


def test_duplicates_keep_the_data_of_the_first():
    twice = sm.PointCloud.joined([CLOUD, CLOUD.with_data(label=-np.arange(N))])
    with pytest.warns(SimplexMeshWarning, match="merged"):
        once = twice.merged()
    assert_array_equal(once.data["label"], np.arange(N))
    rows = SURFACE.faces.ravel()
    soup = sm.TriangleMesh(SURFACE.vertices[rows], np.arange(len(rows)).reshape(-1, 3), {"row": rows}, "m")
    welded = soup.welded(report=False)
    assert welded.unit == "m"
    assert_array_equal(welded.vertices, SURFACE.vertices[welded.data["row"]])


def test_samples_and_divisions_interpolate():
    sample = SURFACE.sampled(500, rng=0)
    assert_allclose(sample.data["height"], sample.points[:, 2], atol=1e-12)
    fine = sm.divided(SURFACE, 0.2)
    assert fine.n_vertices > SURFACE.n_vertices
    assert_allclose(fine.data["height"], fine.vertices[:, 2], atol=1e-12)
    assert fine.unit == "mm"


@pytest.mark.parametrize("method", ["fan", "dual"])
@pytest.mark.parametrize("mesh", [MESH, sm.cylinder(9, 4)], ids=["closed", "open"])
def test_a_triangulation_has_the_data_of_its_vertices_and_means_at_the_centers_of_faces(method, mesh):
    surface = mesh.with_data(height=mesh.vertices[:, 2]).triangulated(method)
    assert_allclose(surface.data["height"], surface.vertices[:, 2], atol=1e-12)
    assert surface.unit == mesh.unit


def test_operators_keep_the_unit():
    assert sm.decimate(MESH, vertices=100).mesh.unit == "mm"
    assert sm.remove_face(MESH, 0).mesh.unit == "mm"
    assert sm.dual(SURFACE).unit == "mm"
    assert sm.clipped(SURFACE, (0, 0, 0), (0, 0, 1)).unit == "mm"


def test_read_only_arrays_of_the_caller_are_copied_and_ours_are_shared():
    mine = np.zeros(N)
    mine.setflags(write=False)
    cloud = sm.PointCloud(BALL.vertices, data={"mine": mine})
    mine.setflags(write=True)
    mine[0] = 99
    assert not cloud.data["mine"].any()
    assert cloud.scaled(2).data["mine"] is cloud.data["mine"]
