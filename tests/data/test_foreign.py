"""Objects of other libraries: taken as they are, and made of ours, with arrays that can be written to."""

from __future__ import annotations

import gzip
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.data.conversion import as_data, as_points, as_triangles, as_volume
from simplexmesh.motion.reconstruct.conversion import are_scans

RNG = np.random.default_rng(0)
BALL = sm.sphere(4).triangulated()
N = BALL.n_vertices
COLORS = RNG.integers(0, 255, (N, 3)).astype(np.uint8)
SURFACE = BALL.with_data(colors=COLORS, heat=BALL.vertices[:, 2]).in_unit("mm", "mm")
CLOUD = sm.PointCloud(SURFACE.vertices, SURFACE.vertex_normals, SURFACE.data, "mm")


def of(library, **attributes):
    """An object whose class says that it is of a library that may not be installed."""
    return type("TriangleMesh", (SimpleNamespace,), {"__module__": f"{library}.some.where"})(**attributes)


class TestTrimesh:
    def test_there_and_back(self):
        made = SURFACE.to_trimesh()
        found = as_triangles(made)
        assert_array_equal(found.vertices, SURFACE.vertices)
        assert_array_equal(found.faces, SURFACE.faces)
        assert found.unit == "mm"
        assert_array_equal(found.data["colors"], COLORS)
        assert_array_equal(found.data["heat"], SURFACE.data["heat"])
        points = as_points(CLOUD.to_trimesh())
        assert_array_equal(points.points, CLOUD.points)
        assert_array_equal(points.data["colors"], COLORS)

    def test_what_it_gets_can_be_written_to(self):
        made = SURFACE.to_trimesh()
        made.vertices += 1
        made.visual.vertex_colors[:] = 0
        made.vertex_attributes["heat"][:] = 0
        made.process()
        assert SURFACE.data["heat"].any()

    def test_a_scene_is_all_that_it_shows(self):
        scene = trimesh.Scene()
        place = np.diag([2.0, 2, 2, 1])
        place[:3, 3] = 10, 0, 0
        scene.add_geometry(SURFACE.to_trimesh())
        scene.add_geometry(SURFACE.to_trimesh(), transform=place)
        found = as_triangles(scene)
        assert found.n_components == 2
        assert found.volume == pytest.approx(9 * SURFACE.volume)
        assert_array_equal(found.data["colors"], np.concatenate([COLORS, COLORS]))
        with pytest.raises(ValueError, match="data must hold a surface or points, the scene is empty"):
            as_data(trimesh.Scene())

    def test_faces_with_colors_color_their_vertices(self):
        box = trimesh.creation.box()
        box.visual.face_colors = [10, 20, 30, 255]
        assert_array_equal(as_data(box).data["colors"], [[10, 20, 30]] * 8)

    def test_a_texture_colors_the_vertices(self):
        image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), (10, 20, 30))
        box = trimesh.creation.box()
        box.visual = trimesh.visual.TextureVisuals(uv=np.full((8, 2), 0.5), image=image)
        assert_array_equal(as_data(box).data["colors"], [[10, 20, 30]] * 8)

    def test_opacity_is_kept_where_there_is_some(self):
        seen = np.hstack([COLORS, np.full((N, 1), 9, np.uint8)])
        made = trimesh.Trimesh(BALL.vertices, BALL.faces, vertex_colors=seen, process=False)
        assert_array_equal(as_data(made).data["colors"], seen)

    def test_curves_are_refused(self):
        with pytest.raises(TypeError, match=r"data must be a Volume, .*, not trimesh.Path3D"):
            as_data(trimesh.load_path(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 1.0]])))


