"""Reading of all file formats, with physical space."""

from __future__ import annotations

import json

import numpy as np
import pytest
import SimpleITK as sitk
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.conversion import as_volume
from simplexmesh.data.io.pcd import decompressed
from simplexmesh.data.io.range_grid import grid_faces, grid_normals
from simplexmesh.data.poses import rigid
from tests.data.io.reference import lzf_compressed, lzf_decompressed

SPACING = (0.7, 1.1, 2.5)
ORIGIN = (-12.0, 34.0, 5.5)
TURNED = Rotation.from_euler("zxy", [0.3, -0.4, 0.2]).as_matrix()


@pytest.fixture
def image():
    """An anisotropic, turned and shifted image, every sample of it different."""
    values = np.arange(7 * 6 * 5, dtype=np.int16).reshape(5, 6, 7)
    image = sitk.GetImageFromArray(values)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(TURNED.reshape(-1).tolist())
    return image


def assert_lies_as(volume, image, atol=1e-4):
    """Every sample is where ITK says, by its value."""
    assert volume.shape == image.GetSize()
    for ijk in np.ndindex(volume.shape):
        assert volume.values[ijk] == image[ijk]
    for ijk in ([0.0, 0, 0], [6.0, 5, 4], [1.25, 3.5, 0.75]):
        assert_allclose(volume.to_world(ijk), image.TransformContinuousIndexToPhysicalPoint(ijk), atol=atol)
        assert_allclose(volume.to_index(image.TransformContinuousIndexToPhysicalPoint(ijk)), ijk, atol=atol)


