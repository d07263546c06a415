"""LAS, LAZ and E57: written by us and read back, written by their own libraries, and damaged."""

from __future__ import annotations

import struct
import sys
import tracemalloc
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning

laspy = pytest.importorskip("laspy")
pytest.importorskip("lazrs")
with warnings.catch_warnings(action="ignore"):  # of what pye57 imports
    pye57 = pytest.importorskip("pye57")
libe57 = pye57.libe57

from simplexmesh.data.io.survey import e57, las  # noqa: E402

ALL = [".las", ".laz", ".e57"]
RNG = np.random.default_rng(5)
N = 700
FAR = np.array([1_234_567.0, 5_432_109.0, 250.0])
POINTS = FAR + np.round(RNG.uniform(0, 100, (N, 3)), 3)
ULP = np.spacing(np.abs(POINTS).max())
DATA = {
    "intensity": RNG.integers(0, 65536, N).astype(np.uint16),
    "classification": RNG.integers(0, 256, N).astype(np.uint8),
    "colors": RNG.integers(0, 256, (N, 3)).astype(np.uint8),
    "gps_time": RNG.uniform(0, 1e9, N),
    "labels": RNG.integers(-1, 9, N),
    "small": RNG.integers(-100, 100, N).astype(np.int8),
    "uv": RNG.random((N, 2), np.float32),
    "name_0": RNG.random(N),
    "name.1": RNG.integers(0, 9, N).astype(np.uint32),
}


@pytest.fixture
def pieces(monkeypatch):
    """Files in many pieces."""
    monkeypatch.setattr(las, "PIECE", 90)
    monkeypatch.setattr(e57, "PIECE", 90)


