"""VTP and VTI files as programs write them are plain; with one thing changed they are not."""

from __future__ import annotations

import base64
import zlib

import numpy as np
import pytest

from simplexmesh.data.io.integrity.xml import is_plain

KEY = (
    '<InformationKey name="L2_NORM_RANGE" length="2"><Value index="0">0</Value><Value index="1">1</Value>'
    "</InformationKey>"
)

SURFACE = f"""<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData>
<FieldData><DataArray type="Int32" Name="made" NumberOfTuples="2" format="ascii">7 8</DataArray></FieldData>
<Piece NumberOfPoints="3" NumberOfPolys="2">
<PointData>
<DataArray type="Float32" Name="weight" format="ascii">1 -2e3 3.4e+38
{KEY}
</DataArray>
<Array type="String" Name="names" format="ascii">97 0 98 127 0 0</Array>
</PointData>
<CellData><DataArray type="UInt8" Name="kind" NumberOfComponents="2" format="ascii">0 255 1 2</DataArray></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Verts></Verts>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0</DataArray>
<DataArray type="Int32" Name="offsets" NumberOfTuples="2" format="ascii">3 4</DataArray></Polys>
</Piece></PolyData></VTKFile>"""

IMAGE = """<VTKFile type="ImageData" byte_order="LittleEndian">
<ImageData WholeExtent="0 1 2 4 0 0" Origin="0 0 -1e3" Spacing="1 1 1" Direction="1 0 0 0 1 0 0 0 1">
<Piece Extent="0 1 2 4 0 0"><PointData><DataArray type="Int16" format="ascii">-1 2 3 4 5 32767</DataArray></PointData>
<CellData><DataArray type="Int16" format="ascii">1 2</DataArray></CellData></Piece></ImageData></VTKFile>"""


def plain(text, folder):
    (folder / "a.vtp").write_bytes(text if isinstance(text, bytes) else text.encode())
    return is_plain(folder / "a.vtp")


def changed(text, old, new):
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "old", "new"),
    [
        (SURFACE, "", '<?xml version="1.0"?>\n'),
        (SURFACE, 'byte_order="', 'header_type="UInt64" byte_order="'),
        (SURFACE, 'byte_order="', 'compressor="vtkZLibDataCompressor" byte_order="'),
        (SURFACE, '<FieldData><DataArray type="Int32" Name="made" NumberOfTuples="2" format="ascii">7 8'
                  "</DataArray></FieldData>", ""),
        (SURFACE, "3 4</D", "4 4</D"),
        (SURFACE, "3 4</D", "0 4</D"),
        (SURFACE, "<Verts></Verts>", ""),
        (SURFACE, "L2_NORM_RANGE", "L2_NORM_FINITE_RANGE"),
        (SURFACE, "7 8", "2147483647 -2147483648"),
        (IMAGE, "</Piece>", "</Piece>"),
        (IMAGE, ' Origin="0 0 -1e3" Spacing="1 1 1" Direction="1 0 0 0 1 0 0 0 1"', ""),
    ],
)  # fmt: skip
def test_what_programs_write(text, old, new, tmp_path):
    assert plain(changed(text, old, new), tmp_path)