class TestPhysicalSpace:
    @pytest.mark.parametrize("ending", [".nii", ".nii.gz", ".nrrd", ".nhdr", ".mhd", ".mha"])
    def test_volumes_lie_where_the_file_says(self, image, ending, tmp_path):
        sitk.WriteImage(image, str(tmp_path / f"scan{ending}"))
        assert_lies_as(sm.read(tmp_path / f"scan{ending}"), image)

    @pytest.mark.parametrize("left_handed", [False, True])
    def test_left_handed_images_too(self, image, left_handed, tmp_path):
        image.SetDirection((TURNED * [1, 1, -1 if left_handed else 1]).reshape(-1).tolist())
        sitk.WriteImage(image, str(tmp_path / "scan.nrrd"))
        volume = sm.read_volume(tmp_path / "scan.nrrd")
        assert_lies_as(volume, image)
        assert np.linalg.det(volume.direction) == pytest.approx(-1 if left_handed else 1)

    def test_dicom_series(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3")
        assert_lies_as(sm.read(tmp_path), image)

    def test_a_missing_slice_is_named_and_not_stretched_over(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3")
        (tmp_path / "1.2.3.4.dcm").unlink()  # slice 4 of 5
        message = "has a gap of 5 mm between slices 3 and 4, others 2.5 mm; a slice seems to be missing"
        with pytest.raises(OSError, match=message):
            sm.read(tmp_path)

    def test_a_missing_end_cannot_be_detected(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3")
        (tmp_path / "1.2.3.2.dcm").unlink()  # slice 5 of 5
        assert_lies_as(sm.read(tmp_path), image[:, :, :4])

    def test_distances_that_differ_by_rounding_are_accepted(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3", shift=0.008)
        assert sm.read(tmp_path).shape == (7, 6, 5)

    def test_duplicated_slices_are_named(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3", shift=2.5)
        with pytest.raises(OSError, match="slices seem to be duplicated"):
            sm.read(tmp_path)

    def test_of_several_series_the_longest_is_taken_and_said(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3")
        write_series(image[:, :, :3], tmp_path, "1.2.4")
        with pytest.warns(SimplexMeshWarning, match="2 DICOM series"):
            assert_lies_as(sm.read(tmp_path), image)

    def test_one_slice_is_no_volume(self, image, tmp_path):
        write_series(image, tmp_path, "1.2.3")
        with pytest.raises(ValueError, match=r"must hold a volume, not one slice \(7, 6, 1\); give the folder"):
            sm.read(tmp_path / "1.2.3.0.dcm")

    def test_vti(self, image, tmp_path):
        import pyvista

        grid = pyvista.ImageData(dimensions=(7, 6, 5), spacing=SPACING, origin=ORIGIN)
        grid.direction_matrix = TURNED
        grid["samples"] = sitk.GetArrayFromImage(image).reshape(-1)
        grid.save(tmp_path / "scan.vti")
        assert_lies_as(sm.read(tmp_path / "scan.vti"), image)

    @pytest.mark.parametrize("place", ["point_data", "cell_data"])
    def test_vti_beside_an_array_of_words(self, place, tmp_path):
        import pyvista

        grid = pyvista.ImageData(dimensions=(4, 5, 6))
        grid.point_data["names"] = [f"sample {i}" for i in range(grid.n_points)]
        grid.save(tmp_path / "words.vti")
        with pytest.raises(ValueError, match=r"words.vti must hold samples, it has none"):
            sm.read(tmp_path / "words.vti")
        samples = getattr(grid, place)
        samples["density"] = np.arange(grid.n_points if place == "point_data" else grid.n_cells)
        grid.save(tmp_path / "a.vti")
        assert sm.read(tmp_path / "a.vti").range == (0, len(samples["density"]) - 1)

    def test_vti_on_cells_and_with_an_extent(self, tmp_path):
        import pyvista

        grid = pyvista.ImageData(dimensions=(7, 6, 5), spacing=SPACING, origin=ORIGIN)
        grid.cell_data["labels"] = np.arange(6 * 5 * 4)
        grid.save(tmp_path / "cells.vti")
        volume = sm.read(tmp_path / "cells.vti")
        assert volume.shape == (6, 5, 4)
        assert_allclose(volume.to_world([2, 1, 3]), grid.cell_centers().points[2 + 6 * (1 + 5 * 3)], rtol=1e-6)
        shifted = pyvista.ImageData(dimensions=(7, 6, 5), spacing=SPACING, origin=ORIGIN)
        shifted.offset = (3, 0, -2)
        shifted["samples"] = np.arange(210)
        assert_allclose(as_volume(shifted).to_world([2, 1, 3]), shifted.points[2 + 7 * (1 + 6 * 3)])

    def test_samples_beside_a_zipped_volume_are_not_mixed_up_with_it(self, image, tmp_path):
        sitk.WriteImage(image, str(tmp_path / "scan.nii.gz"))
        sitk.WriteImage(image * 0, str(tmp_path / "scan.nii"))
        assert_lies_as(sm.read(tmp_path / "scan.nii.gz"), image)

    def test_a_single_volume_of_four_dimensions_is_read_but_a_series_is_refused(self, image, tmp_path):
        sitk.WriteImage(sitk.JoinSeries([image]), str(tmp_path / "one.nii"))
        assert_lies_as(sm.read(tmp_path / "one.nii"), image)
        sitk.WriteImage(sitk.JoinSeries([image, image]), str(tmp_path / "two.nii"))
        with pytest.raises(ValueError, match=r"two.nii must hold one volume of 3 dimensions, not .*\(7, 6, 5, 2\)"):
            sm.read(tmp_path / "two.nii")

    def test_tiff_pages_and_files(self, image, tmp_path):
        sitk.WriteImage(image, str(tmp_path / "stack.tif"))
        volume = sm.read_volume(tmp_path / "stack.tif", spacing=SPACING)
        assert_array_equal(volume.values, sitk.GetArrayFromImage(image).T)
        assert_allclose(volume.spacing, SPACING)
        folder = tmp_path / "slices"
        folder.mkdir()
        for k in range(5):
            sitk.WriteImage(sitk.Cast(image[:, :, k], sitk.sitkUInt16), str(folder / f"slice{k + 7}.tif"))
        (folder / "notes.md").write_text("slice10 comes after slice9")
        assert_array_equal(sm.read(folder).values, volume.values)

    def test_colors_are_not_a_volume(self, image, tmp_path):
        sitk.WriteImage(sitk.Compose(image, image, image), str(tmp_path / "colors.mha"))
        with pytest.raises(ValueError, match=r"colors.mha must hold one number per voxel, not 3"):
            sm.read(tmp_path / "colors.mha")

    def test_the_samples_outlive_the_file_and_the_image(self, image, tmp_path):
        sitk.WriteImage(image, str(tmp_path / "scan.nrrd"))
        volume = sm.read(tmp_path / "scan.nrrd")
        (tmp_path / "scan.nrrd").unlink()
        values = volume.values
        del volume
        junk = [np.full(210, 77, np.int16) for _ in range(500)]
        assert_array_equal(values, sitk.GetArrayFromImage(image).T)
        assert len(junk) == 500


def write_series(image, folder, uid, shift=0.0):
    """Write the slices, the fourth of them moved along the axis of slices."""
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    direction = image.GetDirection()
    for k in range(image.GetSize()[2]):
        one = image[:, :, k]
        off = shift / image.GetSpacing()[2] if k == 3 else 0.0
        place = image.TransformContinuousIndexToPhysicalPoint((0.0, 0.0, k + off))
        tags = {
            "0020|000e": uid,
            "0020|0037": "\\".join(str(direction[i]) for i in (0, 3, 6, 1, 4, 7)),
            "0020|0032": "\\".join(map(str, place)),
            "0020|0013": str(k),
            "0008|0018": f"{uid}.{k + 1}",
            "0008|0060": "CT",
        }
        for tag, value in tags.items():
            one.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{uid}.{(k * 3) % 5}.dcm"))
        writer.Execute(one)


POINTS = np.random.default_rng(0).normal(size=(9, 3)).round(6)
NORMALS = (POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)).round(6)


def rows(*columns, separator=" "):
    return "\n".join(separator.join(map(str, row)) for row in np.hstack(columns).tolist()) + "\n"


class TestText:
    @pytest.mark.parametrize("separator", [" ", ",", ", ", " , ", ";", "\t", "   "])
    @pytest.mark.parametrize("header", ["", "x,y,z,nx,ny,nz\n", "# x y z nx ny nz\n", "//X Y Z Nx Ny Nz\n", "\n"])
    def test_points_and_normals(self, separator, header, tmp_path):
        (tmp_path / "a.xyz").write_text(header + rows(POINTS, NORMALS, separator=separator))
        cloud = sm.read(tmp_path / "a.xyz")
        assert_array_equal(cloud.points, POINTS)
        assert_allclose(cloud.normals, NORMALS, atol=2e-6)

    @pytest.mark.parametrize(
        "text",
        [
            rows(POINTS),
            rows(POINTS)[:-1],
            "9\n" + rows(POINTS),
            "# by hand\n" + rows(POINTS) + "\n\n",
            rows(POINTS).replace("\n", "\r\n"),
            rows(POINTS).replace("\n", " # a point\n"),
            "x y z label\n" + rows(POINTS, np.arange(9)[:, None]),
            "label z y x\n" + rows(np.arange(9)[:, None], POINTS[:, ::-1]),
            rows(POINTS, np.arange(27).reshape(9, 3)),
            "Points:=[\n" + ",\n".join(f"[{x}, {y}, {z}]" for x, y, z in POINTS.tolist()) + "]:\n",
        ],
        ids=["plain", "no end", "count", "comment", "windows", "remarks", "label", "columns", "colors", "maple"],
    )
    def test_points_alone(self, text, tmp_path):
        (tmp_path / "a.txt").write_bytes(text.encode())
        cloud = sm.read(tmp_path / "a.txt")
        assert_array_equal(cloud.points, POINTS)
        assert cloud.normals is None


class TestPcd:
    FIELDS = np.dtype([("x", "<f4"), ("label", "<u2"), ("y", "<f4"), ("z", "<f4"), ("fpfh", "<f4", (3,))])

    def header(self, storage, count):
        return (
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x label y z fpfh\nSIZE 4 2 4 4 4\n"
            f"TYPE F U F F F\nCOUNT 1 1 1 1 3\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\n"
            f"DATA {storage}\n"
        ).encode()

    def table(self):
        table = np.zeros(9, self.FIELDS)
        for j, name in enumerate("xyz"):
            table[name] = POINTS[:, j]
        table["fpfh"] = 7
        table["label"] = np.arange(9)
        return table

    def body(self, storage, table):
        if storage == "ascii":
            return "\n".join(f"{r['x']} {r['label']} {r['y']} {r['z']} 7 7 7" for r in table).encode() + b"\n"
        if storage == "binary":
            return table.tobytes()
        columns = b"".join(np.ascontiguousarray(table[name]).tobytes() for name in table.dtype.names)
        packed = lzf_compressed(columns)
        return len(packed).to_bytes(4, "little") + len(columns).to_bytes(4, "little") + packed

    @pytest.mark.parametrize("storage", ["ascii", "binary", "binary_compressed"])
    def test_all_storages(self, storage, tmp_path):
        (tmp_path / "a.pcd").write_bytes(self.header(storage, 9) + self.body(storage, self.table()))
        assert_allclose(sm.read(tmp_path / "a.pcd").points, POINTS, rtol=1e-6)

    @pytest.mark.parametrize("storage", ["ascii", "binary", "binary_compressed"])
    def test_points_without_depth_are_left_out_and_counted(self, storage, tmp_path):
        table = self.table()
        table["z"][[2, 5]] = np.nan
        (tmp_path / "a.pcd").write_bytes(self.header(storage, 9) + self.body(storage, table))
        with pytest.warns(SimplexMeshWarning, match="a.pcd: left out 2 of 9 points"):
            assert_allclose(sm.read(tmp_path / "a.pcd").points, np.delete(POINTS, [2, 5], axis=0), rtol=1e-6)

    @given(st.one_of(st.binary(max_size=300), st.lists(st.sampled_from([b"abc", b"aaaa", b"xyz"])).map(b"".join)))
    def test_decompression_is_its_twin(self, content):
        packed = lzf_compressed(content)
        assert lzf_decompressed(packed) == content
        assert decompressed(packed, len(content)) == content

    def test_copies_from_before_the_beginning_are_refused(self):
        assert decompressed(bytes([0, 65, 0x20, 0x05]), 10) == b""
        assert decompressed(bytes([0, 65, 0x20, 0x00]), 10) == b"AAAA"

    @given(st.binary(max_size=60), st.integers(0, 80))
    def test_decompression_survives_anything(self, packed, size):
        assert len(decompressed(packed, size)) <= size + 264


class TestRangeGrids:
    """A hemisphere seen from above, with a step in depth beside it."""

    @pytest.fixture
    def scan(self):
        u, v = np.meshgrid(np.linspace(-0.6, 0.6, 41), np.linspace(-0.4, 0.4, 31))
        points = np.stack([u, v, np.sqrt(np.maximum(0, 1 - u**2 - v**2))], axis=-1)
        points[:, :5, 2] -= 3
        grid = np.arange(points.size // 3).reshape(u.shape)
        grid[10, 20] = -1
        return points.reshape(-1, 3), grid

    def test_normals_are_those_of_the_sphere(self, scan):
        points, grid = scan
        normals = grid_normals(points, grid)
        assert_allclose(np.linalg.norm(normals, axis=1), 1)
        inner = np.zeros(grid.shape, bool)
        inner[1:-1, 6:-1] = True
        inner[9:12, 19:22] = False
        cosines = np.einsum("ij,ij->i", normals, points)[grid[inner]]
        assert np.degrees(np.arccos(cosines.min())) < 3

    def test_the_turn_of_the_grid_does_not_matter(self, scan):
        points, grid = scan
        assert_allclose(grid_normals(points, grid[::-1]), grid_normals(points, grid), atol=0.05)
        assert (grid_normals(points, grid.T)[:, 2] > 0).all()

    def test_no_triangle_bridges_the_step_or_the_gap(self, scan):
        points, grid = scan
        faces = grid_faces(points, grid)
        assert np.ptp(points[faces][:, :, 2], axis=1).max() < 1
        assert (faces >= 0).all()
        missing = points[np.arange(grid.size).reshape(grid.shape)[10, 20]]
        assert not (points[faces] == missing).all(axis=2).any()
        cells = 30 * 40 - 30 - 4
        assert len(faces) == 2 * cells + 4

    def test_long_triangles_are_left_out_even_flat(self, scan):
        points, grid = scan
        points = points * [1, 1, 0] + [0.0, 0, 5]
        points[grid[:, 20:]] += [0.5, 0, 0]
        faces = grid_faces(points, np.where(grid < 0, 0, grid))
        assert np.ptp(points[faces][:, :, 0], axis=1).max() < 0.5

    def test_points_without_neighbors_look_at_the_sensor(self):
        grid = np.array([[0, -1, 1], [-1, -1, -1], [2, -1, -1]])
        assert_array_equal(grid_normals(np.eye(3), grid), [[0, 0, 1]] * 3)

    def test_ply(self, scan, tmp_path):
        points, grid = scan
        used = grid[grid >= 0]
        index = np.full(grid.size, -1)
        index[grid.ravel() >= 0] = np.arange(len(used))
        lines = [
            "ply", "format ascii 1.0", "obj_info num_cols 41", "obj_info num_rows 31", f"element vertex {len(used)}",
            "property double x", "property double y", "property double z", f"element range_grid {grid.size}",
            "property list uchar int vertex_indices", "end_header",
        ]  # fmt: skip
        lines += [f"{x!r} {y!r} {z!r}" for x, y, z in points[used].tolist()]
        lines += ["0" if i < 0 else f"1 {i}" for i in index]
        (tmp_path / "scan.ply").write_text("\n".join(lines) + "\n")
        cloud = sm.read(tmp_path / "scan.ply")
        assert_array_equal(cloud.points, points[used])
        assert_allclose(cloud.normals, grid_normals(points, grid)[used], atol=1e-12)


class TestPly:
    VERTICES = "0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0 255\n2 0 0 0\n"

    def test_ascii_polygons_with_colors(self, tmp_path):
        (tmp_path / "a.ply").write_text(
            "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 5\nproperty float x\nproperty float y\n"
            "property float z\nproperty uchar red\nelement face 2\nproperty uchar quality\n"
            "property list uchar int vertex_indices\nend_header\n" + self.VERTICES + "9 4 0 1 2 3\n8 3 1 4 2\n"
        )
        mesh = sm.read(tmp_path / "a.ply")
        assert_array_equal(mesh.vertices[:, 0], [0, 1, 1, 0, 2])
        assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [1, 4, 2]])

    @pytest.mark.parametrize("order", ["<", ">"])
    def test_binary_in_both_byte_orders(self, order, tmp_path):
        import plyfile

        vertex = np.zeros(9, [(name, f"{order}f4") for name in ("x", "y", "z", "nx", "ny", "nz")])
        for j, name in enumerate("xyz"):
            vertex[name], vertex[f"n{name}"] = POINTS[:, j], NORMALS[:, j]
        element = plyfile.PlyElement.describe(vertex, "vertex")
        plyfile.PlyData([element], byte_order=order).write(str(tmp_path / "a.ply"))
        cloud = sm.read(tmp_path / "a.ply")
        assert_allclose(cloud.points, POINTS, rtol=1e-6)
        assert_allclose(cloud.normals, NORMALS, atol=1e-5)


class TestPointsWithoutDirection:
    """Their normals are zero or no number: the other points are still good."""

    NORMALS = np.vstack([[0, 0, 0], NORMALS[1:8], [np.nan, 0, 1]])

    def test_text(self, tmp_path):
        (tmp_path / "a.csv").write_text("x,y,z,nx,ny,nz\n" + rows(POINTS, self.NORMALS, separator=","))
        with pytest.warns(
            SimplexMeshWarning, match=r"a.csv: left out 2 of 9 points: not measured, or without a normal"
        ):
            assert_array_equal(sm.read(tmp_path / "a.csv").points, POINTS[1:8])

    def test_ply_and_vtk(self, tmp_path):
        import pyvista

        cloud = pyvista.PolyData(POINTS)
        cloud.point_data.active_normals = self.NORMALS
        cloud.save(tmp_path / "a.vtp")
        header = "".join(f"property double {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        (tmp_path / "a.ply").write_text(
            f"ply\nformat ascii 1.0\nelement vertex 9\n{header}end_header\n{rows(POINTS, self.NORMALS)}"
        )
        for ending in ("vtp", "ply"):
            with pytest.warns(SimplexMeshWarning, match=f"a.{ending}: left out 2 of 9 points"):
                assert_allclose(sm.read(tmp_path / f"a.{ending}").points, POINTS[1:8])


class TestOff:
    def test_comments_colors_and_polygons(self, tmp_path):
        (tmp_path / "a.off").write_text(
            "# a house\nCOFF\n# counts\n5 2 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n1 1 0 1 0 0 1 # corner\n\n0 1 0 1 0 0 1\n"
            "2 0 0 1 0 0 1\n4 0 1 2 3 255 0 0\n3 1 4 2\n"
        )
        with pytest.warns(sm.SimplexMeshWarning, match="^a.off has 1 colors of faces, which were left out$"):
            mesh = sm.read(tmp_path / "a.off")
        assert_array_equal(sorted(mesh.faces.tolist()), [[0, 1, 2], [0, 2, 3], [1, 4, 2]])

    def test_counts_on_the_first_line(self, tmp_path):
        (tmp_path / "a.off").write_text("OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
        assert sm.read(tmp_path / "a.off").n_faces == 2


class TestPoses:
    def test_stanford_quaternions_are_conjugated(self, tmp_path):
        (tmp_path / "a.conf").write_text("camera 0 0 0 0 0 0 1\nbmesh a.ply 1 2 3 0.5 -0.1 0.3 0.8\n")
        T = sm.read_poses(tmp_path / "a.conf")["a.ply"]
        assert_allclose(T[:3, :3], Rotation.from_quat([0.5, -0.1, 0.3, 0.8]).inv().as_matrix(), atol=1e-12)
        assert_array_equal(T[:, 3], [1, 2, 3, 1])

    def test_json(self, tmp_path):
        T = np.eye(4)
        T[:3, 3] = 1, 2, 3
        (tmp_path / "a.json").write_text(json.dumps({"a": np.eye(4).tolist(), "b": T.tolist()}))
        poses = sm.read_poses(tmp_path / "a.json")
        assert list(poses) == ["a", "b"]
        assert_array_equal(poses["b"], T)

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("", "must hold poses"),
            ("bmesh a.ply 1 2 3\n", "7 numbers, not 5 words"),
            ("bmesh a.ply 1 2 3 0 0 0 0\n", "quaternion of a.ply must not be zero"),
            ('{"a": [1, 2]}', "pose of a must have shape"),
            ('{"a": [[1, 2', "must hold poses"),
            ("name, T\na.csv, 1, 2, 3\n", "must hold poses"),
        ],
    )
    def test_refusals(self, text, message, tmp_path):
        (tmp_path / "a.conf").write_text(text)
        with pytest.raises(OSError, match=message):
            sm.read_poses(tmp_path / "a.conf")
        with pytest.raises(FileNotFoundError, match="path must be a file of poses"):
            sm.read_poses(tmp_path / "b.conf")


class TestRigid:
    @pytest.mark.parametrize(
        ("T", "complaint"),
        [
            (np.diag([2.0, 2, 2, 1]), "must be a rotation and a translation; it scales by 2, 2, 2"),
            (np.diag([0.0, 0, 0, 1]), "it scales by 0, 0, 0"),
            (np.diag([1.0, 1, -1, 1]), "it is a reflection"),
            (np.diag([1.0, 1, 1, 2]), r"must have the last row \(0, 0, 0, 1\), not \(0, 0, 0, 2\)"),
            ([[1, 0.6, 0, 0], [0, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "it shears"),
        ],
    )
    def test_what_is_no_rotation_is_refused_by_name(self, T, complaint, tmp_path):
        (tmp_path / "a.json").write_text(json.dumps({"front": np.array(T).tolist()}))
        with pytest.raises(ValueError, match=f"^a.json: pose of front .*{complaint}"):
            sm.read_poses(tmp_path / "a.json")

    def test_rounded_rotations_are_accepted(self):
        T = np.eye(4)
        T[:3, :3] = TURNED.round(4)
        assert_array_equal(rigid("pose", T), T)


class TestKnownKinds:
    """The readers for callers who know what they want."""

    @pytest.fixture
    def files(self, image, tmp_path):
        sitk.WriteImage(image, str(tmp_path / "volume.nrrd"))
        (tmp_path / "points.xyz").write_text(rows(POINTS))
        (tmp_path / "mesh.off").write_text("OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
        sm.sphere(3).save(tmp_path / "ball.vtp")
        return tmp_path

    def test_right_ones(self, files):
        assert isinstance(sm.read_volume(files / "volume.nrrd"), sm.Volume)
        assert isinstance(sm.read_points(files / "points.xyz"), sm.PointCloud)
        assert isinstance(sm.read_triangles(files / "mesh.off"), sm.TriangleMesh)
        assert isinstance(sm.read_mesh(files / "ball.vtp"), sm.SimplexMesh)

    def test_surfaces_serve_as_points_and_meshes_as_triangles(self, files):
        assert_array_equal(sm.read_points(files / "mesh.off").normals, [[0, 0, 1]] * 4)
        assert sm.read_triangles(str(files / "ball.vtp")).is_closed

    @pytest.mark.parametrize(
        ("reader", "file", "message"),
        [
            (sm.read_volume, "points.xyz", "path must hold a volume, points.xyz holds a PointCloud"),
            (sm.read_points, "volume.nrrd", "path must hold points, volume.nrrd holds a Volume"),
            (sm.read_triangles, "points.xyz", "path must hold triangles, points.xyz holds a PointCloud"),
            (sm.read_mesh, "mesh.off", "path must hold a simplex mesh, mesh.off holds a TriangleMesh"),
        ],
    )
    def test_wrong_ones(self, reader, file, message, files):
        with pytest.raises(ValueError, match=message):
            reader(files / file)

    def test_content_decides_and_a_wrong_name_is_reported(self, files):
        (files / "mesh.off").rename(files / "mesh.stl")
        with pytest.warns(SimplexMeshWarning, match=r"mesh.stl is an OFF file by its content"):
            assert sm.read(files / "mesh.stl").n_faces == 2


class TestPlainSurfaces:
    VERTICES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    FACES = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"

    def test_off_without_faces(self, tmp_path):
        (tmp_path / "a.off").write_text("OFF\n4 0 0\n" + self.VERTICES)
        assert_array_equal(sm.read(tmp_path / "a.off").points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])

    def test_off_after_a_byte_order_mark(self, tmp_path):
        (tmp_path / "a.off").write_text("OFF\n4 4 0\n" + self.VERTICES + self.FACES, encoding="utf-8-sig")
        assert len(sm.read(tmp_path / "a.off").faces) == 4

    def test_off_with_fractions_as_corners(self, tmp_path):
        (tmp_path / "a.off").write_text("OFF\n4 4 0\n" + self.VERTICES + self.FACES.replace("3 2 0 3", "3 2 0 2.5"))
        with pytest.raises(OSError, match=r"a.off is not an OFF file"):
            sm.read(tmp_path / "a.off")

    @pytest.mark.parametrize("face", ["4 0 1 2", "4294967295 0 1 2", "-3 0 1 2"])
    def test_off_with_fewer_corners_than_said(self, face, tmp_path):
        (tmp_path / "a.off").write_text("OFF\n4 2 0\n" + self.VERTICES + f"{face}\n{face}\n")
        with pytest.raises(OSError, match=r"a.off is not an OFF file"):
            sm.read(tmp_path / "a.off")

    @pytest.mark.parametrize("sizes", ["0 4 4", "4 4 99999", "4 4 -4"])
    def test_pcd_with_sizes_that_no_number_has(self, sizes, tmp_path):
        header = f"VERSION .7\nFIELDS x y z\nSIZE {sizes}\nTYPE F F F\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n"
        (tmp_path / "a.pcd").write_text(header + self.VERTICES)
        with pytest.raises(OSError, match=r"a.pcd is a PCD file with a damaged header"):
            sm.read(tmp_path / "a.pcd")