def directions(n):
    found = RNG.normal(size=(n, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


class TestRoundTrip:
    @pytest.mark.parametrize("ending", ALL)
    def test_nothing_is_lost_far_from_the_origin(self, ending, tmp_path, pieces):
        cloud = sm.PointCloud(POINTS, directions(N), DATA, "m")
        cloud.save(tmp_path / f"a{ending}")
        again = sm.read_points(tmp_path / f"a{ending}")
        assert_allclose(again.points, POINTS, rtol=0, atol=ULP)
        assert_allclose(again.normals, cloud.normals, atol=1e-15)
        assert again.unit == "m"
        assert {name.replace(".", "_") for name in DATA} == {name.replace(".", "_") for name in again.data}
        for name, values in DATA.items():
            found = again.data[name.replace(".", "_")]
            assert found.dtype == values.dtype, name
            assert_array_equal(found, values)

    @pytest.mark.parametrize("ending", ALL)
    @pytest.mark.parametrize("extent", [1e-6, 0.3, 5e3, 1e9])
    def test_points_off_any_grid_keep_31_bits_of_their_extent(self, ending, extent, tmp_path):
        points = np.array([3, -7, 0]) + RNG.uniform(-extent, extent, (N, 3))
        sm.save(points, tmp_path / f"a{ending}")
        off = np.abs(sm.read(tmp_path / f"a{ending}").points - points).max()
        assert off <= max(10 * 2 * extent / 2**32, np.spacing(extent + 7))

    @pytest.mark.parametrize("ending", ALL)
    def test_planar_clouds_and_bools(self, ending, tmp_path):
        points = POINTS * [1, 1, 0] + [0, 0, 1 / 3]
        sm.PointCloud(points, data={"seen": points[:, 0] > FAR[0] + 50}).save(tmp_path / f"a{ending}")
        again = sm.read(tmp_path / f"a{ending}")
        assert_allclose(again.points, points, rtol=0, atol=ULP)
        assert_array_equal(again.data["seen"], points[:, 0] > FAR[0] + 50)
        assert again.normals is None
        assert list(again.data) == ["seen"]

    @pytest.mark.parametrize("ending", ALL)
    def test_reading_takes_little_more_room_than_the_cloud(self, ending, tmp_path, monkeypatch):
        monkeypatch.setattr(las, "PIECE", 10_000)
        monkeypatch.setattr(e57, "PIECE", 10_000)
        n = 200_000
        sm.PointCloud(RNG.random((n, 3)), data={"intensity": np.arange(n) % 999}).save(tmp_path / f"a{ending}")
        tracemalloc.start()
        cloud = sm.read(tmp_path / f"a{ending}")
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 3 * (cloud.points.nbytes + sum(values.nbytes for values in cloud.data.values()))
        assert not cloud.points.flags.writeable

    def test_vertices_of_a_mesh(self, tmp_path):
        ball = sm.sphere(5)
        ball.save(tmp_path / "a.laz")
        assert_allclose(sm.read(tmp_path / "a.laz").points, ball.vertices, atol=1e-8)


class TestLas:
    @pytest.mark.parametrize("ending", [".las", ".laz"])
    @pytest.mark.parametrize("kind", range(9))
    def test_point_formats(self, kind, ending, tmp_path, pieces):
        if kind in (4, 5) and ending == ".laz":
            kind = 3  # LAZ has no pulses of old formats
        header = laspy.LasHeader(point_format=kind, version="1.4")
        header.scales, header.offsets = [0.001, 0.01, 0.00025], [1e6, 5e6, -0.5]
        made = laspy.LasData(header)
        X = RNG.integers(-(2**31), 2**31, (N, 3)).astype(np.int32)
        made.points = laspy.ScaleAwarePointRecord.zeros(N, header=header)
        made.X, made.Y, made.Z = X.T
        made.intensity, made.classification = DATA["intensity"], DATA["classification"] % 32
        if "gps_time" in made.point_format.dimension_names:
            made.gps_time = DATA["gps_time"]
        if "red" in made.point_format.dimension_names:
            made.red, made.green, made.blue = 257 * DATA["colors"].T.astype(np.uint16)
        made.write(tmp_path / f"a{ending}")
        cloud = sm.read(tmp_path / f"a{ending}")
        assert_array_equal(cloud.points, X * np.array([0.001, 0.01, 0.00025]) + [1e6, 5e6, -0.5])
        assert cloud.unit is None
        assert_array_equal(cloud.data["intensity"], DATA["intensity"])
        assert_array_equal(cloud.data["classification"], DATA["classification"] % 32)
        assert {*cloud.data} - {"intensity", "classification"} == {
            *(["gps_time"] if "gps_time" in made.point_format.dimension_names else []),
            *(["colors"] if "red" in made.point_format.dimension_names else []),
        }
        if "colors" in cloud.data:
            assert_array_equal(cloud.data["colors"], DATA["colors"])

    @pytest.mark.parametrize("scale", [1.0, 0.01, 0.001, 1e-5])
    def test_what_was_read_is_written_on_the_grid_of_its_file(self, scale, tmp_path):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = [scale] * 3, [1e6, 5e6, 0]
        with laspy.open(tmp_path / "a.las", "w", header=header) as file:
            piece = laspy.ScaleAwarePointRecord.zeros(N, header=header)
            for axis in "XYZ":
                piece[axis] = RNG.integers(-10_000_000, 10_000_000, N).astype(np.int32)
            file.write_points(piece)
        cloud = sm.read(tmp_path / "a.las")
        cloud.save(tmp_path / "b.laz")
        with laspy.open(tmp_path / "b.laz") as file:
            assert_array_equal(file.header.scales, [scale] * 3)
            assert file.header.are_points_compressed
        assert_allclose(sm.read(tmp_path / "b.laz").points, cloud.points, rtol=0, atol=ULP)

    def test_colors_of_16_bits_that_are_bytes(self, tmp_path):
        self.write_colors(tmp_path / "a.las", DATA["colors"].T)
        assert_array_equal(sm.read(tmp_path / "a.las").data["colors"], DATA["colors"])

    def test_opacity(self, tmp_path):
        colors = RNG.integers(0, 256, (N, 4)).astype(np.uint8)
        sm.PointCloud(POINTS, data={"colors": colors}).save(tmp_path / "a.las")
        assert_array_equal(sm.read(tmp_path / "a.las").data["colors"], colors)

    def test_colors_that_are_none(self, tmp_path):
        sm.PointCloud(POINTS, data={"colors": RNG.random((N, 3))}).save(tmp_path / "a.las")
        assert sm.read(tmp_path / "a.las").data["colors"].dtype == np.float64

    def write_colors(self, path, channels):
        header = laspy.LasHeader(point_format=2)
        piece = laspy.ScaleAwarePointRecord.zeros(N, header=header)
        piece["X"] = np.arange(N, dtype=np.int32)
        for name, channel in zip(("red", "green", "blue"), channels, strict=True):
            piece[name] = channel.astype(np.uint16)
        with laspy.open(path, "w", header=header) as file:
            file.write_points(piece)

    def test_shares_of_intensity_and_angles_of_old_files(self, tmp_path):
        sm.PointCloud(POINTS, data={"intensity": np.linspace(0, 1, N)}).save(tmp_path / "a.las")
        assert_array_equal(sm.read(tmp_path / "a.las").data["intensity"], np.rint(np.linspace(0, 65535, N)))
        header = laspy.LasHeader(point_format=0)
        piece = laspy.ScaleAwarePointRecord.zeros(4, header=header)
        piece["X"], piece["scan_angle_rank"] = np.arange(4, dtype=np.int32), np.array([-90, 0, 3, 90], np.int8)
        with laspy.open(tmp_path / "b.las", "w", header=header) as file:
            file.write_points(piece)
        assert_array_equal(sm.read(tmp_path / "b.las").data["scan_angle"], [-15000, 0, 500, 15000])

    @pytest.mark.parametrize("unit", [None, "m", "mm", "ft", "in", "km"])
    def test_units(self, unit, tmp_path):
        sm.PointCloud(POINTS, unit=unit).save(tmp_path / "a.las")
        assert sm.read(tmp_path / "a.las").unit == unit

    @pytest.mark.parametrize(
        ("text", "unit"),
        [
            ('PROJCS["x",GEOGCS["y",UNIT["degree",0.0174532925199433]],UNIT["metre",1]]', "m"),
            ('COMPD_CS["x",PROJCS["y",UNIT["metre",1.0]],VERT_CS["z",UNIT["metre",1]]]', "m"),
            ('COMPD_CS["x",PROJCS["y",UNIT["metre",1.0]],VERT_CS["z",UNIT["foot",0.3048]]]', None),
            ('PROJCS["x",UNIT["US survey foot",0.304800609601219]]', None),
            ('PROJCS["x",UNIT["foot",0.304800609601219]]', None),
            ('COMPD_CS["x",GEOGCS["y",UNIT["degree",0.01745]],VERT_CS["z",UNIT["metre",1]]]', None),
        ],
    )
    def test_units_of_coordinate_systems(self, text, unit, tmp_path):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(text))
        piece = laspy.ScaleAwarePointRecord.zeros(4, header=header)
        piece["X"] = np.arange(4, dtype=np.int32)
        with laspy.open(tmp_path / "a.las", "w", header=header) as file:
            file.write_points(piece)
        assert sm.read(tmp_path / "a.las").unit == unit

    @pytest.mark.parametrize(("code", "unit"), [(9001, "m"), (9002, "ft"), (9003, None)])
    def test_units_of_geotiff(self, code, unit, tmp_path):
        keys = laspy.vlrs.known.GeoKeyDirectoryVlr()
        keys.parse_record_data(struct.pack("<8H", 1, 1, 0, 1, 3076, 0, 1, code))
        header = laspy.LasHeader(point_format=0)
        header.vlrs.append(keys)
        piece = laspy.ScaleAwarePointRecord.zeros(4, header=header)
        piece["X"] = np.arange(4, dtype=np.int32)
        with laspy.open(tmp_path / "a.las", "w", header=header) as file:
            file.write_points(piece)
        assert sm.read(tmp_path / "a.las").unit == unit

    @pytest.mark.parametrize(("seconds", "kind"), [(600_000.0, 0), (700_000.0, 1)])
    def test_times_of_a_week_and_from_an_epoch(self, seconds, kind, tmp_path):
        sm.PointCloud(POINTS, data={"gps_time": np.full(N, seconds)}).save(tmp_path / "a.las")
        with laspy.open(tmp_path / "a.las") as file:
            assert file.header.global_encoding.gps_time_type == kind

    def test_other_programs_find_valid_returns(self, tmp_path):
        sm.PointCloud(POINTS).save(tmp_path / "a.las")
        found = laspy.read(tmp_path / "a.las")
        assert (np.asarray(found.return_number) == 1).all()
        assert (np.asarray(found.number_of_returns) == 1).all()
        assert_allclose(found.header.mins, POINTS.min(axis=0), atol=ULP)
        assert_allclose(found.header.maxs, POINTS.max(axis=0), atol=ULP)
        assert list(sm.read(tmp_path / "a.las").data) == []

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            ({"intensity": [0, 1, 2, 65536]}, "array 'intensity' must hold whole numbers from 0 to 65535 to be saved"),
            ({"intensity": [0, 1, 2, 3.5]}, "array 'intensity' must hold whole numbers from 0 to 65535"),
            ({"return_number": [0, 1, 2, 16]}, "array 'return_number' must hold whole numbers from 0 to 15"),
            ({"X": [0, 1, 2, 3]}, "array 'X' must have another name to be saved as LAS, where this one is taken"),
            ({"NormalX": [0, 1, 2, 3]}, "array 'NormalX' must have another name"),
            ({"a" * 33: [0, 1, 2, 3]}, "must have a name of 1 to 32 bytes to be saved as LAS"),
        ],
    )
    def test_refused_arrays(self, data, message, tmp_path):
        with pytest.raises(ValueError, match=message):
            sm.PointCloud(np.eye(4)[:, :3], np.ones((4, 3)), data).save(tmp_path / "a.las")
        assert not list(tmp_path.iterdir())