class TestOpen3D:
    def test_a_mesh_as_it_was_and_in_tensors(self):
        shares = COLORS / 255
        old = of("open3d", vertices=BALL.vertices, triangles=BALL.faces.astype(np.int32), vertex_colors=shares)
        self.check(as_triangles(old))
        assert sm.dual(old).genus == 0

        def tensor(values):
            return SimpleNamespace(cpu=lambda: SimpleNamespace(numpy=lambda: np.asarray(values)))

        table = {"positions": tensor(BALL.vertices), "colors": tensor(shares), "heat": tensor(BALL.vertices[:, 2:])}
        new = as_triangles(of("open3d", vertex=table, triangle={"indices": tensor(BALL.faces)}))
        self.check(new)
        assert_array_equal(new.data["heat"], BALL.vertices[:, 2])
        points = as_points(of("open3d", points=BALL.vertices, normals=BALL.vertex_normals, colors=shares))
        assert_allclose(points.normals, BALL.vertex_normals, atol=1e-15)
        assert_array_equal(points.data["colors"], COLORS)

    def check(self, found):
        assert_array_equal(found.vertices, BALL.vertices)
        assert_array_equal(found.faces, BALL.faces)
        assert_array_equal(found.data["colors"], COLORS)

    def test_the_real_one_there_and_back(self):
        pytest.importorskip("open3d")
        for thing in (SURFACE, CLOUD):
            made = thing.to_open3d()
            for shown in (made, made.to_legacy()):
                found = as_data(shown)
                assert type(found) is type(thing)
                assert_array_equal(np.asarray(as_points(found)), np.asarray(as_points(thing)))
                assert_array_equal(found.data["colors"], COLORS)
            assert_array_equal(as_data(made).data["heat"], SURFACE.data["heat"])

    def test_without_it_one_sentence(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "open3d", None)
        with pytest.raises(ImportError, match=r"^this needs Open3D: pip install open3d$"):
            sm.sphere(2).to_open3d()

    def test_what_has_our_name_is_called_by_its_library(self):
        stranger = of("open3d", lines=())
        with pytest.raises(TypeError, match=r"not open3d.TriangleMesh$"):
            as_data(stranger)
        with pytest.raises(TypeError, match=r"mesh must be a SimplexMesh, not open3d.TriangleMesh$"):
            sm.regularize(stranger)
        with pytest.raises(TypeError, match=r"have both, not open3d.TriangleMesh$"):
            sm.dual(stranger)
        with pytest.raises(TypeError, match=r"a path to them, not open3d.TriangleMesh$"):
            sm.curvature(stranger)
        with pytest.raises(TypeError, match=r"volume must be a volume, not trimesh.Trimesh read as TriangleMesh"):
            as_volume(SURFACE.to_trimesh())
        with pytest.raises(TypeError, match=r"not __main__.TriangleMesh$"):
            as_data(type("TriangleMesh", (), {"__module__": "__main__"})())


class TestImages:
    VALUES = RNG.random((3, 4, 5))

    def test_of_simpleitk(self):
        import SimpleITK

        image = SimpleITK.GetImageFromArray(self.VALUES.T)
        image.SetSpacing((1, 2, 3))
        image.SetOrigin((5, 6, 7))
        image.SetDirection((0, -1, 0, 1, 0, 0, 0, 0, 1))
        found = as_volume(image)
        image.SetPixel(0, 0, 0, 99.0)
        assert_array_equal(found.values, self.VALUES)
        assert_allclose(found.to_world([1, 2, 3]), image.TransformIndexToPhysicalPoint((1, 2, 3)))
        with pytest.raises(ValueError, match="data must hold one number per voxel, not 3"):
            as_data(SimpleITK.Image((4, 4, 4), SimpleITK.sitkVectorUInt8, 3))

    def test_of_nibabel_lie_where_their_files_lie(self, tmp_path):
        nibabel = pytest.importorskip("nibabel")
        affine = np.array([[0, -2, 0, 5], [1, 0, 0, 6], [0, 0, 3, 7], [0, 0, 0, 1.0]])
        image = nibabel.Nifti1Image(self.VALUES[..., None], affine)
        image.header.set_xyzt_units("meter")
        nibabel.save(image, tmp_path / "a.nii")
        found, read = as_volume(image), sm.read(tmp_path / "a.nii")
        assert found.unit == read.unit == "mm"
        assert_allclose(found.T_world_index, read.T_world_index, rtol=1e-5)
        assert_allclose(found.values, read.values)