CHANGES = {
    SURFACE: [
        ("LittleEndian", "BigEndian"),
        ("", "<!DOCTYPE x>"),
        ("<PolyData>", '<?x version="1.0"?><PolyData>'),
        ("<VTKFile", "<VTKFile compressor='vtkLZ4DataCompressor'"),
        ("<VTKFile", "<VTKFile header_type='UInt16'"),
        ('type="PolyData"', 'type="ImageData"'),
        ("<FieldData>", "<FieldData/><FieldData>"),
        ("<FieldData>", "<Piece/><FieldData>"),
        ("<Verts>", "<Other/><Verts>"),
        ("<Verts>", "<Polys/><Verts>"),
        ("<Verts>", "<PointData/><Verts>"),
        ('NumberOfTuples="2" format="ascii">7 8', 'NumberOfTuples="3" format="ascii">7 8'),
        ("7 8", "2147483648 8"),
        ("7 8", "-2147483649 8"),
        ('NumberOfPoints="3"', 'NumberOfPoints="4"'),
        ('NumberOfPoints="3"', 'NumberOfPoints="2"'),
        ('NumberOfPolys="2"', 'NumberOfPolys="1"'),
        ('NumberOfPolys="2"', 'NumberOfPolys="0"'),
        ('NumberOfPolys="2"', 'NumberOfVerts="1" NumberOfPolys="2"'),
        ('NumberOfPolys="2"', 'NumberOfPolys="+2"'),
        ("1 -2e3 3.4e+38", "1 -2e3"),
        ("1 -2e3 3.4e+38", "1 -2e3 3.5e+38"),
        ("1 -2e3 3.4e+38", "1 -3.5e+38 2"),
        ("1 -2e3 3.4e+38", "1 nan 2"),
        ("1 -2e3 3.4e+38", "1 2 1." + 40 * "0"),
        ("Float32", "Float16"),
        ("L2_NORM_RANGE", "COMPONENT_NAME"),
        ('length="2"', 'length="3"'),
        ('<Value index="1">1</Value>', ""),
        ('<Value index="0">', '<Value index="2">'),
        (
            "</InformationKey>",
            '</InformationKey><Key name="L2_NORM_RANGE" length="2"><Value index="0"/><Value index="1"/></Key>',
        ),
        ("127 0 0", "127 0 1"),
        ("127 0 0", "127 0"),
        ("97 0 98 127 0 0", "97 0 98 0 0 0"),
        ("127 0 0", "128 0 0"),
        ("127 0 0", "-129 0 0"),
        ('Name="names"', 'Name="names" NumberOfComponents="2"'),
        ('<Array type="String"', '<Array type="Int8"'),
        ("0 255 1 2", "0 256 1 2"),
        ("0 255 1 2", "-1 255 1 2"),
        ("0 255 1 2", "0 255"),
        ('NumberOfComponents="2"', 'NumberOfComponents="0"'),
        ('NumberOfComponents="2" format="ascii">0 255 1 2', 'NumberOfComponents="1001" format="ascii">' + "1 " * 2002),
        ('NumberOfComponents="3"', 'NumberOfComponents="2"'),
        ('NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0', 'format="ascii">0 0 0'),
        ("Float64", "Int64"),
        ("<Points>", "<Points><DataArray/>"),
        ("3 4</D", "3 5</D"),
        ("3 4</D", "5 4</D"),
        ("3 4</D", "-1 4</D"),
        ("3 4</D", "3 4 4</D"),
        ('NumberOfTuples="2" format="ascii">3 4', 'NumberOfTuples="3" format="ascii">3 4'),
        ('"connectivity"', '"connected"'),
        ('<DataArray type="Int64" Name="connectivity"', '<DataArray type="Int16" Name="connectivity"'),
        ("</Polys>", '<DataArray type="Int64" Name="offsets" format="ascii">3 4</DataArray></Polys>'),
        ('format="ascii">0 1 2 0', 'format="text">0 1 2 0'),
    ],
    IMAGE: [
        ('WholeExtent="0 1', 'WholeExtent="1 2'),
        ("0 1 2 4 0 0", "0 1 2 4"),
        ("0 0 -1e3", "0 0"),
        ("0 0 -1e3", "0 0 1e999"),
        ('"1 1 1"', '"1 1 1 1"'),
        ("1 0 0 0 1 0 0 0 1", "1 0 0 0 1 0 0 0"),
        ("32767", "32768"),
        ("32767", "3 4"),
        ("1 2</D", "1 2 3</D"),
        ('type="ImageData"', 'type="PolyData"'),
    ],
}


@pytest.mark.parametrize(("text", "old", "new"), [(text, *change) for text in CHANGES for change in CHANGES[text]])
def test_with_one_thing_changed_they_are_not_plain(text, old, new, tmp_path):
    assert plain(text, tmp_path)
    assert not plain(changed(text, old, new), tmp_path)


@pytest.mark.parametrize(
    ("name", "number"),
    [("Points", "-3"), ("Polys", "-2"), ("Components", "100000000"), ("Tuples", "1e3"), ("Points", f"{10**12}"),
     ("Tuples", "9" * 5000)],
)  # fmt: skip
def test_counts_that_no_such_file_has_are_refused_at_once(name, number, tmp_path):
    old = f'NumberOf{name}="' + {"Points": "3", "Polys": "2", "Components": "3", "Tuples": "2"}[name] + '"'
    with pytest.raises(OSError, match=rf"^a.vtp is damaged: NumberOf{name} is {number[:40]}$"):
        plain(changed(SURFACE, old, f"NumberOf{name}='{number}'"), tmp_path)
    data = b'<AppendedData encoding="raw">_ NumberOfPoints="-1"'
    plain(SURFACE.removesuffix("</VTKFile>").encode() + data, tmp_path)  # which is data