def write_scans(path, scans):
    """Write scans of dicts: `fields` by name, as pairs of a node maker and values; optional pose, limits."""
    with pye57.E57(str(path), "w") as file:
        image = file.image_file
        image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
        for each in scans:
            scan, prototype = libe57.StructureNode(image), libe57.StructureNode(image)
            scan.set("guid", libe57.StringNode(image, "{1}"))
            for name, values in each.items():
                if name != "fields":
                    scan.set(name, tree(image, values))
            buffers, rooms = libe57.VectorSourceDestBuffer(), []
            for name, (node, values) in each["fields"].items():
                prototype.set(name, node(image))
                values = np.asarray(values)
                rooms.append(values.astype(np.longlong if values.dtype.kind in "iu" else values.dtype))
                count = len(values)
                buffers.append(libe57.SourceDestBuffer(image, name, rooms[-1], count, True, True))
            points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
            scan.set("points", points)
            file.data3d.append(scan)
            writer = points.writer(buffers)
            writer.write(count)
            writer.close()


def tree(image, values):
    if not isinstance(values, dict):
        return libe57.FloatNode(image, float(values))
    out = libe57.StructureNode(image)
    for name, value in values.items():
        out.set(name, tree(image, value))
    return out


def double(image):
    return libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE)


def whole(low, high):
    return lambda image: libe57.IntegerNode(image, low, low, high)


