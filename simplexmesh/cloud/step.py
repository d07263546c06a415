"""Make STEP files (ISO 10303-21, AP214) of primitives, exact surfaces or solids; the only module that imports OCP.

OpenCascade's surfaces have the coordinates of ours: an angle about the axis, and a height or an angle of the profile.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.units import NANOMETERS
from simplexmesh.data.primitives import Cone, Cylinder, Plane, Primitive, Sphere, Torus
from simplexmesh.data.primitives.oblique_cone import ObliqueCone

Groups = Mapping[str, Sequence[tuple[str, Primitive]]]
"""Primitives with their names, in named groups."""

ENDINGS = (".step", ".stp")

UNITS = {"um": "UM", "mm": "MM", "cm": "CM", "m": "M", "km": "KM", "in": "INCH", "ft": "FT"}
"""As OpenCascade calls them."""

CONFUSION = 1e-7
"""Length of an edge that is a point, as OpenCascade has it: at the poles of a sphere, at the apex of a cone."""

DIGITS = 9
"""Of an origin near the parts, which the file holds exactly; it has twelve digits of each number."""


def step_file(groups: Groups, unit: str | None, *, solid: bool) -> bytes:
    """Return the STEP file of primitives within their extents, as surfaces or, each closed at its ends, as solids.

    Every group is an assembly. The parts are told about an origin near to them, so that far coordinates lose nothing.
    """
    needed()
    if unit is None:
        warn("the STEP file says mm, as the unit of the points is not known: cloud.in_unit('m', 'm') would tell it")
    if unit == "nm":
        raise ValueError("STEP files have no nanometers: convert the cloud by in_unit")
    from OCP.STEPCAFControl import STEPCAFControl_Writer

    given = {name: parts for name, parts in groups.items() if parts}
    if not given:
        raise ValueError("nothing was found that could be saved as STEP")
    written = io.BytesIO()
    with _settings(unit or "mm"):
        writer = STEPCAFControl_Writer()
        if not writer.Transfer(_document(given, unit or "mm", solid=solid)):
            raise OSError("the primitives cannot be written as STEP")
        writer.WriteStream(written)
    return written.getvalue()


def needed() -> None:
    """Say how the library is installed if it is missing."""
    try:
        import OCP.gp  # noqa: F401
    except ImportError as error:
        raise ImportError("this needs the extra step: pip install 'simplexmesh[step]'") from error


@contextmanager
def _settings(unit: str) -> Iterator[None]:
    """Have OpenCascade write in a unit, and print nothing; both are settings of the whole process."""
    from OCP.Interface import Interface_Static
    from OCP.Message import Message

    messenger = Message.DefaultMessenger_s()
    printers, before = list(messenger.Printers()), Interface_Static.CVal_s("write.step.unit")
    for printer in printers:
        messenger.RemovePrinter(printer)
    Interface_Static.SetCVal_s("write.step.unit", UNITS[unit])
    try:
        yield
    finally:
        Interface_Static.SetCVal_s("write.step.unit", before)
        for printer in printers:
            messenger.AddPrinter(printer)


def _document(groups: Groups, unit: str, *, solid: bool) -> Any:
    """Return a document with an assembly of the groups."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("simplexmesh"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, NANOMETERS[unit] / NANOMETERS["m"])
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())

    def named(label: Any, name: str) -> Any:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        return label

    origin = _origin(each for parts in groups.values() for _, each in parts)
    away = gp_Trsf()
    away.SetTranslation(gp_Vec(*origin))
    whole = named(tool.NewShape(), "pipes" if solid else "primitives")
    for group, parts in groups.items():
        assembly = named(tool.NewShape(), group)
        for name, primitive in parts:
            shape = (_solid if solid else _face)(primitive, origin)
            part = named(tool.AddShape(shape), name)
            named(tool.AddComponent(assembly, part, TopLoc_Location()), name)
        named(tool.AddComponent(whole, assembly, TopLoc_Location(away)), group)
    tool.UpdateAssemblies()
    return document


def _origin(primitives: Iterable[Primitive]) -> Array:
    """Return a point near the middle of primitives with few digits."""
    bounds = np.array([each.bounds for each in primitives])
    middle = (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0)) / 2
    return np.array([float(f"{x:.{DIGITS}g}") for x in middle])


def _frame(primitive: Primitive, origin: Array, *, turn: float = 0.0, along: float = 0.0) -> Any:
    """Return the frame of a primitive, turned about its axis and moved along it."""
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

    point, axis = primitive._pose
    across = np.cos(turn) * primitive.frame[0] + np.sin(turn) * primitive.frame[1]
    return gp_Ax3(gp_Pnt(*(point + along * axis - origin)), gp_Dir(*axis), gp_Dir(*across))


def _face(primitive: Primitive, origin: Array) -> Any:
    """Return the part of a primitive's surface within its extent."""
    from OCP import Geom
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    turn, (low, high) = primitive._ends()
    at, surface = _frame(primitive, origin), None
    match primitive:
        case Plane():
            surface = Geom.Geom_Plane(at)
        case Sphere():
            surface = Geom.Geom_SphericalSurface(at, primitive.radius)
        case Cylinder():
            surface = Geom.Geom_CylindricalSurface(at, primitive.radius)
        case Torus():
            surface = Geom.Geom_ToroidalSurface(at, primitive.radius, primitive.tube_radius)
        case Cone():
            at = _frame(primitive, origin, along=low)
            surface = Geom.Geom_ConicalSurface(at, primitive.half_angle, low * np.tan(primitive.half_angle))
            low, high = 0.0, (high - low) / np.cos(primitive.half_angle)
    return BRepBuilderAPI_MakeFace(surface, *turn, low, high, CONFUSION).Face()


def _solid(primitive: Primitive, origin: Array) -> Any:
    """Return a straight, a reducer or a bend with flat ends."""
    from OCP import BRepPrimAPI

    turn, (low, high) = primitive._ends()
    at = _frame(primitive, origin, turn=turn[0], along=0.0 if isinstance(primitive, Torus) else low).Ax2()
    match primitive:
        case Torus():
            made = BRepPrimAPI.BRepPrimAPI_MakeTorus(at, primitive.radius, primitive.tube_radius, turn[1] - turn[0])
        case Cylinder():
            made = BRepPrimAPI.BRepPrimAPI_MakeCylinder(at, primitive.radius, high - low)
        case ObliqueCone():
            made = _between_circles(primitive, origin, (low, high))
        case Cone():
            slope = np.tan(primitive.half_angle)
            made = BRepPrimAPI.BRepPrimAPI_MakeCone(at, slope * low, slope * high, high - low)
    return made.Shape()


def _between_circles(cone: ObliqueCone, origin: Array, heights: Iterable[float]) -> Any:
    """Return the maker of the solid with straight lines between two circles of an oblique cone."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.gp import gp_Circ

    made = BRepOffsetAPI_ThruSections(isSolid=True, ruled=True)
    for height in heights:
        at = _frame(cone, origin - height * cone.lean, along=height).Ax2()
        edge = BRepBuilderAPI_MakeEdge(gp_Circ(at, height * np.tan(cone.half_angle))).Edge()
        made.AddWire(BRepBuilderAPI_MakeWire(edge).Wire())
    return made
