"""Empty, truncated or mislabeled files of every format: one sentence that names the file."""

from __future__ import annotations

import numpy as np
import pytest
import SimpleITK as sitk

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.io.writing import write
from tests.nightly.marks import nightly

ENDINGS = {
    "volume": [".nii", ".nii.gz", ".nrrd", ".mha", ".tif", ".vti", ".dcm"],
    "mesh": [".vtp", ".ply", ".off", ".stl", ".vtk"],
    "points": [".pcd"],
}
ALL = [ending for group in ENDINGS.values() for ending in group]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """One sound file of each format."""
    folder = tmp_path_factory.mktemp("whole")
    values = np.random.default_rng(0).integers(0, 3000, (20, 24, 28)).astype(np.int16)
    for ending in ENDINGS["volume"]:
        image = sitk.GetImageFromArray(values.astype(np.uint16) if ending == ".dcm" else values)
        if ending == ".vti":
            import pyvista

            grid = pyvista.ImageData(dimensions=(28, 24, 20))
            grid["values"] = values.reshape(-1)
            grid.save(folder / f"a{ending}")
        else:
            sitk.WriteImage(image, str(folder / f"a{ending}"))
    ball = sm.sphere(6)
    for ending in [".vtp", ".ply", ".off", ".stl"]:
        ball.save(folder / f"a{ending}")
    ball.to_pyvista().save(folder / "a.vtk")
    points = ball.vertices.astype("<f4")
    header = f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {len(points)}\nHEIGHT 1\nDATA binary\n"
    (folder / "a.pcd").write_bytes(header.encode() + points.tobytes())
    write(folder / "a.xyz", sm.PointCloud(ball.vertices))
    return folder


def sentence(error):
    text = str(error.value)
    assert "\n" not in text
    assert len(text) < 350
    assert "0x" not in text
    return text


@pytest.mark.parametrize("ending", ALL)
class TestEveryFormat:
    def test_sound_files_are_read(self, whole, ending):
        kinds = (sm.Volume, sm.PointCloud, sm.TriangleMesh, sm.SimplexMesh)
        assert isinstance(sm.read(whole / f"a{ending}"), kinds)

    @pytest.mark.parametrize("fraction", [0.25, *nightly(0.5, 0.8), 0.97])
    def test_truncated(self, whole, ending, fraction, tmp_path, capfd):
        content = (whole / f"a{ending}").read_bytes()
        path = tmp_path / f"cut{ending}"
        path.write_bytes(content[: int(fraction * len(content))])
        with pytest.raises(OSError, match="cut") as error:
            sm.read(path)
        assert f"cut{ending}" in sentence(error)
        printed = capfd.readouterr()
        assert printed.err == printed.out == ""

    def test_empty(self, ending, whole, tmp_path):
        path = tmp_path / f"none{ending}"
        path.touch()
        with pytest.raises(OSError, match=f"none{ending} is empty"):
            sm.read(path)

    @pytest.mark.parametrize(
        "content", [b"Dear reader,\nthis is a letter.\n" * 9, b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9]
    )
    def test_not_what_its_name_says(self, ending, whole, content, tmp_path, capfd):
        path = tmp_path / f"other{ending}"
        path.write_bytes(content)
        with pytest.raises(OSError, match=f"other{ending}") as error:
            sm.read(path)
        sentence(error)
        assert capfd.readouterr().err == ""


PCD = "VERSION .7\nFIELDS x y z\nSIZE {}\nTYPE F F F\nPOINTS 4\nDATA {}\n"
MHD = "NDims = 3\nDimSize = 2 2 2\nElementSpacing = {}\nElementType = MET_CHAR\nElementDataFile = {}\n"
NHDR = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: a.raw\n"
VTK = (
    "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
    "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "a.xyz",
            "1 2 3\n4 5\n6 7 8\n9 9 9\n",
            "a.xyz must hold numbers, as many on every line: the",
        ),
        ("a.xyz", "1 2 3\n4 5 six\n6 7 8\n9 9 9\n", "a.xyz must hold numbers, .*'six'"),
        ("a.txt", "1 2\n3 4\n5 6\n7 8\n", "a.txt must have 3 columns or more, not 2"),
        ("a.xyz", "1 2 3\n4 5 6\n7 8 9\n", "a.xyz: points must be at least 4, not 3"),
        ("a.xyz", "1 2 3\n4 5 6\n7 8 nan\n1 1 1\n", "a.xyz: points must be finite; 1 of 4 have NaN"),
        ("a.csv", "x,y,z\n", "a.csv holds no points"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "a.off: vertices must be at least 4, not 3"),
        ("a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n1 1 1\n3 0 1 7\n", r"a.off: faces\[0, 2\] is 7, outside 0..3"),
        ("a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 one 0\n1 1 1\n3 0 1 2\n", "a.off is not an OFF file of numbers"),
        ("a.off", "OFF\n4 1 0\n0 0 nan\n1 0 0\n0 1 0\n1 1 1\n3 0 1 2\n", "a.off: vertices must be finite"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 9\n", "a.obj is damaged: a face refers to v 9, of 4"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 4\n",
            "a.ply must have 42 bytes or more by its header, it has 38: truncated",
        ),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float u\nend_header\n1\n2\n3\n4\n", "x, y and z"),
        ("a.pcd", PCD.format("4 4", "ascii"), "damaged header"),
        ("a.pcd", PCD.format("4 4 4", "zip"), "binary_compressed, not zip"),
        ("a.pcd", "VERSION .7\nFIELDS x y z\n", "a.pcd is a PCD file without DATA line"),
        ("a.mhd", MHD.format("1 1 1", "a.raw"), "a.mhd refers to a.raw, which is not in its folder"),
        ("a.mhd", "NDims = 3\nDimSize = 4 4 4\n", "a.mhd is a MetaImage header without"),
        ("a.mhd", MHD.format("1 0 1", "LOCAL"), "a.mhd must have positive spacing, not ElementSpacing = 1 0 1"),
        ("a.nhdr", NHDR, "a.nhdr cannot be read as a volume"),
        ("a.vtk", VTK, "a.vtk must be a VTK image or polygons"),
        ("a", "nothing at all", "a has an unknown format; known ones are .3mf, .asc, .csv"),
    ],
)
def test_wrong_content(name, text, message, tmp_path, capfd):
    (tmp_path / name).write_text(text)
    with pytest.raises((OSError, ValueError, TypeError), match=message) as error:
        sm.read(tmp_path / name)
    sentence(error)
    assert capfd.readouterr().err == ""