def axes(points):
    return {f"cartesian{axis}": (double, column) for axis, column in zip("XYZ", points.T, strict=True)}


def pose(rotation, shift):
    x, y, z, w = rotation.as_quat()
    return {
        "rotation": {"w": w, "x": x, "y": y, "z": z},
        "translation": dict(zip("xyz", shift, strict=True)),
    }


class TestE57:
    def test_scans_are_put_in_place(self, tmp_path, pieces):
        turns = Rotation.from_euler("zyx", [[0.3, -0.4, 2.0], [-1.0, 0.2, 0.1]])
        shifts = FAR + np.array([[0, 0, 0], [10, -4, 2.5]])
        locals_ = [RNG.normal(size=(300, 3)), RNG.normal(size=(400, 3))]
        sides = [directions(300), directions(400)]
        scans = [
            {
                "pose": pose(turn, shift),
                "fields": axes(local)
                | {"intensity": (double, local[:, 0])}
                | {f"nor:normal{axis}": (double, column) for axis, column in zip("XYZ", side.T, strict=True)},
            }
            for turn, shift, local, side in zip(turns, shifts, locals_, sides, strict=True)
        ]
        scans[1]["fields"]["rowIndex"] = whole(0, 999), np.arange(400)
        write_scans(tmp_path / "a.e57", scans)
        cloud = sm.read(tmp_path / "a.e57")
        placed = [turn.apply(local) + shift for turn, local, shift in zip(turns, locals_, shifts, strict=True)]
        assert_allclose(cloud.points, np.concatenate(placed), rtol=0, atol=2 * ULP)
        turned = [turn.apply(side) for turn, side in zip(turns, sides, strict=True)]
        assert_allclose(cloud.normals, np.concatenate(turned), atol=1e-12)
        assert_array_equal(cloud.data["scan"], np.repeat([0, 1], [300, 400]))
        assert_array_equal(cloud.data["viewpoint"], np.repeat(shifts, [300, 400], axis=0))
        assert_array_equal(cloud.data["intensity"], np.concatenate(locals_)[:, 0])
        assert {*cloud.data} == {"scan", "viewpoint", "intensity"}  # not all have rows
        assert cloud.unit == "m"

    def test_a_scan_without_a_pose(self, tmp_path):
        write_scans(tmp_path / "a.e57", [{"fields": axes(POINTS) | {"rowIndex": (whole(0, 70_000), np.arange(N))}}])
        cloud = sm.read(tmp_path / "a.e57")
        assert_array_equal(cloud.points, POINTS)
        assert list(cloud.data) == ["row_index"]
        assert_array_equal(cloud.data["row_index"], np.arange(N))

    def test_points_that_were_not_measured(self, tmp_path):
        state = np.arange(N) % 3
        fields = axes(POINTS) | {"cartesianInvalidState": (whole(0, 2), state), "columnIndex": (whole(0, N), range(N))}
        write_scans(tmp_path / "a.e57", [{"fields": fields}])
        with pytest.warns(SimplexMeshWarning, match=r"a.e57: left out 466 of 700 points: not measured"):
            cloud = sm.read(tmp_path / "a.e57")
        assert_array_equal(cloud.points, POINTS[state == 0])
        assert_array_equal(cloud.data["column_index"], np.flatnonzero(state == 0))

    def test_spherical_coordinates(self, tmp_path):
        points = RNG.normal(size=(N, 3))
        distance = np.linalg.norm(points, axis=1)
        fields = {
            "sphericalRange": (double, distance),
            "sphericalAzimuth": (double, np.arctan2(points[:, 1], points[:, 0])),
            "sphericalElevation": (double, np.arcsin(points[:, 2] / distance)),
        }
        write_scans(tmp_path / "a.e57", [{"fields": fields}])
        assert_allclose(sm.read(tmp_path / "a.e57").points, points, atol=1e-14)

    def test_scaled_integers(self, tmp_path):
        X = RNG.integers(-(2**31), 2**31, (N, 3))
        raw = {
            f"cartesian{axis}": (
                lambda image: libe57.ScaledIntegerNode(image, 0, -(2**31), 2**31, 0.001, 1e6),
                column * 0.001 + 1e6,
            )
            for axis, column in zip("XYZ", X.T, strict=True)
        }
        write_scans(tmp_path / "a.e57", [{"fields": raw}])
        assert_allclose(sm.read(tmp_path / "a.e57").points, X * 0.001 + 1e6, rtol=0, atol=1e-9)

    @pytest.mark.parametrize("most", [255, 1023, 65535])
    def test_colors_within_their_limits(self, most, tmp_path):
        values = RNG.integers(0, most + 1, (N, 3))
        names = ("colorRed", "colorGreen", "colorBlue")
        limits = {f"{name}{end}": value for name in names for end, value in (("Minimum", 0), ("Maximum", most))}
        fields = axes(POINTS) | {name: (whole(0, most), values[:, k]) for k, name in enumerate(names)}
        write_scans(tmp_path / "a.e57", [{"colorLimits": limits, "fields": fields}])
        assert_array_equal(sm.read(tmp_path / "a.e57").data["colors"], np.rint(values * 255 / most))

    def test_scans_and_viewpoints_are_written_as_such(self, tmp_path):
        number = np.repeat([0, 1, 2], [100, 200, 400]).astype(np.int32)
        viewpoint = (FAR + np.array([[0, 0, 5], [7, 1, 5], [0, 9, 5]]))[number]
        data = {"scan": number, "viewpoint": viewpoint, "intensity": np.linspace(0, 1, N)}
        sm.PointCloud(POINTS, data=data, unit="m").save(tmp_path / "a.e57")
        with pye57.E57(str(tmp_path / "a.e57")) as file:
            assert [file.get_header(k).point_count for k in range(3)] == [100, 200, 400]
            assert_array_equal(file.get_header(1).translation, viewpoint[150])
            assert np.abs(np.asarray(file.get_header(2).rotation) - [1, 0, 0, 0]).max() == 0
        again = sm.read(tmp_path / "a.e57")
        assert_allclose(again.points, POINTS, rtol=0, atol=ULP)
        for name, values in data.items():
            assert_array_equal(again.data[name], values)

    def test_other_units_are_converted_to_meters(self, tmp_path):
        sm.PointCloud(POINTS * 1000, unit="mm").save(tmp_path / "a.e57")
        again = sm.read(tmp_path / "a.e57")
        assert again.unit == "m"
        assert_allclose(again.points, POINTS, rtol=1e-15)

    def test_a_pose_that_is_no_rotation(self, tmp_path):
        wrong = {"rotation": {"w": 2, "x": 0, "y": 0, "z": 0}, "translation": {"x": 0, "y": 0, "z": 0}}
        write_scans(tmp_path / "a.e57", [{"pose": wrong, "fields": axes(POINTS)}])
        with pytest.raises(OSError, match=r"a.e57: pose of scan 0 must have a quaternion of length 1, not 2"):
            sm.read(tmp_path / "a.e57")

    def test_no_coordinates_and_no_scans(self, tmp_path):
        write_scans(tmp_path / "a.e57", [{"fields": {"intensity": (double, POINTS[:, 0])}}])
        with pytest.raises(OSError, match=r"a.e57 must have points with cartesian or spherical coordinates"):
            sm.read(tmp_path / "a.e57")
        write_scans(tmp_path / "b.e57", [])
        with pytest.raises(OSError, match=r"b.e57 must have scans with points, it has none"):
            sm.read(tmp_path / "b.e57")


