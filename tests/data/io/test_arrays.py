"""Named arrays, colors and units of files: read, and written again."""

from __future__ import annotations

import json
import struct
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.io.obj import with_colors

BALL = sm.sphere(4)
N = BALL.n_vertices
RNG = np.random.default_rng(0)
COLORS = RNG.integers(0, 256, (N, 3)).astype(np.uint8)
DATA = {
    "colors": COLORS,
    "intensity": RNG.random(N).astype(np.float32),
    "label": RNG.integers(-9, 9, N).astype(np.int32),
    "uv": RNG.random((N, 2)),
}
CLOUD = sm.PointCloud(BALL.vertices, BALL.normals, DATA, "mm")
MESH = sm.SimplexMesh(BALL.vertices, BALL.connectivity, DATA, "mm")
SURFACE = MESH.triangulated()


def same(found, given):
    """Whether all arrays and the unit came back as they were."""
    assert found.unit == given.unit
    assert found.data.keys() == given.data.keys()
    for name, values in given.data.items():
        assert found.data[name].dtype == values.dtype
        assert_array_equal(found.data[name], values)


@pytest.mark.parametrize("ending", [".vtp", ".ply"])
@pytest.mark.parametrize("thing", [CLOUD, SURFACE], ids=["points", "triangles"])
def test_all_arrays_come_back(ending, thing, tmp_path):
    thing.save(tmp_path / f"a{ending}")
    same(sm.read(tmp_path / f"a{ending}"), thing)


@pytest.mark.parametrize("thing", [CLOUD, SURFACE, MESH], ids=["points", "triangles", "mesh"])
def test_bools_come_back_from_vtp(thing, tmp_path):
    """They were bytes, with which a mask selected the first two points again and again."""
    given = thing.with_data(**{"is near": thing.data["uv"][:, 0] > 0.5, "both": thing.data["uv"] > 0.5})
    given.save(tmp_path / "a.vtp")
    same(sm.read(tmp_path / "a.vtp"), given)


def test_bools_that_another_program_counted_up_are_bytes(tmp_path):
    import pyvista

    CLOUD.with_data(seen=CLOUD.data["uv"][:, 0] > 0.5).save(tmp_path / "a.vtp")
    found = pyvista.read(tmp_path / "a.vtp")
    found["seen"] = np.arange(N, dtype=np.uint8)
    found.save(tmp_path / "b.vtp")
    assert_array_equal(sm.read(tmp_path / "b.vtp").data["seen"], found["seen"])


def test_a_simplex_mesh_comes_back(tmp_path):
    MESH.save(tmp_path / "a.vtp")
    same(sm.read_mesh(tmp_path / "a.vtp"), MESH)
    MESH.save(tmp_path / "a.ply")
    found = sm.read(tmp_path / "a.ply")
    assert_array_equal(found.vertices[:N], MESH.vertices)
    assert_array_equal(found.data["colors"][:N], COLORS)


def test_other_programs_see_the_arrays_of_ply(tmp_path):
    import plyfile
    import trimesh

    CLOUD.save(tmp_path / "a.ply")
    found = plyfile.PlyData.read(str(tmp_path / "a.ply"))
    assert [each.name for each in found["vertex"].properties][6:] == [
        *("red", "green", "blue", "intensity", "label", "uv_0", "uv_1"),
    ]
    assert found.comments == ["unit mm"]
    SURFACE.save(tmp_path / "b.ply")
    assert_array_equal(trimesh.load(tmp_path / "b.ply").visual.vertex_colors[:, :3], SURFACE.data["colors"])


