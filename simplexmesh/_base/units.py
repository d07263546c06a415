"""Units of length, and what all data with coordinates have in common: they are converted, saved and handed on."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from simplexmesh._base import checks

NANOMETERS = {
    "nm": 1, "um": 1_000, "mm": 1_000_000, "cm": 10_000_000, "m": 1_000_000_000, "km": 1_000_000_000_000,
    "in": 25_400_000, "ft": 304_800_000,
}  # fmt: skip
"""Whole numbers, whose quotients are rounded once."""
_WORDS = {
    "nanometer": "nm", "micrometer": "um", "micron": "um", "µm": "um", "millimeter": "mm", "centimeter": "cm",
    "meter": "m", "kilometer": "km", "inch": "in", "inche": "in", "foot": "ft", "feet": "ft",
}  # fmt: skip

Self = TypeVar("Self", bound="InUnits")


def known_unit(word: Any) -> str | None:
    """Return the unit that a word in a file means, None for any other word."""
    plain = str(word).strip().lower().replace("metre", "meter").replace("μ", "µ")
    return plain if plain in NANOMETERS else _WORDS.get(plain, _WORDS.get(plain.removesuffix("s")))


def unit_or_none(name: str, value: Any) -> str | None:
    """Return a unit of length by its short name, None if it is not known."""
    return None if value is None else checks.choice(name, value, list(NANOMETERS))


def power_of_unit(unit: str, power: int) -> str:
    """Return a power of a unit of length as text, empty without a unit."""
    return {1: unit, -1: f"1/{unit}", -2: f"1/{unit}²"}.get(power, "") if unit else ""


def common_unit(name: str, parts: Iterable[Any]) -> str | None:
    """Return the unit of several data or targets, None if it is unknown of any; they must not have several."""
    units: set[Any] = {getattr(part, "unit", None) for part in parts}
    if len(units - {None}) > 1:
        raise ValueError(f"{name} must have one unit, not {' and '.join(sorted(units - {None}))}: use in_unit")
    return None if None in units or not units else units.pop()


class InUnits:
    """Data with coordinates in a unit of length, which is remembered if it is known.

    Attributes
    ----------
    unit : str or None
        "nm", "um", "mm", "cm", "m", "km", "in" or "ft".
    """

    unit: str | None

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(checks.frozen_state(state))

    def transformed(self: Self, T_target_source: Any) -> Self:
        """Return the data in the target frame of a transform."""
        raise NotImplementedError

    def scaled(self: Self, factor: float) -> Self:
        """Return the data with all coordinates multiplied by a positive factor; arrays and `unit` stay.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> round(sm.sphere(4).scaled(3.0).diagonal / sm.sphere(4).diagonal, 12)
        3.0
        """
        factor = checks.number("factor", factor, 0.0, open_low=True)
        return self.transformed(np.diag([factor, factor, factor, 1.0]))

    def in_unit(self: Self, unit: str, given: str | None = None) -> Self:
        """Return the data converted to a unit of length, which it remembers.

        Parameters
        ----------
        unit : {"nm", "um", "mm", "cm", "m", "km", "in", "ft"}
            The unit wanted.
        given : str, optional
            The unit of the coordinates now; needed where `self.unit` is None.

        Raises
        ------
        ValueError
            An unknown unit, or data whose own unit is unknown or another than `given`.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> ball = sm.sphere(4, radius=0.02).in_unit("mm", "m")
        >>> ball.unit, round(ball.diagonal / sm.sphere(4, radius=20).diagonal, 12)
        ('mm', 1.0)
        """
        checks.choice("unit", unit, list(NANOMETERS))
        now = unit_or_none("given", given) or self.unit
        if now is None:
            raise ValueError(
                f"given must be the unit of the coordinates, which is unknown: in_unit({unit!r}, 'm'), say"
            )
        if self.unit not in (None, now):
            raise ValueError(f"given must be {self.unit!r}, the unit that is known, or left out, not {given!r}")
        scaled = self if now == unit else self.scaled(NANOMETERS[now] / NANOMETERS[unit])
        return replace(scaled, unit=unit)  # type: ignore[type-var]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a file in the format its name says; VTP keeps all of a simplex mesh.

        Points: .vtp, .ply or .xyz, and .las, .laz or .e57 with the extra `survey`. Meshes also: .obj, .off, .stl, and
        .glb or .3mf with the extra `export`. All arrays go into .vtp, .ply and the files of surveys, those of up to
        four columns into .glb, colors and `uv` into .obj. Volumes: .mha, .nrrd, .nii, .nii.gz or .vti.

        Warns
        -----
        SimplexMeshWarning
            Arrays that the format does not hold; the message names them.
        """
        from simplexmesh.data.io import writing

        writing.write(path, self)

    def to_pyvista(self) -> Any:
        """Return a `pyvista.PolyData` with the data, of points with their normals; of a volume, `ImageData`."""
        from simplexmesh.data.io import writing

        return writing.to_pyvista(self)
