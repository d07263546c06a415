"""Read and write LAS and LAZ files (ASPRS LAS 1.4 R15); the only module that imports laspy."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh._base.named_arrays import Data, is_color
from simplexmesh._base.units import NANOMETERS, known_unit
from simplexmesh.data.columns import as_colors
from simplexmesh.data.io.integrity.survey import check_las
from simplexmesh.data.io.survey.tables import PIECE, Columns, Parts, Table, columns_of, complaints, needed, parts_of

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

_CHANNELS = ("red", "green", "blue", "alpha")

_NORMALS = ("NormalX", "NormalY", "NormalZ")
"""As other programs call them; LAS itself has none."""

_RETURNS = ("return_number", "number_of_returns")
"""Fields that are 1 where a pulse has one return."""

_PULSES = (
    "wavepacket_index",
    "wavepacket_offset",
    "wavepacket_size",
    "return_point_wave_location",
    "x_t",
    "y_t",
    "z_t",
)
_NO_ARRAYS = frozenset(("X", "Y", "Z", "ExtraBytes", *_PULSES))
"""Coordinates, bytes that the file does not describe, and where it has the shapes of pulses, which are not read."""

_TAKEN = frozenset(("x", "y", "z", "bit_fields", "classification_flags", "raw_classification", "extrabytes"))
"""What laspy calls something else."""

_LONGEST_NAME = 32
"""Bytes."""

_DEEPEST = 2**31 - 1
"""Largest coordinate in a file."""

_ANGLE_STEP = 0.006
"""Degrees, of `scan_angle` since LAS 1.4; before, `scan_angle_rank` was in degrees."""

_GPS_WEEK = 604_800.0
"""Seconds; times above count from an epoch, not from the beginning of a week."""

_KEY_OF_UNIT, _KEYS = 3076, {9001: ("m", 1.0), 9002: ("ft", 0.3048)}
"""ProjLinearUnitsGeoKey of GeoTIFF, and its values."""

_WORDS = {"m": "metre", "ft": "foot", "in": "inch"}
"""What well-known text calls units."""


def read_las(path: Path) -> Parts:
    """Read a LAS or LAZ file; fields that have the same default for all points, as if never set, are left out."""
    check_las(path)
    laspy = library()
    with complaints(f"{path.name} cannot be read as LAS, it is truncated or damaged"), laspy.open(path) as file:
        header = file.header
        _check_parts(path, header)
        points, table, unit = np.empty((header.point_count, 3)), Table(header.point_count), _unit(header)
        at = 0
        for piece in file.chunk_iterator(PIECE):
            for axis, name in enumerate("XYZ"):
                points[at : at + len(piece), axis] = piece[name] * header.scales[axis] + header.offsets[axis]
            for name in header.point_format.dimension_names:
                if name not in _NO_ARRAYS:
                    table.put(name, at, np.asarray(piece[name]))
            at += len(piece)
        extra = {*header.point_format.extra_dimension_names}
    if at < len(points):
        raise OSError(f"{path.name} must have {len(points):,} points, it has {at:,}: truncated")
    return _parts(points, table, extra, unit)


def _parts(points: Array, table: Table, extra: set[str], unit: str | None) -> Parts:
    """Return what a table holds, of which the columns in `extra` are no fields of LAS itself."""
    found = {name: column for name, column in table.items() if name in extra or not _is_unset(name, column)}
    if "scan_angle_rank" in found:
        found["scan_angle"] = np.rint(found.pop("scan_angle_rank") / _ANGLE_STEP).astype(np.int16)
    if "red" not in extra and any(channel in found for channel in _CHANNELS[:3]):
        stacked = np.stack([table[channel] for channel in _CHANNELS if channel in table], axis=1)
        found = {name: column for name, column in found.items() if name not in _CHANNELS}
        found["colors"] = as_colors(stacked)
    plain = {name.lower().replace("_", ""): name for name in extra}
    axes = [plain[each.lower()] for each in _NORMALS if each.lower() in plain]
    normals = np.stack([found.pop(axis) for axis in axes], axis=1) if len(axes) == 3 else None
    return parts_of(points, normals, found, unit)


def _check_parts(path: Path, header: Any) -> None:
    """Refuse axes without a scale, and packed chunks that together are longer than the file."""
    if not (np.isfinite(header.scales) & (header.scales != 0) & np.isfinite(header.offsets)).all():
        raise OSError(f"{path.name} must have a scale and an offset for each axis, not {header.scales.tolist()}")
    if header.are_points_compressed:
        import lazrs

        with path.open("rb") as file:
            file.seek(header.offset_to_point_data)
            chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data))
        if chunks and sum(size for _, size in chunks) > path.stat().st_size:
            raise OSError(f"{path.name} is a LAZ file with a damaged table of chunks")


def library() -> Any:
    """Return laspy, or say how it is installed."""
    with needed():
        import laspy
        import lazrs  # noqa: F401  what laspy reads and writes LAZ with
    return laspy


def _is_unset(name: str, column: NDArray[Any]) -> bool:
    return not column.any() or (name in _RETURNS and bool((column == 1).all()))


def _unit(header: Any) -> str | None:
    """Return the unit of the coordinate system, None if the file does not say or has several."""
    found: list[tuple[str | None, float]] = []
    for each in header.vlrs.get("WktCoordinateSystemVlr"):
        if re.search(r"PROJC|LOCAL_CS|ENGC|GEOCCS", each.string):  # others are in degrees
            named = re.findall(r'UNIT\s*\[\s*"([^"]+)"\s*,\s*([\d.eE+-]+)', each.string)
            lengths = [pair for pair in named if not re.match(r"(?i)deg|rad|grad|gon|arc|unity", pair[0])]
            found += [(known_unit(name), float(meters)) for name, meters in lengths]
    for each in header.vlrs.get("GeoKeyDirectoryVlr"):
        found += [_KEYS.get(key.value_offset, (None, 0.0)) for key in each.geo_keys if key.id == _KEY_OF_UNIT]
    units = {unit if unit and np.isclose(_meters(unit), meters, rtol=1e-9) else None for unit, meters in found}
    return units.pop() if len(units) == 1 else None


def _meters(unit: str) -> float:
    return NANOMETERS[unit] / NANOMETERS["m"]


def write_las(path: Path, content: Polygons) -> None:
    """Write points in the formats 6 or 7 of LAS 1.4, compressed if the name ends with .laz."""
    points, normals, data, unit = content.points, content.normals, content.data, content.unit
    laspy = library()
    colored = "colors" in data and is_color(data["colors"])
    header = laspy.LasHeader(version="1.4", point_format=7 if colored else 6)
    header.generating_software = "simplexmesh"
    grids = [_grid(column) for column in points.T]
    header.scales, header.offsets = np.array(grids).T
    table = _table(header, normals, data)
    header.add_extra_dims(
        [laspy.ExtraBytesParams(name, column.dtype) for name, column in table.items() if not _field(header, name)]
    )
    if "gps_time" in table and not (np.abs(table["gps_time"]) <= _GPS_WEEK).all():
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    if unit is not None:
        text = f'LOCAL_CS["unknown",UNIT["{_WORDS.get(unit, unit)}",{_meters(unit)!r}]]'
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(text))
        header.global_encoding.wkt = True
    packed = path.suffix.lower() == ".laz"
    file = laspy.open(path, "w", header=header, do_compress=packed)
    with complaints("points cannot be written as LAS"), file:
        for at in range(0, len(points), PIECE):
            rows = slice(at, min(at + PIECE, len(points)))
            piece = laspy.ScaleAwarePointRecord.zeros(rows.stop - at, header=header)
            for axis, (scale, offset) in enumerate(grids):
                piece["XYZ"[axis]] = np.rint((points[rows, axis] - offset) / scale).astype(np.int32)
            for name in _RETURNS:
                piece[name] = np.ones(len(piece), np.uint8)
            for name, column in table.items():
                piece[name] = column[rows]
            file.write_points(piece)


def _field(header: Any, name: str) -> Any:
    """Return the field of LAS itself that has a name, or None."""
    known = header.point_format.standard_dimension_names
    return header.point_format.dimension_by_name(name) if name in known else None


def _table(header: Any, normals: Array | None, data: Data) -> Columns:
    """Return the columns of a file, checked."""
    out: Columns = {} if normals is None else dict(zip(_NORMALS, normals.T, strict=True))
    rest = dict(data)
    if _field(header, "red"):
        channels = zip(_CHANNELS, rest.pop("colors").T, strict=False)
        out |= {name: np.multiply(column, 257, dtype=np.uint16) for name, column in channels}
    for name, column in columns_of(rest):
        if name in out or name in _NO_ARRAYS or name.lower() in _TAKEN:
            raise ValueError(f"array {name!r} must have another name to be saved as LAS, where this one is taken")
        if not 0 < len(name.encode()) <= _LONGEST_NAME:
            raise ValueError(f"array {name!r} must have a name of 1 to {_LONGEST_NAME} bytes to be saved as LAS")
        field = _field(header, name)
        out[name] = _fitting(name, column, field) if field else column
    return out


def _fitting(name: str, values: NDArray[Any], field: Any) -> NDArray[Any]:
    """Return the values of a field that LAS itself has, which must fit; shares of intensity are scaled to its range."""
    if name == "gps_time":
        return values.astype(np.float64, copy=False)
    low, high = int(field.min), int(field.max)
    inside = bool(((values >= low) & (values <= high)).all())
    if name == "intensity" and values.dtype.kind == "f" and inside and values.max() <= 1:
        return np.rint(high * values).astype(np.uint16)
    if not inside or not np.array_equal(values, np.rint(values)):
        raise ValueError(f"array {name!r} must hold whole numbers from {low} to {high} to be saved as LAS")
    return values


def _grid(column: Array) -> tuple[float, float]:
    """Return scale and offset of an axis: of the powers of ten the largest that keeps every value, else the least.

    Values that were read from a file lie on such a grid up to the rounding of double precision; others are rounded to
    the finest grid that 32 bits can count.
    """
    low, high = float(column.min()), float(column.max())
    if low == high:
        return 0.001, low
    offset = float(np.rint(low / 2 + high / 2)) if high - low > 1 else low
    least = int(np.ceil(np.log10(max(high - offset, offset - low) / _DEEPEST)))
    rounding = 4 * np.finfo(float).eps * max(abs(low), abs(high))
    for power in range(0, least, -1):
        scale = float(f"1e{power}")
        if scale > 100 * rounding and all(_lies_on(some, scale, offset, rounding) for some in (column[:1000], column)):
            return scale, offset
    return float(f"1e{least}"), offset


def _lies_on(column: Array, scale: float, offset: float, rounding: float) -> bool:
    """Whether all values are whole multiples of a scale from an offset on."""
    away = column - offset
    return bool((np.abs(away - scale * np.rint(away / scale)) <= rounding).all())
