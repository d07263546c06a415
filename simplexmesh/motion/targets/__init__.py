"""Targets: the signed distance from each vertex to the data along its normal.

A target is any object with ``gap(vertices, normals, reach) -> (n,) array``, NaN where nothing is within reach.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simplexmesh.motion.targets.borders import Border
    from simplexmesh.motion.targets.isosurface import Isosurface
    from simplexmesh.motion.targets.labels import LabelSurface
    from simplexmesh.motion.targets.points import Points
    from simplexmesh.motion.targets.triangles import Triangles
    from simplexmesh.motion.targets.union import Union

__all__ = ["Border", "Isosurface", "LabelSurface", "Points", "Triangles", "Union"]

_HOME = {
    "Border": "borders",
    "Isosurface": "isosurface",
    "LabelSurface": "labels",
    "Points": "points",
    "Triangles": "triangles",
    "Union": "union",
}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value
