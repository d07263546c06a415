"""Files read back as they were written; writing is atomic."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
import pytest
import pyvista
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.data.conversion import as_data, as_volume
from simplexmesh.data.io import writing
from simplexmesh.data.io.ply import write_ply
from simplexmesh.data.io.polydata import Polygons, write_vtp
from simplexmesh.data.io.writing import to_pyvista, write

ROUGH = np.random.default_rng(0)


def roughened(mesh):
    """No coordinate a round number, so that lost digits show."""
    return mesh.moved(mesh.vertices * (1 + 0.01 * ROUGH.random(mesh.vertices.shape)))


def meshes():
    ball = sm.sphere(3)
    opened = sm.SimplexMesh(
        ball.vertices, sm.Connectivity(ball.connectivity.twin, ball.connectivity.face_darts[[0, 40]])
    )
    return {"closed": ball, "holes": opened, "plane": sm.plane(), "torus": sm.torus()}


@pytest.fixture(params=["closed", "holes", "plane", "torus"])
def mesh(request):
    return roughened(meshes()[request.param])


def assert_identical(a, b):
    assert_array_equal(a.vertices.view(np.int64), b.vertices.view(np.int64))
    assert_array_equal(a.connectivity.twin, b.connectivity.twin)
    assert_array_equal(a.connectivity.hole_darts, b.connectivity.hole_darts)
    assert list(a.data) == list(b.data)
    for name in a.data:
        assert a.data[name].dtype == b.data[name].dtype
        assert_array_equal(a.data[name], b.data[name])


class TestVtp:
    def test_a_simplex_mesh_comes_back_identical(self, mesh, tmp_path):
        n = mesh.n_vertices
        mesh = mesh.with_data(
            rigidity=ROUGH.random(n),
            constraint=ROUGH.random(n) > 0.5,
            metric=ROUGH.random((n, 3)),
            frame=ROUGH.random((n, 3, 3)).astype(np.float32),
            label=ROUGH.integers(0, 9, n).astype(np.uint16),
            big=ROUGH.integers(-(2**62), 2**62, n),
            half=ROUGH.random(n).astype(np.float16),
            twin=np.full(n, np.nan),
        )
        mesh.save(tmp_path / "mesh.vtp")
        again = sm.read(tmp_path / "mesh.vtp")
        assert_identical(again, mesh)
        assert again.n_holes == mesh.n_holes

    @given(
        hnp.arrays(np.float64, (20, 3), elements=st.floats(allow_nan=False, allow_infinity=False, width=64)),
        hnp.arrays(hnp.scalar_dtypes().filter(lambda t: t.kind in "biuf" and t.itemsize <= 8), (20, 2)),
    )
    def test_any_numbers_survive(self, tmp_path_factory, vertices, extra):
        mesh = (
            sm.sphere(1)
            .moved(vertices[: sm.sphere(1).n_vertices])
            .with_data(extra=extra.astype(extra.dtype.newbyteorder("=")))
        )
        path = tmp_path_factory.mktemp("any") / "mesh.vtp"
        mesh.save(path)
        assert_identical(sm.read_mesh(path), mesh)

    def test_vtk_sees_the_polygons_and_the_arrays(self, mesh, tmp_path):
        import pyvista

        mesh.with_data(rigidity=np.arange(mesh.n_vertices)).save(tmp_path / "mesh.vtp")
        seen = pyvista.read(tmp_path / "mesh.vtp")
        assert seen.n_cells == mesh.n_faces
        for i in (0, mesh.n_faces - 1):
            assert_array_equal(seen.get_cell(i).point_ids, mesh.faces[i])
        assert_array_equal(seen.point_data["rigidity"], np.arange(mesh.n_vertices))

    def test_damaged_topology_is_seen(self, mesh, tmp_path):
        dataset = to_pyvista(mesh)
        dataset.field_data["simplexmesh_twin"] = np.arange(7)
        dataset.save(tmp_path / "mesh.vtp")
        with pytest.raises(OSError, match=r"mesh.vtp is a simplex mesh with damaged topology"):
            sm.read(tmp_path / "mesh.vtp")

    def test_pyvista_objects_come_back_too(self, mesh):
        assert_identical(as_data(mesh.to_pyvista()), mesh)


@pytest.mark.parametrize("ending", [".ply", ".obj", ".off"])
class TestPolygonFormats:
    def test_polygons_with_all_digits(self, ending, mesh, tmp_path):
        write(tmp_path / f"mesh{ending}", mesh)
        again = sm.read_triangles(tmp_path / f"mesh{ending}")
        digits = {".obj": 1e-6}.get(ending, 0)  # VTK reads OBJ in single precision
        assert_allclose(np.sort(again.vertices, axis=0), np.sort(mesh.vertices, axis=0), rtol=digits, atol=digits)
        assert again.n_faces == sum(len(face) - 2 for face in mesh.faces)
        assert again.is_closed == (mesh.n_holes == 0)

    @pytest.mark.parametrize("scale", [1.0, 1e-6])
    def test_polygons_far_from_flat(self, ending, scale, tmp_path):
        ball = sm.sphere(4)
        rugged = ball.moved(scale * (ball.vertices + np.random.default_rng(0).normal(0, 0.15, ball.vertices.shape)))
        write(tmp_path / f"mesh{ending}", rugged)
        again = sm.read(tmp_path / f"mesh{ending}")
        assert again.is_closed
        assert again.n_faces == sum(len(face) - 2 for face in rugged.faces)

    def test_triangles(self, ending, tmp_path):
        import trimesh

        ball = sm.sphere(3).triangulated("dual")
        write(tmp_path / f"ball{ending}", ball)
        again = sm.read(tmp_path / f"ball{ending}")
        other = trimesh.load(tmp_path / f"ball{ending}", process=False)
        assert_allclose(other.vertices, ball.vertices, rtol=1e-12)
        assert_array_equal(other.faces, ball.faces)
        assert_allclose(again.vertices, ball.vertices, atol=1e-6)
        assert_array_equal(again.faces, ball.faces)


@pytest.mark.parametrize("ending", [".ply", ".obj"])  # VTK does not read OFF
def test_other_programs_see_the_polygons(ending, mesh, tmp_path):
    import pyvista

    write(tmp_path / f"mesh{ending}", mesh)
    seen = pyvista.read(tmp_path / f"mesh{ending}")
    assert seen.n_cells == mesh.n_faces
    for i in (0, mesh.n_faces // 2, mesh.n_faces - 1):
        assert_allclose(seen.get_cell(i).points, mesh.vertices[mesh.faces[i]], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("ending", ["stl", "glb"])
def test_rounding_to_single_precision_is_reported(ending, tmp_path):
    ball = sm.sphere(4)
    with pytest.warns(sm.SimplexMeshWarning, match=rf"^{ending.upper()} has single precision, .* by up to 0\.\d+; VTP"):
        ball.moved(ball.vertices + 4e6).save(tmp_path / f"far.{ending}")
    with pytest.raises(ValueError, match=rf"^path must not end with \.{ending}, .*, for vertices at 9\.\d+e\+159$"):
        ball.moved(ball.vertices * 1e160).save(tmp_path / f"huge.{ending}")
    for lost in (ball.vertices * 1e-47, 1e-3 * ball.vertices + 1e6):
        with pytest.raises(
            ValueError, match=rf"^path must not end with \.{ending}, whose .* cannot tell these vertices apart"
        ):
            ball.moved(lost).save(tmp_path / f"lost.{ending}")
    assert [path.name for path in tmp_path.iterdir()] == [f"far.{ending}"]


def test_stl_keeps_the_triangles_in_single_precision(mesh, tmp_path):
    write(tmp_path / "mesh.stl", mesh)
    again = sm.read(tmp_path / "mesh.stl")
    fan = mesh.triangulated()
    assert again.n_faces == fan.n_faces
    assert again.area == pytest.approx(fan.area, rel=1e-5)
    assert again.is_closed == fan.is_closed


@pytest.mark.parametrize("ending", [".ply", ".vtp", ".xyz"])
@pytest.mark.parametrize("oriented", [True, False])
def test_points(ending, oriented, tmp_path):
    points = ROUGH.normal(size=(50, 3))
    cloud = sm.PointCloud(points, points if oriented else None)
    write(tmp_path / f"cloud{ending}", cloud)
    again = sm.read(tmp_path / f"cloud{ending}")
    assert_array_equal(again.points, points)
    assert (again.normals is None) is not oriented
    if oriented:
        assert_allclose(again.normals, cloud.normals, atol=1e-15)


def test_faces_of_more_corners_than_a_byte_counts(tmp_path):
    tube = sm.cylinder()
    big = max(len(face) for face in tube.faces)
    angles = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    content = Polygons(ring, np.array([300]), np.arange(300))
    write_ply(tmp_path / "ring.ply", content)
    assert sm.read(tmp_path / "ring.ply").n_faces == 298
    assert big < 300


class TestPyvista:
    def test_polygons_without_the_holes(self, mesh):
        seen = mesh.to_pyvista()
        assert seen.n_cells == mesh.n_faces
        assert_array_equal(seen.points, mesh.vertices)
        assert seen.area == pytest.approx(mesh.triangulated().area, rel=0.02)

    def test_points_and_triangles(self):
        ball = sm.sphere(3).triangulated("dual")
        assert to_pyvista(ball).is_manifold
        assert to_pyvista(ball.sampled(10, rng=0)).n_points == 10


class TestRefusals:
    @pytest.mark.parametrize(
        ("name", "value", "error", "message"),
        [
            (
                "a.xyzzy",
                sm.sphere(2),
                ValueError,
                r"path must end with one of .vtp, .ply, .obj, .off, .stl, .xyz, .*, .3mf, not .xyzzy",
            ),
            ("a", sm.sphere(2), ValueError, "path must end with one of .*, not nothing"),
            ("no/a.vtp", sm.sphere(2), FileNotFoundError, "path must be in an existing folder, .*no' is not one"),
            (
                "a.vtp",
                np.zeros((3, 3)),
                TypeError,
                "value must be a SimplexMesh, TriangleMesh or PointCloud, not ndarray",
            ),
            ("a.stl", sm.PointCloud(np.eye(4)[:, :3]), ValueError, "must end with one of .*.e57 for points"),
            ("folder.vtp", sm.sphere(2), IsADirectoryError, "path must be a file"),
        ],
    )
    def test_one_sentence(self, name, value, error, message, tmp_path):
        (tmp_path / "folder.vtp").mkdir()
        with pytest.raises(error, match=message):
            write(tmp_path / name, value)
        assert [p.name for p in tmp_path.iterdir()] == ["folder.vtp"]

    @pytest.mark.parametrize("call", [lambda: write(3, sm.sphere(2)), lambda: sm.read_poses(3), lambda: sm.read(3)])
    def test_of_paths(self, call):
        with pytest.raises(TypeError, match=r"^path must be a string or a Path, not int$"):
            call()

    @pytest.mark.parametrize("ending", [".vtp", ".ply", ".obj", ".off", ".stl", ".xyz"])
    def test_nothing_is_half_written(self, ending, tmp_path, monkeypatch):
        path = tmp_path / f"mesh{ending}"
        path.write_text("precious")

        def failing(part, content):
            part.write_text("half")
            raise OSError("disk full")

        monkeypatch.setitem(writing.FORMATS, ending, writing.FORMATS[ending]._replace(write=failing))
        with pytest.raises(OSError, match="disk full"):
            write(path, sm.sphere(2))
        assert [p.name for p in tmp_path.iterdir()] == [path.name]
        assert path.read_text() == "precious"

    def test_vtk_cannot_write(self, tmp_path):
        with pytest.raises(OSError, match="the file cannot be written"):
            write_vtp(tmp_path / "no" / "a.vtp", Polygons.of(sm.sphere(2)))


class TestNamesOfArrays:
    @pytest.mark.parametrize("name", ["k1 & k2", "<H>", 'the "best"', "it's", "a\nb\tc\rd", "a&amp;b", " ", "µ²"])
    def test_any_printable_name_is_kept(self, name, tmp_path):
        ball = sm.sphere(2)
        values = np.arange(80.0)
        sm.SimplexMesh(ball.vertices, ball.connectivity, {name: values}).save(tmp_path / "a.vtp")
        again = sm.read_mesh(tmp_path / "a.vtp")
        assert list(again.data) == [name]
        assert_array_equal(again.data[name], values)

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            ({"": np.ones(80)}, "arrays must have printable names to be saved as VTP, not ''"),
            ({"a\1": np.ones(80)}, "arrays must have printable names to be saved as VTP, not"),
            ({"none": np.ones((80, 0))}, r"array 'none' must have columns to be saved as VTP, not shape \(80, 0\)"),
        ],
    )
    def test_what_vtp_cannot_hold_is_refused(self, data, message, tmp_path):
        ball = sm.sphere(2)
        with pytest.raises(ValueError, match=message):
            sm.SimplexMesh(ball.vertices, ball.connectivity, data).save(tmp_path / "a.vtp")
        assert not list(tmp_path.iterdir())


class TestPolygonsThatAFilterHasChanged:
    def changed(self, filtered):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            out = as_data(filtered)
        assert any("are no longer those of the simplex mesh they were" in str(each.message) for each in caught)
        return out

    def test_clipped(self):
        half = self.changed(sm.sphere(6).to_pyvista().clip("z"))
        assert isinstance(half, sm.TriangleMesh)
        assert half.n_borders == 1

    def test_faces_removed(self):
        seen = sm.sphere(6).to_pyvista()
        part = pyvista.PolyData.from_irregular_faces(seen.points, seen.irregular_faces[:100])
        part.field_data.update(seen.field_data)
        assert self.changed(part).n_borders >= 1

    def test_turned_inside_out(self):
        seen = sm.sphere(6).to_pyvista()
        seen.SetPolys(pyvista.CellArray.from_irregular_cells([face[::-1] for face in seen.irregular_faces]))
        assert self.changed(seen).volume < 0

    def test_moved(self):
        ball = sm.sphere(6)
        seen = ball.to_pyvista()
        seen.points *= 2
        assert_array_equal(as_data(seen).vertices, 2 * ball.vertices)
        assert_array_equal(as_data(seen).connectivity.twin, ball.connectivity.twin)


class TestExistingFiles:
    @pytest.mark.parametrize("ending", [".vtp", ".ply", ".stl"])
    def test_the_target_of_a_link_is_replaced_not_the_link(self, ending, tmp_path):
        (tmp_path / "store").mkdir()
        target, link = tmp_path / "store" / "part.1", tmp_path / f"a{ending}"
        link.symlink_to(Path("store", "part.1"))
        for size in (6, 7):  # before and after the target exists
            sm.sphere(size).save(link)
            assert link.is_symlink()
            sm.sphere(size).save(tmp_path / f"b{ending}")
            assert target.read_bytes() == (tmp_path / f"b{ending}").read_bytes()
        assert sorted(path.name for path in tmp_path.rglob("*")) == [link.name, f"b{ending}", "part.1", "store"]

    @pytest.mark.parametrize("ending", [".vtp", ".ply", ".xyz"])
    @pytest.mark.parametrize("mode", [0o600, 0o640, 0o666, 0o444])
    def test_permissions_are_kept(self, ending, mode, tmp_path):
        path = tmp_path / f"a{ending}"
        sm.sphere(6).save(path)
        path.chmod(mode)
        sm.sphere(7).save(path)
        assert path.stat().st_mode & 0o777 == mode
        assert len(sm.read_points(path)) == sm.sphere(7).n_vertices

    def test_links_to_nowhere_devices_and_folders_are_refused(self, tmp_path):
        (tmp_path / "lost.ply").symlink_to(tmp_path / "missing" / "a.ply")
        os.mkfifo(tmp_path / "pipe")
        (tmp_path / "piped.ply").symlink_to("pipe")
        (tmp_path / "folder.ply").symlink_to(tmp_path)
        for name, message in (
            ("lost", "path must be in an existing folder"),
            ("piped", "path must be a regular file, '.*piped.ply' is a pipe or a device"),
            ("folder", "path must be a file, '.*folder.ply' is a folder"),
        ):
            with pytest.raises(OSError, match=message):
                sm.sphere(6).save(tmp_path / f"{name}.ply")
            assert (tmp_path / f"{name}.ply").is_symlink()


class TestVolumes:
    VOLUME = sm.Volume(
        np.random.default_rng(0).integers(0, 900, (4, 5, 6)).astype(np.int16),
        spacing=(1, 2, 2.5),
        origin=(10, -3, 4),
        direction=[[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    )

    @pytest.mark.parametrize("ending", [".mha", ".nrrd", ".nii", ".nii.gz", ".vti", ".MHA", ".NII.GZ", ".VTI"])
    def test_come_back_where_they_were(self, ending, tmp_path):
        self.VOLUME.save(tmp_path / f"a{ending}")
        assert [path.name for path in tmp_path.iterdir()] == [f"a{ending}"]
        again = sm.read(tmp_path / f"a{ending}")
        assert_array_equal(again.values, self.VOLUME.values)
        assert again.values.dtype == np.int16
        np.testing.assert_allclose(again.T_world_index, self.VOLUME.T_world_index, atol=1e-6)

    def test_of_pyvista_are_the_same(self):
        again = as_volume(self.VOLUME.to_pyvista())
        assert_array_equal(again.values, self.VOLUME.values)
        np.testing.assert_allclose(again.T_world_index, self.VOLUME.T_world_index, atol=1e-12)

    def test_what_pyvista_changes_is_its_own(self):
        before = self.VOLUME.values.copy()
        self.VOLUME.to_pyvista().point_data["values"][:] = -1
        assert_array_equal(self.VOLUME.values, before)

    def test_in_formats_of_surfaces_are_refused(self, tmp_path):
        with pytest.raises(ValueError, match=r"^path must end with one of .mha, .nrrd, .nii, .nii.gz, .vti for a vol"):
            self.VOLUME.save(tmp_path / "a.ply")
        with pytest.raises(ValueError, match=r"^path must end with one of .vtp, "):
            sm.PointCloud(np.eye(4)[:, :3]).save(tmp_path / "a.nii")


def test_all_data_move_and_measure_alike(tmp_path):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], (5, 6, 7)
    surface = sm.sphere(5).triangulated()
    for value in (TestVolumes.VOLUME, sm.sphere(5), surface, sm.PointCloud(surface.vertices, surface.vertex_normals)):
        moved = value.transformed(T)
        assert type(moved) is type(value)
        assert moved.diagonal == pytest.approx(value.diagonal)
        np.testing.assert_allclose(np.sort(np.ptp(moved.bounds, axis=0)), np.sort(np.ptp(value.bounds, axis=0)))
        assert moved.to_pyvista().n_points == value.to_pyvista().n_points > 0
        np.testing.assert_allclose(moved.bounds.mean(axis=0), T[:3, :3] @ value.bounds.mean(axis=0) + T[:3, 3])
    with pytest.raises(ValueError, match="T_target_source must keep the orientation of a simplex mesh"):
        sm.sphere(5).transformed(np.diag([-1.0, 1, 1, 1]))
