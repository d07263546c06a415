"""Headers that ask for more than their file holds, or for other files: one sentence, and nothing is made or read."""

from __future__ import annotations

import gzip
import struct
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import SimpleITK as sitk
import vtkmodules
from vtkmodules.vtkCommonCore import vtkBitArray, vtkDataArray
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLPolyDataWriter

import simplexmesh as sm
from simplexmesh.data.io.integrity import apart, xml
from tests.nightly import seeds

MANY = 1_000_000_000_000


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The folder of sound files of every variety."""
    folder = tmp_path_factory.mktemp("sound")
    seeds.write(folder)
    return folder


def complaint(path):
    """What is wrong with the way a file is read, or refused in a sentence."""
    try:
        with warnings.catch_warnings(action="ignore", category=sm.SimplexMeshWarning):  # points without polygons
            return "" if np.isfinite(sm.read(path).bounds).all() else "not finite"
    except (OSError, ValueError) as error:
        text = str(error)
        return "" if path.name in text and "\n" not in text and len(text) < 350 else text


def test_what_programs_write_is_plain(sound):
    for path in (*sound.glob("*.vtp"), *sound.glob("*.vti")):
        assert xml.is_plain(path), path


@pytest.mark.parametrize("kind", ["ASCII", "Binary"])
@pytest.mark.parametrize("version", [42, 51])
def test_reading_apart_gives_what_was_written(sound, version, kind):
    path = sound / f"polygons-{version}-{kind}.vtk"
    found, wanted = sm.read(path), sm.read(sound / "mesh.vtp")
    assert np.array_equal(found.connectivity.twin, wanted.connectivity.twin)
    assert np.array_equal(found.data["weight"], wanted.data["weight"])
    assert np.allclose(found.vertices, wanted.vertices, rtol=0, atol=1e-9)


@pytest.mark.parametrize("refused", [set(), {"RLIMIT_AS"}, {"RLIMIT_AS", "RLIMIT_CORE"}])
def test_what_reads_apart_has_the_limits_that_the_system_allows(refused, monkeypatch):
    resource = pytest.importorskip("resource")  # not on Windows
    names = {getattr(resource, name): name for name in ("RLIMIT_AS", "RLIMIT_CPU", "RLIMIT_CORE")}
    found = {}

    def set_limit(kind, limits):
        if names[kind] in refused:
            raise ValueError("current limit exceeds maximum limit")
        found[names[kind]] = limits

    monkeypatch.setattr(resource, "setrlimit", set_limit)
    apart._limit(1 << 30, 12)
    wanted = {"RLIMIT_AS": (1 << 30, 1 << 30), "RLIMIT_CPU": (12, 12), "RLIMIT_CORE": (0, 0)}
    assert found == {name: limits for name, limits in wanted.items() if name not in refused}


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("mesh.vtp", 'NumberOfTuples="320"', 'NumberOfTuples="-1"'),
        ("mesh.vtp", 'NumberOfTuples="320"', f'NumberOfTuples="{MANY}"'),
        ("mesh.vtp", 'NumberOfComponents="3"', f'NumberOfComponents="{MANY}"'),
        ("mesh.vtp", 'NumberOfComponents="3"', 'NumberOfComponents="-3"'),
        ("mesh.vtp", 'NumberOfPoints="320"', f'NumberOfPoints="{MANY}"'),
        ("mesh.vtp", 'NumberOfPolys="162"', f'NumberOfPolys="{MANY}"'),
        ("mesh.vtp", 'NumberOfPolys="162"', 'NumberOfPolys="-1"'),
        ("mesh.vtp", 'offset="48"', f'offset="{MANY}"'),
        ("mesh.vtp", 'offset="48"', 'offset="-48"'),
        ("Ascii-None.vtp", 'NumberOfPoints="320"', f'NumberOfPoints="{MANY}"'),
        ("Ascii-None.vtp", " 32 48 31 ", " 32 99999999999999999999999 31 "),
        ("Appended-None.vti", 'Extent="0 5 0 6 0 7"', 'Extent="0 99999 0 99999 0 99999"'),
        ("image-42-Binary.vtk", "vtk DataFile Version 4.2", "vtk DataFile Version nan"),
        ("image-42-Binary.vtk", "DIMENSIONS 6 7 8", "DIMENSIONS 60000 70000 80000"),
        ("image-42-ASCII.vtk", "POINT_DATA 336", "POINT_DATA 999999999999"),
        ("polygons-42-ASCII.vtk", "POINTS 320", "POINTS -1"),
        ("polygons-51-ASCII.vtk", "POLYGONS 163 960", "POLYGONS 163 -960"),
        ("polygons-51-Binary.vtk", "POLYGONS 163 960", f"POLYGONS {MANY} 960"),
    ],
)
def test_numbers_that_would_end_the_process(sound, name, old, new, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(apart, "BUSY_SECONDS", 2)
    content = (sound / name).read_bytes()
    assert old.encode() in content
    path = tmp_path / name
    path.write_bytes(content.replace(old.encode(), new.encode(), 1))
    assert not complaint(path)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("digits", ["77", "7" * 400])
def test_the_first_sentence_of_vtk_is_told_whatever_the_file_says(sound, digits, tmp_path):
    content = (sound / "Binary-None.vtp").read_bytes()
    (tmp_path / "a.vtp").write_bytes(content.replace(b'type="Float64"', f'type="Float{digits}"'.encode(), 1))
    with pytest.raises(OSError, match=rf'^a.vtp cannot be read as VTP: Unknown data type "Float{digits[:170]}[7"]+$'):
        sm.read(tmp_path / "a.vtp")
    assert not complaint(tmp_path / "a.vtp")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET WORD\n", "it is damaged"),
        (
            "a.mha",
            "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = WORD\nElementDataFile = LOCAL\n",
            "volume",
        ),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty WORD x\nend_header\n0\n", "field type 'q"),
    ],
)
def test_long_words_are_told_in_short(name, text, told, tmp_path):
    (tmp_path / name).write_text(text.replace("WORD", "q" * 3000))
    with pytest.raises(OSError, match=told) as error:
        sm.read(tmp_path / name)
    assert len(str(error.value)) < 300
    assert "Algorithm" not in str(error.value)
    assert "Success" not in str(error.value)


def test_a_process_that_ends_or_hangs_is_a_damaged_file(sound, monkeypatch):
    for name, seconds in (("SECONDS", 0.0), ("SECONDS", -1.0), ("BUSY_SECONDS", 0)):
        monkeypatch.undo()
        monkeypatch.setattr(apart, name, seconds)
        with pytest.raises(OSError, match=r"polygons-42-ASCII.vtk cannot be read as VTK: it is damaged"):
            sm.read(sound / "polygons-42-ASCII.vtk")


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of processor time")
def test_a_reader_without_end_ends_though_nobody_waits_for_it(sound, tmp_path):
    content = (sound / "Binary-None.vtp").read_bytes()
    assert b'NumberOfComponents="3"' in content
    (tmp_path / "a.vtp").write_bytes(content.replace(b'NumberOfComponents="3"', b'NumberOfComponents="4294967295"', 1))
    words = [Path(vtkmodules.__path__[0]).parent, "vtp", tmp_path / "a.vtp", tmp_path, 1 << 31, 1]
    subprocess.run([sys.executable, "-I", "-S", apart.__file__, *map(str, words)], check=False, timeout=300)


@pytest.mark.parametrize(
    ("face", "what"),
    [("1 2 1163078", "v 1.16308e.06, of 4"), ("1 2 -5", "v -5"), ("0 1 2", "v 0"), ("1/1 2/1 3/2", "vt 2, of 1"),
     ("1//1 2//1 3//9", "vn 9, of 1"), ("1/1/1 2/1/1 3/1/7", "vn 7, of 1")],
)  # fmt: skip
def test_faces_of_obj_refer_to_what_there_is(face, what, tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvn 0 0 1\nf {}\nf 2 3 4\n"
    (tmp_path / "a.obj").write_text(text.format(face))
    with pytest.raises(OSError, match=f"a.obj is damaged: a face refers to {what}"):
        sm.read(tmp_path / "a.obj")
    for sound in ("1 2 3", "-4 -3 -2", "1/1 2/1 3/1", "1//1 2//1 3//1", "1/1/1 2/1/-1 3/-1/1"):
        (tmp_path / "a.obj").write_text(text.format(sound))
        assert len(sm.read(tmp_path / "a.obj").faces) == 2


def test_a_wild_position_in_stl_merges_nothing_else(tmp_path):
    ball = sm.sphere(12).triangulated()
    ball = sm.TriangleMesh(
        np.vstack([ball.vertices, [[1e30, 0, 0]]]), np.vstack([ball.faces, [[0, 1, len(ball.vertices)]]])
    )
    ball.save(tmp_path / "a.stl")
    with pytest.raises(ValueError, match=r"a.stl: a tolerance of 1e\+23 merges [\d,]+ vertices with each"):
        sm.read(tmp_path / "a.stl")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("counts", [(4, 4294967295), (4294967295, 4), (10**18, 1)])
def test_counts_of_ply(form, counts, tmp_path):
    (tmp_path / "a.ply").write_text(
        f"ply\nformat {form} 1.0\nelement vertex {counts[0]}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {counts[1]}\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"
    )
    with pytest.raises(
        OSError, match=r"a.ply must have [\d,]{9,} bytes or more by its header, it has \d\d\d: truncated"
    ):
        sm.read(tmp_path / "a.ply")


PCD = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT {}\nWIDTH {}\nHEIGHT {}\nPOINTS {}\nDATA {}\n"


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize(
    "numbers",
    [
        ("1 1 1", -4, 1, -4),
        ("1 1 1", 300_000_000, 1, 300_000_000),
        ("1 1 900000000", 4, 1, 4),
        ("1 1 -1", 4, 1, 4),
        ("1 1 0", 4, 1, 4),
    ],
)
def test_sizes_of_pcd(numbers, data, tmp_path):
    tail = np.array([20, 12 * numbers[3] & 0xFFFFFFFF], "<u4").tobytes() + bytes(60)
    (tmp_path / "a.pcd").write_bytes(PCD.format(*numbers, data).encode() + (b"1 2 3\n" if data == "ascii" else tail))
    with pytest.raises(OSError, match=r"a.pcd (must have|is a PCD file with a damaged header)"):
        sm.read(tmp_path / "a.pcd")


def test_a_packed_volume_without_end(tmp_path, monkeypatch):
    """Its slope of zero makes a copy necessary, of its samples only: what follows them is left packed."""
    values = np.arange(4 * 5 * 6, dtype=np.int16).reshape(6, 5, 4)
    sitk.WriteImage(sitk.GetImageFromArray(values), str(tmp_path / "a.nii"))
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[112:120] = struct.pack("<2f", 0.0, 7.0)
    (tmp_path / "bomb.nii.gz").write_bytes(gzip.compress(bytes(content) + bytes(1 << 26)))
    sizes = []

    class Folder(tempfile.TemporaryDirectory):
        def cleanup(self):
            sizes.extend(path.stat().st_size for path in (tmp_path / "made").glob("*/*"))
            super().cleanup()

        def __exit__(self, *error):
            self.cleanup()

    (tmp_path / "made").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "made"))
    monkeypatch.setattr(tempfile, "TemporaryDirectory", Folder)
    assert np.array_equal(sm.read(tmp_path / "bomb.nii.gz").values, values.T)
    assert sizes == [len(content)]


def test_a_signature_with_more_than_it_needs(tmp_path):
    sm.sai(sm.sphere(4), frequency=5).save(tmp_path / "a.npz")
    assert sm.SAI.load(tmp_path / "a.npz").frequency == 5
    with np.load(tmp_path / "a.npz") as parts:
        members = dict(parts)
    np.savez_compressed(tmp_path / "b.npz", **members, more=np.zeros(1 << 20))
    with pytest.raises(OSError, match=r"b.npz is not a whole signature .* unpacked it is larger than 1,048,576 bytes"):
        sm.SAI.load(tmp_path / "b.npz")


@pytest.mark.parametrize("above", ["../a.raw", "b/../../a.raw", "{0}/a.raw", "..\\a.raw", "C:\\a.raw"])
def test_samples_lie_beside_their_header_or_below(above, tmp_path, capfd):
    values = np.arange(8, dtype=np.uint8)
    folder = tmp_path / "scans"
    (folder / "b").mkdir(parents=True)
    for place in (tmp_path, folder, folder / "b"):
        (place / "a.raw").write_bytes(values.tobytes())
    name = above.format(tmp_path)
    mhd = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = {}\n"
    nhdr = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: {}\n\n"
    for ending, header in (("mhd", mhd), ("nhdr", nhdr)):
        path = folder / f"a.{ending}"
        for fine in ("a.raw", "./a.raw", "b/a.raw"):
            path.write_text(header.format(fine))
            assert np.array_equal(sm.read(path).values.ravel(order="F"), values)
        for wrong in (name, f"LIST\n{name}", f"LIST 2\n{name}"):
            path.write_text(header.format(wrong))
            with pytest.raises(OSError, match=rf"a.{ending} refers to .*, which is not in its folder or below"):
                sm.read(path)
    assert capfd.readouterr().err == ""


def test_axes_with_which_itk_does_not_end(tmp_path):
    (tmp_path / "a.raw").write_bytes(bytes(range(8)))
    (tmp_path / "a.mhd").write_text(
        "NDims = 3\nTransformMatrix = 1 0 0 0 1 0 0 1e308 1\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
        "ElementDataFile = a.raw\n"
    )
    with pytest.raises(OSError, match=r"a.mhd has a damaged header: TransformMatrix = 1 0 0 0 1 0 0 1e308 1"):
        sm.read(tmp_path / "a.mhd")


def _with_bits(dataset):
    bits = vtkBitArray()
    bits.SetName("bits")
    bits.SetNumberOfTuples(dataset.n_points)
    for i in range(dataset.n_points):
        bits.SetValue(i, i % 3 == 0)
    dataset["a & b"] = dataset.points[:, 2]
    dataset.GetPointData().AddArray(bits)


def _with_keys(dataset):
    dataset["a & b"] = dataset.points[:, 2]
    array = dataset.GetPointData().GetArray("a & b")
    array.GetInformation().Set(vtkDataArray.UNITS_LABEL(), "K")
    array.SetComponentName(0, "&amp;")
    dataset.GetPoints().GetData().GetInformation().Set(vtkDataArray.UNITS_LABEL(), "m")


def _with_whole_positions(dataset):
    dataset.points = np.rint(100 * dataset.points).astype(np.int32)
    dataset["a & b"] = dataset.points[:, 2].astype(float)


@pytest.mark.parametrize("writer", [vtkXMLPolyDataWriter, vtkPolyDataWriter])
@pytest.mark.parametrize("change", [_with_bits, _with_keys, _with_whole_positions])
def test_what_other_programs_may_store_is_read(change, writer, tmp_path):
    dataset = pv.Icosahedron()
    dataset.clear_data()
    change(dataset)
    bits = np.arange(dataset.n_points) % 3 == 0
    path = tmp_path / ("a.vtk" if writer is vtkPolyDataWriter else "a.vtp")
    if path.suffix == ".vtp":
        dataset.rename_array("a & b", "a &amp; b")  # which VTK does not do
    made = writer()
    made.SetFileName(str(path))
    made.SetInputData(dataset)
    assert made.Write()
    found = sm.read(path)
    assert np.allclose(found.vertices, dataset.points, rtol=1e-5)
    assert np.allclose(found.data["a & b"], dataset.points[:, 2], rtol=1e-5)
    assert ("bits" in found.data) == (change is _with_bits)
    assert np.array_equal(found.data.get("bits", bits), bits)


def test_an_image_of_bits_is_read(tmp_path):
    image = pv.ImageData(dimensions=(4, 5, 6))
    _with_bits(image)
    image.GetPointData().RemoveArray("a & b")
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(tmp_path / "a.vti"))
    writer.SetInputData(image)
    assert writer.Write()
    assert np.array_equal(sm.read(tmp_path / "a.vti").values.ravel(order="F"), np.arange(120) % 3 == 0)