class TestGifti:
    def made(self, *, encoding="GIFTI_ENCODING_B64GZ", heat=SURFACE.data["heat"]):
        """A surface in RAS, as programs of the NIfTI family write it, with an array of its vertices and one of none."""
        gifti = pytest.importorskip("nibabel.gifti")
        content = ("POINTSET", BALL.vertices * (-1, -1, 1)), ("TRIANGLE", BALL.faces), ("SHAPE", heat), ("NONE", [1.0])
        arrays = [
            gifti.GiftiDataArray(
                np.asarray(values, "i4" if kind == "TRIANGLE" else "f4"),
                f"NIFTI_INTENT_{kind}",
                encoding=encoding,
                meta={"Name": "heat"} if kind == "SHAPE" else {},
            )
            for kind, values in content
        ]
        return gifti.GiftiImage(darrays=arrays)

    def check(self, found):
        assert_allclose(found.vertices, BALL.vertices, atol=1e-6)
        assert_array_equal(found.faces, BALL.faces)
        assert found.unit == "mm"
        assert found.data.keys() == {"heat"}
        assert_allclose(found.data["heat"], SURFACE.data["heat"], atol=1e-6)

    @pytest.mark.parametrize("name", ["a.gii", "a.surf.gii", "a.surf.gii.gz"])
    def test_surfaces_and_their_files_lie_where_images_do(self, name, tmp_path):
        made = self.made()
        made.to_filename(tmp_path / name)
        self.check(as_triangles(made))
        self.check(sm.read(tmp_path / name))

    def test_without_a_surface_they_are_refused(self, tmp_path):
        made = self.made()
        del made.darrays[1]
        made.to_filename(tmp_path / "a.gii")
        for given, name in ((made, "data"), (tmp_path / "a.gii", "a.gii")):
            with pytest.raises(ValueError, match=f"^{name} must hold points and triangles, it does not$"):
                as_data(given)

    def test_damage_is_told_and_what_unpacks_to_much_more_than_the_file(self, tmp_path):
        self.made().to_filename(tmp_path / "a.gii")
        whole = (tmp_path / "a.gii").read_bytes()
        (tmp_path / "a.gii").write_bytes(whole[: len(whole) // 2])
        self.made(heat=np.zeros(3_000_000)).to_filename(tmp_path / "b.gii")
        text = self.made(heat=np.zeros(300_000), encoding="GIFTI_ENCODING_ASCII").to_bytes()
        (tmp_path / "c.gii.gz").write_bytes(gzip.compress(text + b" " * 4_000_000))
        (tmp_path / "d.gii").write_bytes(whole.replace(b'Dimensionality="2"', b'Dimensionality="999999999999"'))
        for name in ("a.gii", "b.gii", "c.gii.gz", "d.gii"):
            with pytest.raises(OSError, match=f"^{name} is damaged, or its arrays are in other files$"):
                sm.read(tmp_path / name)

    def test_without_nibabel_one_sentence(self, tmp_path, monkeypatch):
        self.made().to_filename(tmp_path / "a.gii")
        monkeypatch.setitem(sys.modules, "nibabel", None)
        with pytest.raises(ImportError, match=r"^this needs nibabel: pip install nibabel$"):
            sm.read(tmp_path / "a.gii")


class TestTables:
    @pytest.mark.parametrize("names", [None, list("abc")])
    def test_a_frame_of_three_columns_is_an_array(self, names):
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame(CLOUD.points, columns=names)
        found = as_points(frame)
        assert_array_equal(found.points, CLOUD.points)
        assert not found.data
        with pytest.raises(ValueError, match=r"three of numbers, not \w, \w, \w, 3$"):
            as_points(frame.assign(**{"3": 1.0}))
        with pytest.raises(ValueError, match="three of numbers"):
            as_points(frame.astype(str))

    def test_frames(self):
        pandas = pytest.importorskip("pandas")
        rows = {"X": [0, 1, 0, 0], "Y": [0, 0, 1, 0], "Z": [0, 0, 0, 1], "nx": 1.0, "ny": 0.0, "nz": 0.0}
        frame = pandas.DataFrame(rows | {"red": [9] * 4, "green": 8, "blue": 7, "depth": range(4), "name": "n"})
        found = as_points(frame)
        assert_array_equal(found.points, np.vstack([np.zeros(3), np.eye(3)]))
        assert_array_equal(found.normals, [[1, 0, 0]] * 4)
        assert found.data["colors"].dtype == np.uint8
        assert found.data["colors"].tolist() == [[9, 8, 7]] * 4
        assert sorted(found.data) == ["colors", "depth"]
        with pytest.raises(ValueError, match="data must have columns x, y and z, or three of numbers, not nx, red"):
            as_data(frame[["nx", "red"]])
        with pytest.raises(ValueError, match="points must be finite; 1 of 4"):
            as_data(frame.assign(X=[np.nan, 1, 2, 3]))
        for column in ("X", "nx"):
            with pytest.raises(ValueError, match=r"data must have numbers in its columns x, y and z, and in nx, "):
                as_data(frame.assign(**{column: "n" * 400}))

    def test_meshio(self):
        meshio = pytest.importorskip("meshio")
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4]]
        cells = [("quad", sides), ("triangle", [[1, 5, 7], [1, 7, 3]]), ("line", [[0, 1]])]
        found = as_triangles(meshio.Mesh(corners, cells, point_data={"heat": corners[:, 2]}))
        assert found.is_closed
        assert found.volume == pytest.approx(1)
        assert_array_equal(found.data["heat"], found.vertices[:, 2])
        assert len(as_points(meshio.Mesh(corners, [("vertex", [[0]])]))) == 8
        with pytest.raises(TypeError, match="data must be a surface of triangles or polygons, not cells of tetra"):
            as_data(meshio.Mesh(corners, [("tetra", [[0, 1, 2, 4]])]))


def test_scans_may_be_of_other_libraries():
    assert are_scans([CLOUD.to_trimesh(), CLOUD.to_pyvista()])
    assert not are_scans([3, 3])


def test_measurements_take_them_with_all_their_points():
    made = SURFACE.to_trimesh()
    assert_array_equal(sm.curvature(made, method="taubin").mean, sm.curvature(SURFACE, method="taubin").mean)