@pytest.mark.parametrize(
    ("values", "kept"),
    [
        (np.arange(N), np.int32),
        (np.arange(N) + 2**40, np.float64),
        (np.arange(N) > 3, np.uint8),
        (np.arange(N).astype(np.float16), np.float32),
        (np.arange(N).astype(np.uint64), np.int32),
    ],
)
def test_numbers_that_ply_has_not_are_written_as_others(values, kept, tmp_path):
    sm.PointCloud(BALL.vertices, data={"a b": values}).save(tmp_path / "a.ply")
    found = sm.read(tmp_path / "a.ply").data
    assert list(found) == ["a_b"]
    assert found["a_b"].dtype == kept
    assert_array_equal(found["a_b"], values)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"n": np.arange(N) + 2**60}, "array 'n' must hold whole numbers below 2\\*\\*53 to be saved as PLY"),
        ({"x": np.arange(N)}, "arrays must have names of their own to be saved as PLY, not 'x' twice"),
        ({"a b": np.ones(N), "a_b": np.ones(N)}, "arrays must have names of their own .* not 'a_b' twice"),
        ({"uv": np.ones((N, 2)), "uv_0": np.ones(N)}, "arrays must have names of their own .* not 'uv_0' twice"),
        ({"colors": COLORS, "red": np.ones(N)}, "arrays must have names of their own .* not 'red' twice"),
        ({"nx": np.ones(N)}, "array 'nx' must have another name to be saved as PLY, where it is of the normals"),
    ],
)
def test_what_ply_cannot_hold_is_refused(data, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        sm.PointCloud(BALL.vertices, data=data).save(tmp_path / "a.ply")
    assert not list(tmp_path.iterdir())


def test_ply_as_text(tmp_path):
    rows = "\n".join(f"{i} {i * i} 0 {i} 0 255 0.5" for i in range(4))
    head = "ply\nformat ascii 1.0\ncomment Units: millimeters\nelement vertex 4\n"
    kinds = [*(f"property float {c}" for c in "xyz"), *(f"property uchar {c}" for c in ("red", "green", "blue"))]
    body = "\n".join([*kinds, "property float confidence", "end_header", rows])
    (tmp_path / "a.ply").write_text(head + body + "\n")
    found = sm.read(tmp_path / "a.ply")
    assert found.unit == "mm"
    assert_array_equal(found.data["colors"], [[i, 0, 255] for i in range(4)])
    assert found.data["colors"].dtype == np.uint8
    assert_array_equal(found.data["confidence"], [0.5] * 4)


def test_obj_keeps_colors_texture_and_unit(tmp_path):
    import trimesh

    with pytest.warns(
        sm.SimplexMeshWarning, match="OBJ files do not hold these arrays, .* left out: intensity, label$"
    ):
        SURFACE.save(tmp_path / "a.obj")
    found = sm.read(tmp_path / "a.obj")
    assert found.unit == "mm"
    assert sorted(found.data) == ["colors", "uv"]
    assert_array_equal(found.data["colors"], SURFACE.data["colors"])
    assert_allclose(found.data["uv"], SURFACE.data["uv"], atol=1e-6)  # VTK has them in single precision
    SURFACE.with_data(colors=None, intensity=None, label=None).save(tmp_path / "b.obj")
    assert_allclose(trimesh.load(tmp_path / "b.obj", process=False).visual.uv, SURFACE.data["uv"], atol=1e-12)


@pytest.mark.parametrize(("ending", "lost"), [
    (".stl", "colors, intensity, label, uv"), (".off", "colors, intensity, label, uv"),
    (".xyz", "colors, intensity, label, uv"), (".3mf", "colors, intensity, label, uv"), (".glb", "frame"),
])  # fmt: skip
def test_arrays_that_a_format_does_not_hold_are_named(ending, lost, tmp_path):
    thing = SURFACE.with_data(frame=np.zeros((SURFACE.n_vertices, 9))) if ending == ".glb" else SURFACE
    said = f"{ending[1:].upper()} files do not hold these arrays, which were left out: {lost}$"
    with pytest.warns(sm.SimplexMeshWarning, match=said):
        thing.save(tmp_path / f"a{ending}")
    SURFACE.with_data(**dict.fromkeys(SURFACE.data)).save(tmp_path / f"a{ending}")  # nothing to tell


def test_arrays_that_nobody_gave_are_not_missed(tmp_path):
    model = sm.reconstruct(BALL.vertices, vertices=200, iterations=0).mesh
    assert {"distance", "metric"} <= set(model.data)
    model.save(tmp_path / "a.stl")
    model.triangulated().save(tmp_path / "a.stl")


def test_names_of_ply_with_numbers_come_back(tmp_path):
    data = {"uv_0": np.arange(N) / N, "uv_1": np.ones(N), "st": np.ones((N, 2)), "rgb": np.zeros(N, np.int32)}
    for name in ("red", "green", "blue"):
        data[name] = np.linspace(0, 9, N)
    cloud = sm.PointCloud(BALL.vertices, data=data)
    cloud.save(tmp_path / "a.ply")
    same(sm.read(tmp_path / "a.ply"), cloud)


def test_textures_without_seams_come_from_trimesh():
    import trimesh

    at = np.random.default_rng(0).random((SURFACE.n_vertices, 2))
    given = trimesh.Trimesh(SURFACE.vertices, SURFACE.faces, process=False)
    given.visual = trimesh.visual.TextureVisuals(uv=at)
    assert_array_equal(as_triangles(given).data["uv"], at)
    rows = SURFACE.faces.ravel()
    seamy = trimesh.Trimesh(SURFACE.vertices[rows], np.arange(len(rows)).reshape(-1, 3), process=False)
    seamy.visual = trimesh.visual.TextureVisuals(uv=np.random.default_rng(0).random((len(rows), 2)))
    with pytest.warns(sm.SimplexMeshWarning, match="merged"):
        assert "uv" not in as_triangles(seamy).data


def test_obj_as_vtk_reads_it_in_single_precision(tmp_path):
    small = SURFACE.transformed(np.diag([0.3, 0.3, 0.3, 1])).with_data(intensity=None, label=None, uv=None)
    small.save(tmp_path / "a.obj")
    rounded = replace(small, vertices=small.vertices.astype(np.float32), data={})
    assert_array_equal(with_colors(rounded, tmp_path / "a.obj").data["colors"], SURFACE.data["colors"])


def test_pyvista_brings_all_arrays():
    same(as_triangles(SURFACE.to_pyvista()), SURFACE)


@pytest.mark.parametrize("line", ["mtllib", "mtllib a b.mtl", "mtllib a.mtl b.mtl", "usemtl my mat", "usemtl"])
def test_obj_whatever_its_lines_of_materials(line, tmp_path):
    SURFACE.with_data(intensity=None, label=None).save(tmp_path / "a.obj")
    rows = (tmp_path / "a.obj").read_text().splitlines()
    last = next(k for k, row in enumerate(rows) if row.startswith("f ")) + SURFACE.n_faces // 2
    path = tmp_path / "b.obj"
    path.write_text("\r\n".join([line, *rows[:last], line, "usemtl other", *rows[last:], ""]), newline="")
    plain, found = sm.read(tmp_path / "a.obj"), sm.read(path)
    assert_array_equal(found.faces, plain.faces)
    assert found.unit == plain.unit
    assert found.data.keys() == plain.data.keys() == {"colors", "uv"}
    for name, values in plain.data.items():
        assert_array_equal(found.data[name], values)


@pytest.mark.parametrize("line", ["f 1 2", "f 2/2 7/7 ", "f 3", "f", "f 1 2 # an edge"])
def test_obj_with_loose_edges_among_its_faces(line, tmp_path):
    SURFACE.with_data(intensity=None, label=None).save(tmp_path / "a.obj")
    plain, path = sm.read(tmp_path / "a.obj"), tmp_path / "b.obj"
    rows = (tmp_path / "a.obj").read_text().splitlines()
    path.write_text("\n".join([*rows[:-1], line, *rows[-1:], line, ""]))
    with pytest.warns(sm.SimplexMeshWarning, match=r"b\.obj: left out 2 faces of fewer than three corners"):
        assert_array_equal(sm.read(path).faces, plain.faces)
    path.write_text("\n".join([*rows, line.partition(" #")[0].strip()]))  # the file may end within a face
    with pytest.raises(OSError, match=r"b\.obj cannot be read as OBJ"):
        sm.read(path)


def test_obj_with_seams_and_with_colors_of_some_vertices(tmp_path):
    corners = ["0 0 0 1 0 0", "1 0 0 0 1 0", "0 1 0 0 0 1", "0 0 1 0 0 0"]
    faces = "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 1/2 2/3 4/1\n"
    (tmp_path / "a.obj").write_text("".join(f"v {row}\n" for row in corners) + faces)
    found = sm.read(tmp_path / "a.obj")
    assert found.n_vertices == 4  # VTK has six
    assert list(found.data) == ["colors"]
    for position, color in zip(found.vertices, found.data["colors"], strict=True):
        assert f"{' '.join(f'{x:g}' for x in [*position, *(color / 255)])}" in corners
    (tmp_path / "b.obj").write_text("".join(f"v {row}\n" for row in [*corners[:3], "0 0 1"]) + faces)
    assert not sm.read(tmp_path / "b.obj").data


@pytest.mark.parametrize("name", ["rgb", "rgba"])
@pytest.mark.parametrize("storage", ["ascii", "binary"])
def test_pcd_with_packed_colors(name, storage, tmp_path):
    packed = [0x80FF0001, 0x80010203, 0x80000000, 0x80FFFFFF]
    kind = "F" if name == "rgb" else "U"
    head = f"VERSION .7\nFIELDS x y z {name} label _\nSIZE 4 4 4 4 2 1\nTYPE F F F {kind} U U\nCOUNT 1 1 1 1 1 2\n"
    head += f"WIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA {storage}\n"
    rows = [(float(i), float(i * i), 0.0, color, 7 + i, 0, 0) for i, color in enumerate(packed)]
    if storage == "binary":
        body = b"".join(struct.pack("<3fIH2B", *row) for row in rows)
    else:
        shown = [np.uint32(color).view(np.float32) if kind == "F" else color for color in packed]
        body = "\n".join(f"{r[0]} {r[1]} {r[2]} {c!s} {r[4]} 0 0" for r, c in zip(rows, shown, strict=True)).encode()
    (tmp_path / "a.pcd").write_bytes(head.encode() + body)
    found = sm.read(tmp_path / "a.pcd").data
    wanted = [[255, 0, 1, 128], [1, 2, 3, 128], [0, 0, 0, 128], [255, 255, 255, 128]]
    assert sorted(found) == ["colors", "label"]
    assert_array_equal(found["colors"], np.array(wanted)[:, : len(name)])
    assert found["label"].tolist() == [7, 8, 9, 10]
    assert found["label"].dtype == np.uint16


def test_csv_with_names(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,R,G,B,depth\n0,0,0,9,9,9,1\n1,0,0,255,0,1,2\n0,1,0,0,0,0,3\n0,0,1,1,1,1,4\n")
    found = sm.read(tmp_path / "a.csv").data
    assert found["colors"].dtype == np.uint8
    assert found["colors"][1].tolist() == [255, 0, 1]
    assert found["depth"].tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("header", "unit"), [("x [mm],y [mm],z [mm]", "mm"), ("X (Meters),Y,Z", "m"), ("x [px],y,z", None), ("x,y,z", None)]
)
def test_csv_with_a_unit(header, unit, tmp_path):
    (tmp_path / "a.csv").write_text(f"{header}\n0,0,0\n1,0,0\n0,1,0\n0,0,1\n")
    assert sm.read(tmp_path / "a.csv").unit == unit


def test_vtk_as_others_write_it(tmp_path):
    ball = pv.Sphere()
    ball["RGB"] = RNG.integers(0, 256, (ball.n_points, 3)).astype(np.uint8)
    ball["heat"] = ball.points[:, 2]
    ball.save(tmp_path / "a.vtk")
    found = sm.read(tmp_path / "a.vtk")
    assert_array_equal(found.data["colors"], ball["RGB"])
    assert_allclose(found.data["heat"], found.vertices[:, 2])
    assert "Normals" not in found.data


def test_pyvista_gets_arrays_that_can_be_written_to():
    shown = CLOUD.to_pyvista()
    assert shown.field_data["unit"][0] == "mm"
    shown["intensity"][:] = 0
    shown.points[:] = 0
    assert CLOUD.data["intensity"].all()
    assert CLOUD.points.any()


@pytest.mark.parametrize("ending", [".mha", ".nrrd", ".nii", ".nii.gz", ".vti"])
def test_volumes_remember_their_unit(ending, tmp_path):
    volume = sm.Volume(np.arange(60.0).reshape(3, 4, 5), spacing=(1, 2, 3), unit="cm")
    volume.save(tmp_path / f"a{ending}")
    found = sm.read(tmp_path / f"a{ending}")
    assert found.unit == ("mm" if ".nii" in ending else "cm")
    assert_allclose(found.in_unit("cm").spacing, (1, 2, 3), rtol=1e-6)


@pytest.mark.parametrize(("field", "unit"), [
    ('space units: "um" "um" "um"', "um"), ('space units: "mm" "mm" "s"', None), ('space units: "px" "px" "px"', None),
])  # fmt: skip
def test_nrrd_says_the_unit_of_its_space(field, unit, tmp_path):
    head = "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 3 3\nencoding: raw\n"
    head += f"space directions: (1,0,0) (0,1,0) (0,0,1)\n{field}\n\n"
    (tmp_path / "a.nrrd").write_bytes(head.encode() + bytes(range(27)))
    assert sm.read(tmp_path / "a.nrrd").unit == unit
    plain = head.replace("space: left-posterior-superior\n", "").replace(
        "space directions: (1,0,0) (0,1,0) (0,0,1)\n", ""
    )
    (tmp_path / "b.nrrd").write_bytes(plain.replace("space units", "units").encode() + bytes(range(27)))
    assert sm.read(tmp_path / "b.nrrd").unit == unit


def test_glb_is_in_meters(tmp_path):
    import trimesh

    SURFACE.save(tmp_path / "a.glb")
    scene = trimesh.load(tmp_path / "a.glb")
    (inside,) = scene.geometry.values()
    assert_allclose(scene.extents, np.ptp(SURFACE.bounds, axis=0) / 1000, rtol=1e-6)
    assert_array_equal(inside.visual.vertex_colors[:, :3], SURFACE.data["colors"])
    assert_allclose(inside.vertex_attributes["_intensity"].ravel(), SURFACE.data["intensity"])


def test_glb_is_read_back_in_meters(tmp_path):
    pytest.importorskip("trimesh")
    SURFACE.save(tmp_path / "a.glb")
    found = sm.read_triangles(tmp_path / "a.glb")
    assert found.unit == "m"
    assert_allclose(found.in_unit("mm").vertices, SURFACE.vertices, atol=1e-6 * SURFACE.diagonal)
    assert_array_equal(found.faces, SURFACE.faces)
    assert_array_equal(found.data["colors"], SURFACE.data["colors"])
    assert_allclose(found.data["intensity"], SURFACE.data["intensity"])


def test_parts_of_a_glb_scene_are_in_place(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene(trimesh.creation.box())
    scene.add_geometry(trimesh.creation.icosphere(), transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    scene.export(tmp_path / "a.glb")
    found = sm.read(tmp_path / "a.glb")
    assert_allclose(found.bounds, [[-0.5, -1, -1], [6, 1, 1]], atol=1e-6)
    assert (found.n_vertices, found.n_faces) == (8 + 642, 12 + 1280)


def test_what_is_no_surface_in_a_glb_scene_is_told(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    wire = trimesh.load_path(np.eye(3))
    trimesh.Scene([trimesh.creation.box(), wire]).export(tmp_path / "a.glb")
    with pytest.warns(sm.SimplexMeshWarning, match=r"a.glb: parts of the scene of another kind are left out: 1"):
        assert sm.read(tmp_path / "a.glb").n_faces == 12
    trimesh.Scene(wire).export(tmp_path / "b.glb")
    with pytest.raises(ValueError, match=r"b.glb: must hold triangles or points, it has neither"):
        sm.read(tmp_path / "b.glb")


@pytest.mark.parametrize("damage", ["cut", "count", "elsewhere"])
def test_a_damaged_glb_file_is_refused(damage, tmp_path):
    """Cut off, with more entries than it has bytes, or with its numbers in another file."""
    pytest.importorskip("trimesh")
    path = tmp_path / "a.glb"
    sm.TriangleMesh(SURFACE.vertices, SURFACE.faces).save(path)
    content = path.read_bytes()
    size = int.from_bytes(content[12:16], "little")
    described, numbers = json.loads(content[20 : 20 + size]), content[28 + size :]
    if damage == "count":
        described["accessors"][1] |= {"count": 10**6}  # without a buffer: zeros
        del described["accessors"][1]["bufferView"]
    elif damage == "elsewhere":
        (tmp_path / "numbers.bin").write_bytes(numbers)
        described["buffers"][0]["uri"] = "numbers.bin"
        numbers = b""
    text = json.dumps(described).encode()
    text = text.ljust(100_000)  # so that the file is longer than its numbers are many
    body = len(text).to_bytes(4, "little") + b"JSON" + text
    if numbers:
        body += len(numbers).to_bytes(4, "little") + b"BIN\0" + numbers
    whole = b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body
    path.write_bytes(whole[: len(whole) // 2] if damage == "cut" else whole)
    with pytest.raises(OSError, match=r"a.glb is damaged"):
        sm.read(path)


def test_3mf_is_in_millimeters(tmp_path):
    import trimesh

    pytest.importorskip("lxml")
    SURFACE.with_data(**dict.fromkeys(DATA)).in_unit("m").save(tmp_path / "a.3mf")
    assert_allclose(trimesh.load(tmp_path / "a.3mf").extents, np.ptp(SURFACE.bounds, axis=0), rtol=1e-9)


def test_3mf_is_read_back_in_its_unit(tmp_path):
    pytest.importorskip("lxml")
    plain = SURFACE.with_data(**dict.fromkeys(DATA))
    plain.save(tmp_path / "a.3mf")
    found = sm.read_triangles(tmp_path / "a.3mf")
    assert found.unit == "mm"
    assert_allclose(found.vertices, plain.in_unit("mm").vertices, rtol=1e-9, atol=1e-9)
    assert_array_equal(found.faces, plain.faces)
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene(trimesh.creation.box())
    scene.add_geometry(trimesh.creation.icosphere(), transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    scene.export(tmp_path / "millimeters.3mf")
    with zipfile.ZipFile(tmp_path / "millimeters.3mf") as given, zipfile.ZipFile(tmp_path / "b.3mf", "w") as archive:
        for name in given.namelist():
            archive.writestr(name, given.read(name).replace(b'"millimeter"', b'"inch"'))
    both = sm.read(tmp_path / "b.3mf")
    assert both.unit == "in"
    assert_allclose(both.bounds, [[-0.5, -1, -1], [6, 1, 1]], atol=1e-6)
    assert (both.n_vertices, both.n_faces) == (8 + 642, 12 + 1280)


@pytest.mark.parametrize("damage", ["cut", "bomb", "copies", "empty"])
def test_a_damaged_3mf_file_is_refused(damage, tmp_path, monkeypatch):
    pytest.importorskip("lxml")
    path = tmp_path / "a.3mf"
    sm.TriangleMesh(SURFACE.vertices, SURFACE.faces).save(path)
    content = path.read_bytes()
    if damage == "bomb":
        monkeypatch.setattr("trimesh.load_scene", lambda *_, **__: pytest.fail("unpacked"))
        with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("3D/more.model", b" " * 2000 * len(content))
    elif damage == "copies":
        monkeypatch.setattr("simplexmesh.data.exporting.MOST_FACES", SURFACE.n_faces - 1)
    else:
        path.write_bytes(content[: len(content) // 2 if damage == "cut" else 2])
    with pytest.raises(OSError, match=r"a.3mf is damaged"):
        sm.read(path)


@pytest.mark.parametrize("ending", [".glb", ".3mf"])
def test_what_trimesh_writes_needs_faces_and_trimesh(ending, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"path must end with one of .vtp, .ply, .xyz, .las, .laz, .e57 for points"):
        CLOUD.save(tmp_path / f"a{ending}")
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(ImportError, match=r"this needs the extra export: pip install 'simplexmesh\[export\]'"):
        MESH.save(tmp_path / f"a{ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "surface", [MESH, MESH.triangulated(), CLOUD, MESH.vertices], ids=lambda each: type(each).__name__
)
def test_curvatures_are_saved_on_their_surface(surface, tmp_path):
    found = sm.curvature(surface)
    sm.save(found, tmp_path / "curvature.vtp")
    read = sm.read(tmp_path / "curvature.vtp")
    for name in ("k1", "k2", "mean", "gauss", "d1", "error", "scale", "failed"):
        assert_array_equal(read.data[name], getattr(found, name))
    assert read.unit == getattr(surface, "unit", None)
    with pytest.raises(ValueError, match="curvature must be that of a whole surface to be saved"):
        sm.save(sm.curvature(surface, at=[0, 1]), tmp_path / "a.vtp")


def test_poses_are_saved_as_they_are_read(tmp_path):
    egg = sm.ellipsoid((3, 2, 1), 12)
    egg = egg.moved(egg.vertices + 0.1 * egg.vertices**2)
    moved = egg.moved(egg.vertices + np.array([0.2, 0, 0]))
    found = sm.register(egg, moved), sm.align(egg, moved, (egg.vertices[:9], moved.vertices[:9]))
    for k, result in enumerate(found):
        sm.save(result, tmp_path / f"{k}.json")
        assert_array_equal(sm.read_poses(tmp_path / f"{k}.json")["source"], result.T_target_source)
        with pytest.raises(ValueError, match=r"path must end with .json for poses, not .vtp \(a.vtp\)"):
            result.save(tmp_path / "a.vtp")


def test_anything_is_saved(tmp_path):
    for name, thing in {
        "mesh.vtp": MESH,
        "points.ply": CLOUD,
        "volume.nrrd": sm.Volume(np.zeros((2, 2, 2))),
        "array.xyz": CLOUD.points,
        "shown.ply": SURFACE.to_pyvista(),
        "signature.vtp": sm.sai(MESH, 5),
    }.items():
        sm.save(thing, tmp_path / name)
        assert (tmp_path / name).stat().st_size
    assert_array_equal(sm.read(tmp_path / "shown.ply").data["label"], SURFACE.data["label"])
    with pytest.raises(TypeError, match=r"data must be a Volume, .*, not int"):
        sm.save(3, tmp_path / "a.ply")
    with pytest.raises(TypeError, match="path must be a string or a Path, not SimplexMesh"):
        sm.save(tmp_path / "a.ply", MESH)


def test_primitives_are_saved_as_their_triangles(tmp_path):
    ball = sm.primitives.Sphere((0, 0, 0), 2.0)
    sm.save(ball, tmp_path / "a.ply")
    assert_allclose(ball.distance(sm.read(tmp_path / "a.ply").vertices), 0, atol=1e-9)
    with pytest.raises(ValueError, match="a cylinder without a fit has no ends"):
        sm.save(sm.primitives.Cylinder((0, 0, 0), (0, 0, 1), 2.0), tmp_path / "b.ply")
    with pytest.raises(ValueError, match="a line is a curve, and has no triangles"):
        sm.save(sm.primitives.Line((0, 0, 0), (0, 0, 1)), tmp_path / "b.ply")
    assert not (tmp_path / "b.ply").exists()