def resealed(content):
    """Return an E57 file with the right checksums (CRC-32C, the polynomial 0x82F63B78) of its pages."""
    table = []
    for i in range(256):
        rest = i
        for _ in range(8):
            rest = (rest >> 1) ^ (0x82F63B78 if rest & 1 else 0)
        table.append(rest)
    out = bytearray(content)
    for at in range(0, len(out), 1024):
        crc = 0xFFFFFFFF
        for byte in out[at : at + 1020]:
            crc = table[(crc ^ byte) & 255] ^ (crc >> 8)
        out[at + 1020 : at + 1024] = (crc ^ 0xFFFFFFFF).to_bytes(4, "big")
    return bytes(out)


@pytest.mark.parametrize("ending", ALL)
class TestDamage:
    @pytest.fixture
    def content(self, ending, tmp_path):
        sm.PointCloud(POINTS, data=DATA).save(tmp_path / f"whole{ending}")
        return (tmp_path / f"whole{ending}").read_bytes()

    def refuse(self, path, content, message, capfd):
        path.write_bytes(content)
        with pytest.raises(OSError, match=message) as error:
            sm.read(path)
        text = str(error.value)
        assert text.startswith(path.name)
        assert "\n" not in text
        assert len(text) < 350
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize("fraction", [0.001, 0.01, 0.25, 0.5, 0.97, 0.9999])
    def test_truncated(self, ending, fraction, content, tmp_path, capfd):
        self.refuse(
            tmp_path / f"cut{ending}", content[: int(fraction * len(content))], "truncated|damaged|is not", capfd
        )

    def test_empty(self, ending, tmp_path, capfd):
        self.refuse(tmp_path / f"none{ending}", b"", f"none{ending} is empty", capfd)

    def test_other_content(self, ending, tmp_path, capfd):
        name = "an E57 file" if ending == ".e57" else "an LAS file"
        self.refuse(tmp_path / f"other{ending}", b"Dear reader,\n" * 99, f"is not {name}", capfd)
        sm.sphere(4).save(tmp_path / "a.ply")
        (tmp_path / "a.ply").rename(tmp_path / f"a{ending}")
        with pytest.warns(SimplexMeshWarning, match=f"a{ending} is a PLY file by its content"):
            sm.read(tmp_path / f"a{ending}")

    def test_found_by_content(self, ending, content, tmp_path):
        (tmp_path / "scan").write_bytes(content)
        assert len(sm.read(tmp_path / "scan")) == N

    def test_flipped_bits(self, ending, content, tmp_path, capfd):
        """Whatever happens is a cloud or a sentence."""
        places = range(0, 375, 3) if ending == ".las" else RNG.integers(0, len(content), 60)
        path = tmp_path / f"bit{ending}"
        found = [self.complaint(path, content, at) for at in places]
        complaints = [text for text in found if text]
        assert complaints
        assert all(path.name in text and "\n" not in text for text in complaints)
        assert ending != ".e57" or len(complaints) == len(found)  # every page has a checksum
        assert capfd.readouterr() == ("", "")

    def complaint(self, path, content, at):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x40]) + content[at + 1 :])
        try:
            with warnings.catch_warnings(action="ignore", category=SimplexMeshWarning):
                sm.read(path)
        except (OSError, ValueError) as error:
            return str(error)
        return ""

    def test_the_extra_is_missing(self, ending, content, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "pye57" if ending == ".e57" else "laspy", None)
        message = r"^this needs the extra survey: pip install 'simplexmesh\[survey\]'$"
        with pytest.raises(ImportError, match=message):
            sm.read(tmp_path / f"whole{ending}")
        with pytest.raises(ImportError, match=message):
            sm.save(POINTS, tmp_path / f"new{ending}")
        assert not (tmp_path / f"new{ending}").exists()