@pytest.mark.parametrize(("ends", "sound"), [("5 5", True), ("0 -1", False), ("1048576 1048576", True),
                                             ("1048577 1048577", False), ("-1048577 -1048577", False)])  # fmt: skip
def test_images_within_bounds(ends, sound, tmp_path):
    extent = f"0 0 {ends} 0 0"
    bare = f'<ImageData WholeExtent="{extent}"><Piece Extent="{extent}"></Piece></ImageData>'
    assert plain(f'<VTKFile type="ImageData" byte_order="LittleEndian">{bare}</VTKFile>', tmp_path) == sound


def test_what_is_no_xml_is_told(tmp_path):
    with pytest.raises(OSError, match=r"a.vtp is not well-formed XML: "):
        plain(SURFACE[:-1], tmp_path)


def blocks(values, word, packed):
    """The header and the blocks, of 16 bytes if packed, of an array."""
    raw = values.tobytes()
    if not packed:
        return np.array([len(raw)], word).tobytes(), raw
    pieces = [zlib.compress(raw[at : at + 16]) for at in range(0, len(raw), 16)]
    return np.array([len(pieces), 16, len(raw) % 16, *map(len, pieces)], word).tobytes(), b"".join(pieces)


def binary(appended, word, packed, damage=lambda number, head, body: (head, body)):
    """The surface with three of its arrays, some of whole blocks, as bytes; `damage` may change what is stored."""
    arrays = np.arange(9.0), np.array([0, 1, 2, 0]), np.array([3, 4], np.int32)
    text, data = SURFACE, b""
    for number, (array, old) in enumerate(zip(arrays, (">0 0 0 1 0 0 0 1 0<", ">0 1 2 0<", ">3 4<"), strict=True)):
        head, body = damage(number, *blocks(array, word, packed))
        at = text.index('format="ascii"' + old)
        rest = text[at:].removeprefix('format="ascii"' + old)
        if appended:
            text = text[:at] + f'format="appended" offset="{len(data)}"><' + rest
            data += head + body
        else:
            parts = (head, body) if packed else (head + body,)
            letters = "".join(base64.b64encode(part).decode() for part in parts)
            text = f'{text[:at]}format="binary">{letters}<{rest}'
    kind = f"header_type='UInt{8 * np.dtype(word).itemsize}'" + packed * " compressor='vtkZLibDataCompressor'"
    text = text.replace("<VTKFile", f"<VTKFile {kind}")
    if not appended:
        return text.encode()
    return text.removesuffix("</VTKFile>").encode() + b'<AppendedData encoding="raw">_' + data


@pytest.mark.parametrize("appended", [True, False])
@pytest.mark.parametrize("word", ["<u4", "<u8"])
@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("number", [None, 0, 1, 2])
def test_bytes_of_which_some_are_missing(appended, word, packed, number, tmp_path):
    text = binary(appended, word, packed, lambda k, head, body: (head, body[: len(body) - 8 * (k == number)]))
    sound = number is None or (appended and number < 2 and not (packed and number == 1))
    assert plain(text, tmp_path) == sound


@pytest.mark.parametrize("appended", [True, False])
@pytest.mark.parametrize("word", ["<u4", "<u8"])
@pytest.mark.parametrize(("packed", "place"), [(False, 0), (True, 0), (True, 1), (True, 2), (True, 3)])
@pytest.mark.parametrize("more", [1, -1])
def test_sizes_that_disagree(appended, word, packed, place, more, tmp_path):
    """The first number is that of the blocks, or the size; then that of each, of the last, and packed ones."""

    def damage(number, head, body):
        sizes = np.frombuffer(head, word).astype("i8")
        if number == 1:
            sizes[place] += more * (64 if place == 3 else 1)
        return sizes.astype(word).tobytes(), body

    assert not plain(binary(appended, word, packed, damage), tmp_path)


@pytest.mark.parametrize("offset", [10**9, 10**6])
def test_an_offset_beyond_what_is_appended(offset, tmp_path):
    text = binary(True, "<u4", False).replace(b'offset="0"', b'offset="%d"' % offset)
    assert not plain(text, tmp_path)


def test_more_than_blocks_can_unpack_to(tmp_path):
    def damage(number, head, body):
        return (np.array([1, 72, 0, 0], "<u4").tobytes(), b"") if number == 0 else (head, body)

    assert not plain(binary(True, "<u4", True, damage), tmp_path)
