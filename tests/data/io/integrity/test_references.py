"""Headers that name files of samples: those of other folders are never read, whatever the header looks like."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.data.io.integrity.headers import _LONGEST, metaimage_header

VALUES = np.arange(8, dtype=np.uint8)
MHD = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
NHDR = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"


@pytest.fixture
def folder(tmp_path):
    """A folder with samples in it and below; those of the folder above, secret.raw, must not be read."""
    inner = tmp_path / "scans"
    (inner / "sub").mkdir(parents=True)
    for place in ("d.raw", "a:b.raw", "ab:c.raw", "sub/d.raw"):
        (inner / place).write_bytes(VALUES.tobytes())
    (tmp_path / "secret.raw").write_bytes(VALUES.tobytes())
    (inner / "link.raw").symlink_to(tmp_path / "secret.raw")
    (inner / "LISTS").write_bytes(VALUES.tobytes())
    (inner / "LoCaL").symlink_to(tmp_path / "secret.raw")
    (inner / "d1.raw").symlink_to(tmp_path / "secret.raw")
    return inner


def test_a_list_of_files_is_read_unless_it_has_no_end(tmp_path):
    path = tmp_path / "a.mhd"
    path.write_text(MHD + "ElementDataFile = LIST\na.raw\nb.raw\n")
    assert metaimage_header(path)[1] == ["a.raw", "b.raw"]
    path.write_text(MHD + "ElementDataFile = LIST\n" + "a.raw\n" * (_LONGEST // 6 + 1))
    with pytest.raises(OSError, match=r"^a.mhd has a header of more than 4,194,304 bytes$"):
        metaimage_header(path)


@pytest.mark.parametrize(
    "header",
    [
        NHDR + "data file: {0}\ndata file:=d.raw\n\n",
        NHDR + "content: x\rdata file: {0}\n\n",
        NHDR + "# comment\n" * 8000 + "data file: {0}\n\n",
        NHDR + "data file: d.raw\ndatafile: {0}\n\n",
        NHDR + "data file: LIST\nd.raw\n\n{0}\n",
        NHDR + "data file: link.raw\n\n",
        NHDR + "data file: a:b.raw\n\n",  # of the current folder
        NHDR + "data file: d%d.raw 1 1 1\n\n",
        NHDR + "data file: {0}\0d.raw\n\n",
        MHD + "ElementDataFile = {0}\nElementDataFile = d.raw\n",
        MHD + "ElementDataFile : {0}\nElementDataFile = d.raw\n",
        MHD + "ElementDataFile : {0}\n = d.raw\n",
        MHD + "ElementDataFile :\n{0}\n",
        MHD + "Comment = x\n" * 8000 + "ElementDataFile = {0}\n",
        MHD + "Comment =\nElementDataFile = LOCAL\nElementDataFile = {0}\n",
        MHD + "ElementDataFile = link.raw\n",
        MHD + "ElementDataFile = LISTS\n{0}\n",
        MHD + "ElementDataFile = LoCaL\n",
        MHD + "ElementDataFile = d%d.raw 1 1 1\n",
        MHD + "ElementDataFile = %s%n%s.raw 1 1 1\n",
    ],
)
def test_no_header_leads_out_of_its_folder(header, folder, capfd):
    path = folder / ("a.nhdr" if header.startswith("NRRD") else "a.mhd")
    path.write_bytes(header.format(folder.parent / "secret.raw").encode())
    with pytest.raises(OSError, match=r"^a.(nhdr|mhd) (refers to|has a|is a MetaImage with a damaged header)"):
        sm.read(path)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("name", ["d.raw", "{0}/d.raw", "sub/../d.raw", "a:b.raw", "ab:c.raw", "sub/d.raw"])
def test_harmless_names(name, folder):
    name = name.format(folder)
    headers = {
        "a.nhdr": NHDR + f"data file: {name}\nkey:=" + "x" * 5000 + "\n# " + "x" * 5000 + "\n\n",
        "crlf.nhdr": (NHDR + f"data file: {name}\n\n").replace("\n", "\r\n"),
        "a.mhd": MHD + f"ElementDataFile = {name}\n",
        "colon.mhd": MHD + f"ElementDataFile : {name}\n",
    }
    for file, header in headers.items():
        if name[1] == ":" and file.endswith(".nhdr"):
            continue  # refused above
        (folder / file).write_bytes(header.encode())
        assert np.array_equal(sm.read(folder / file).values.ravel(order="F"), VALUES), file


def test_numbered_files(folder):
    """Each is one slice; `d1.raw` of the fixture leads out of the folder and is none of them."""
    for i in (1, 2):
        (folder / f"slice{i}.raw").write_bytes(VALUES[4 * i - 4 : 4 * i].tobytes())
    (folder / "a.mhd").write_text(MHD + "ElementDataFile = slice%d.raw 1 2 1\n")
    (folder / "a.nhdr").write_text(NHDR + "data file: slice%d.raw 1 2 1\n\n")
    for name in ("a.mhd", "a.nhdr"):
        assert np.array_equal(sm.read(folder / name).values.ravel(order="F"), VALUES), name


@pytest.mark.parametrize("line", ["a: " + "x" * 2000, "x" * 2000, "x" * 2000 + ": a"])
def test_a_line_that_would_end_the_process(line, tmp_path):
    """The library below composes its complaint about an unknown field in too little room."""
    (tmp_path / "a.nrrd").write_bytes((NHDR + line + "\n\n").encode() + VALUES.tobytes())
    with pytest.raises(OSError, match=r"a.nrrd has a damaged header: a line of 2,00\d characters"):
        sm.read(tmp_path / "a.nrrd")


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_points_none(data, tmp_path):
    header = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 0\nHEIGHT 1\nPOINTS 0\nDATA "
    (tmp_path / "a.pcd").write_bytes((header + data + "\n").encode() + bytes(8))
    with pytest.raises(OSError, match=r"^a.pcd must have points, its header says 0$"):
        sm.read(tmp_path / "a.pcd")


def test_a_count_of_many_digits(tmp_path):
    header = f"ply\nformat ascii 1.0\nelement vertex {'9' * 5000}\nproperty float x\nend_header\n"
    (tmp_path / "a.ply").write_text(header)
    with pytest.raises(OSError, match=r"^a.ply has a damaged header: an element must have a name and a count$"):
        sm.read(tmp_path / "a.ply")


@pytest.mark.parametrize("ending", [".nii", ".nii.gz"])
@pytest.mark.parametrize("unit", [None, "mm"])
def test_nifti_invents_no_unit(unit, ending, tmp_path):
    volume = sm.Volume(VALUES.reshape(2, 2, 2), spacing=(1, 2, 3), origin=(4, 5, 6), unit=unit)
    volume.save(tmp_path / f"a{ending}")
    found = sm.read(tmp_path / f"a{ending}")
    assert found.unit == unit
    assert np.array_equal(found.values, volume.values)
    assert np.allclose([found.spacing, found.origin], [[1, 2, 3], [4, 5, 6]])


def test_long_names_of_many_bytes(tmp_path):
    path = tmp_path / ("\u9aa8" * 78 + ".ply")
    sm.sphere(4).save(path)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