@pytest.mark.parametrize(
    ("ending", "at", "kind", "value", "message"),
    [
        (".las", 24, "<B", 2, "must be LAS 1 with points of format 0 to 10, not 2"),
        (".las", 104, "<B", 11, "must be LAS 1 with points of format 0 to 10, not 1 with 11"),
        (".las", 94, "<H", 60_000, "damaged header"),
        (".las", 96, "<I", 2**32 - 1, "damaged header|truncated"),
        (".las", 100, "<I", 2**32 - 1, "damaged header"),
        (".las", 105, "<H", 10, "damaged header"),
        (".las", 247, "<Q", 2**62, r"must have [\d,]+ bytes or more by its header, it has [\d,]+: truncated"),
        (".las", 247, "<Q", 0, "must have points, its header says 0"),
        (".laz", 247, "<Q", 2**50, r"must have [\d,]+ bytes or more by its header"),
        (".las", 131, "<d", np.nan, "must have a scale and an offset for each axis"),
        (".las", 139, "<d", 0.0, "must have a scale and an offset for each axis"),
        (".las", 155, "<d", np.inf, "must have a scale and an offset for each axis"),
        (".e57", 16, "<Q", 2**60, r"must have [\d,]+ bytes by its header, it has [\d,]+: truncated"),
        (".e57", 24, "<Q", 2**60, "damaged header"),
        (".e57", 32, "<Q", 2**60, "damaged header"),
        (".e57", 40, "<Q", 0, "damaged header"),
    ],
)
def test_headers(ending, at, kind, value, message, tmp_path, capfd):
    path = tmp_path / f"a{ending}"
    sm.save(POINTS, path)
    content = bytearray(path.read_bytes())
    struct.pack_into(kind, content, at, value)
    path.write_bytes(resealed(content) if ending == ".e57" else content)
    with pytest.raises(OSError, match=f"^a{ending} .*({message})"):
        sm.read(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("value", [-1, 2**40, 3])
def test_a_table_of_chunks_that_is_not_there(value, tmp_path, capfd):
    path = tmp_path / "a.laz"
    sm.save(POINTS, path)
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 96)
    struct.pack_into("<q", content, start, value)
    path.write_bytes(content)
    with pytest.raises(OSError, match=r"a.laz is a LAZ file without its table of chunks"):
        sm.read(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'recordCount="700"', b'recordCount="9999999999"', "must have 9,999,999,999 points by its header, more than"),
        (b"<?xml version", b"<!DOCTYPE a []><a", "description is damaged or defines entities"),
        (b"data3D", b"data3E", "cannot be read as E57|has none"),
    ],
)
def test_descriptions_of_scans(old, new, message, tmp_path, capfd):
    path = tmp_path / "a.e57"
    sm.save(POINTS, path)
    content = path.read_bytes()
    length, at, count, page = struct.unpack_from("<QQQQ", content, 16)
    pages = [content[k : k + 1020] for k in range(0, length, page)]
    logical = b"".join(pages)
    start = at // page * 1020 + at % page
    text = logical[start : start + count]
    assert old in text
    text = text.replace(old, new, 1)
    logical = logical[:start] + text
    logical += bytes(-len(logical) % 1020)
    out = bytearray(b"".join(logical[k : k + 1020] + bytes(4) for k in range(0, len(logical), 1020)))
    struct.pack_into("<QQQ", out, 16, len(out), at, len(text))
    path.write_bytes(resealed(out))
    with pytest.raises(OSError, match=f"^a.e57 .*({message})"):
        sm.read(path)
    assert capfd.readouterr() == ("", "")