def test_a_header_whose_samples_are_too_few(tmp_path, capfd):
    (tmp_path / "a.raw").write_bytes(b"1234567")
    (tmp_path / "a.mhd").write_text("NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = a.raw\n")
    with pytest.raises(OSError, match=r"a.mhd must have 8 bytes in a.raw, it has 7: truncated"):
        sm.read(tmp_path / "a.mhd")
    assert capfd.readouterr().err == ""


def test_vtk_polygons_that_refer_to_no_point(tmp_path, capfd):
    (tmp_path / "a.vtk").write_text(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
        "POLYGONS 1 4\n3 0 1 9\n"
    )
    with pytest.raises(ValueError, match=r"a.vtk: faces refer to points outside 0..3"):
        sm.read(tmp_path / "a.vtk")
    assert capfd.readouterr().err == ""


def test_topology_that_is_not_a_simplex_meshs(tmp_path):
    dataset = sm.sphere(2).to_pyvista()
    dataset.field_data["simplexmesh_twin"] = np.zeros((80, 3), np.int32)
    dataset.save(tmp_path / "a.vtp")
    with pytest.raises(sm.TopologyError, match=r"a.vtp: twin must be its own inverse"):
        sm.read(tmp_path / "a.vtp")


def test_samples_that_are_no_numbers(tmp_path):
    values = np.zeros((4, 4, 4), np.float32)
    values[1, 1, 1] = np.nan
    sitk.WriteImage(sitk.GetImageFromArray(values), str(tmp_path / "a.nrrd"))
    with pytest.raises(ValueError, match=r"a.nrrd: values must be finite; 1 of 64 are NaN or infinite"):
        sm.read(tmp_path / "a.nrrd")


@pytest.mark.parametrize("name", ["a.xyz", "a.obj"])
def test_truncated_text_that_only_misses_its_end_cannot_be_detected(whole, name, tmp_path):
    """Documented: nothing in an XYZ file says how many points there are; an OBJ without faces is points."""
    if name == "a.obj":
        (tmp_path / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n")
        with pytest.warns(SimplexMeshWarning, match="4 points but no polygons: it may be truncated"):
            assert len(sm.read(tmp_path / name)) == 4
    else:
        lines = (whole / name).read_text().splitlines(keepends=True)
        (tmp_path / name).write_text("".join(lines[:100]))
        assert len(sm.read(tmp_path / name)) == 100


class TestPaths:
    @pytest.mark.parametrize("reader", [sm.read, sm.read_volume, sm.read_points, sm.read_triangles, sm.read_mesh])
    def test_nothing_there(self, reader, tmp_path):
        with pytest.raises(FileNotFoundError, match=r"path must be a file or folder, .*nowhere.ply' does not exist"):
            reader(tmp_path / "nowhere.ply")

    def test_no_path(self):
        with pytest.raises(TypeError, match="path must be a string or a Path, not int"):
            sm.read(3)

    def test_a_folder_without_slices(self, tmp_path, capfd):
        (tmp_path / "notes.txt").write_text("1 2 3")
        with pytest.raises(OSError, match="must be a folder of DICOM or TIFF slices; none of its 1 files is one"):
            sm.read(tmp_path)
        assert capfd.readouterr().err == ""

    def test_a_folder_of_slices_of_different_sizes(self, tmp_path, capfd):
        for k, n in enumerate([5, 5, 6]):
            sitk.WriteImage(sitk.GetImageFromArray(np.zeros((n, 5), np.uint8)), str(tmp_path / f"{k}.tif"))
        with pytest.raises(OSError, match="cannot be read as a volume") as error:
            sm.read(tmp_path)
        sentence(error)
        assert capfd.readouterr().err == ""


@pytest.mark.parametrize("here", [".", "..", "./"])
def test_a_folder_is_called_by_its_name(here, tmp_path, monkeypatch):
    (tmp_path / "scans" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "scans" / ("inner" if here == ".." else ""))
    with pytest.raises(OSError, match=r"^scans must be a folder of DICOM or TIFF slices"):
        sm.read(here)
