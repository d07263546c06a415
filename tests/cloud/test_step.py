"""STEP files of primitives and pipes, read back by the library that wrote them: exact sizes, places, areas, volumes."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cloud.extraction.result import Extraction
from simplexmesh.cloud.pipes.plant import Plant
from simplexmesh.data.primitives import Cone, Cylinder, Fit, Plane, Sphere, Torus
from tests.cloud.plants import FEW, line, plant

AWAY = np.array([1e6, -3e6, 250.0])


def shapes():
    """One of each kind, each within an extent that is no half and no quarter of it."""
    axis, place = (1, 2, 3), (4, 5, 6)
    extents = {
        Plane(place, axis): [[-1, 2], [0.5, 3]],
        Sphere(place, 2): [[2.5, 4.5], [-0.4, 1.1]],
        Cylinder(place, axis, 0.7): [[-2.9, 0.3], [-1, 4]],
        Cone(place, axis, 0.4): [[1, 5.5], [0.5, 3]],
        Torus(place, axis, 3, 0.5): [[2, 4], [-1, 2.5]],
    }
    return [
        each.with_fit(Fit(0.1, 0.1, np.eye(each.n_parameters), np.array(extent, float), 9))
        for each, extent in extents.items()
    ]


def area(shape):
    """The closed form of the area within the extent."""
    (u, v), (low, high) = shape.extent
    match shape:
        case Plane():
            return (v - u) * (high - low)
        case Sphere():
            return (v - u) * 4 * (np.sin(high) - np.sin(low))
        case Cylinder():
            return (v - u) * (high - low) * shape.radius
        case Cone():
            return (v - u) * (high**2 - low**2) / 2 * np.tan(shape.half_angle) / np.cos(shape.half_angle)
    return (v - u) * shape.tube_radius * (3 * (high - low) + shape.tube_radius * (np.sin(high) - np.sin(low)))


class TestRead:
    """What another reader finds; OpenCascade tells lengths in mm."""

    @pytest.fixture(autouse=True)
    def _ocp(self):
        pytest.importorskip("OCP")

    def read(self, path, kind):
        """The parts of a file that are solids or faces, in place, each valid where it is told: near the origin."""
        from OCP import TopAbs, TopoDS
        from OCP.BRepCheck import BRepCheck_Analyzer
        from OCP.STEPControl import STEPControl_Reader
        from OCP.TopExp import TopExp_Explorer
        from OCP.TopLoc import TopLoc_Location

        reader = STEPControl_Reader()
        reader.ReadFile(str(path))
        reader.TransferRoots()
        at, found = TopExp_Explorer(reader.OneShape(), getattr(TopAbs.TopAbs_ShapeEnum, f"TopAbs_{kind}")), []
        while at.More():
            found.append(getattr(TopoDS.TopoDS, kind.capitalize())(at.Current()))
            assert BRepCheck_Analyzer(found[-1].Located(TopLoc_Location())).IsValid()
            at.Next()
        return found

    def surfaces(self, path):
        """The curved surfaces of a file: names, and what they are."""
        from OCP.BRepAdaptor import BRepAdaptor_Surface

        out = []
        for face in self.read(path, "FACE"):
            surface = BRepAdaptor_Surface(face)
            name = surface.GetType().name.removeprefix("GeomAbs_")
            if name != "Plane":
                out.append((name, getattr(surface, name)()))
        return out

    def amount(self, shape, measure):
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        found = GProp_GProps()
        getattr(BRepGProp, f"{measure}Properties_s")(shape, found)
        return found.Mass()

    def distance(self, shape, points):
        """The greatest distance of points from a part."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
        from OCP.BRepExtrema import BRepExtrema_DistShapeShape
        from OCP.gp import gp_Pnt

        vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex() for point in points]
        return max(BRepExtrema_DistShapeShape(shape, vertex).Value() for vertex in vertices)

    def test_eccentric_reducers_are_solids_between_two_circles(self, tmp_path):
        found = line(offset=0.05)
        found.save(tmp_path / "out.step")
        solid, reducer = self.read(tmp_path / "out.step", "SOLID")[3], found.elements[3]
        volume = np.pi * reducer.length * (0.04 + 0.03 + 0.0225) / 3
        assert self.amount(solid, "Volume") * 1e-9 == pytest.approx(volume, rel=1e-6)
        assert self.distance(solid, 1000 * reducer.primitive.sampled(20, rng=1).points) < 1e-4

    @pytest.mark.parametrize("at", [(0, 0, 0), AWAY], ids=["near", "far"])
    def test_pipes_are_closed_solids_of_exact_size_and_place(self, tmp_path, at):
        found = plant(at)
        found.save(tmp_path / "out.step")
        solids = self.read(tmp_path / "out.step", "SOLID")
        lengths = [each.length for each in found.elements]
        squares = [0.04, 0.04, 0.04, (0.04 + 0.03 + 0.0225) / 3, 0.0225, 0.0225, 0.0225, 0.01]
        volumes = [self.amount(each, "Volume") * 1e-9 for each in solids]
        np.testing.assert_allclose(volumes, np.pi * np.multiply(lengths, squares), rtol=1e-8)
        for solid, element in zip(solids, found.elements, strict=True):
            assert self.distance(solid, 1000 * element.primitive.sampled(20, rng=1).points) < 1e-5

        read = self.surfaces(tmp_path / "out.step")
        assert [name for name, _ in read] == [
            {"bend": "Torus", "reducer": "Cone"}.get(each.kind, "Cylinder") for each in found.elements
        ]
        for (name, surface), element in zip(read, found.elements, strict=True):
            place = surface.Apex() if name == "Cone" else surface.Location()
            axis = surface.Axis().Direction()
            ours = element.primitive
            np.testing.assert_allclose(np.abs([axis.X(), axis.Y(), axis.Z()] @ ours.axis), 1, rtol=1e-14)
            away = np.array([place.X(), place.Y(), place.Z()]) / 1000 - ours._pose[0]
            along = 0 if name == "Torus" else (away @ ours.axis) * ours.axis
            assert np.abs(away - along).max() < 1e-9 + 1e-15 * np.abs(at).max()
            if name == "Torus":
                assert surface.MajorRadius() == pytest.approx(1000 * element.bend_radius, rel=1e-11)
                assert surface.MinorRadius() == pytest.approx(1000 * element.radius, rel=1e-11)
            elif name == "Cone":
                assert np.tan(abs(surface.SemiAngle())) == pytest.approx(0.05 / 0.5, rel=1e-10)
            else:
                assert surface.Radius() == pytest.approx(1000 * ours.radius, rel=1e-11)

    def test_primitives_are_surfaces_that_end_where_their_points_do(self, tmp_path):
        scene = Extraction(sm.PointCloud(np.eye(4)[:, :3], unit="mm"), tuple(shapes()), FEW, 0.1)
        scene.save(tmp_path / "out.stp")
        faces = self.read(tmp_path / "out.stp", "FACE")
        for face, shape in zip(faces, scene.primitives, strict=True):
            assert self.amount(face, "Surface") == pytest.approx(area(shape), rel=1e-8)
            assert self.distance(face, shape.sampled(20, rng=1).points) < 1e-8

    def test_parts_are_named_as_in_the_table(self, tmp_path):
        plant().save(tmp_path / "out.step")
        text = (tmp_path / "out.step").read_text()
        for name in ("line 1", "straight 1", "bend 2", "reducer 4", "tees", "tee 1"):
            assert f"PRODUCT('{name}'" in text

    @pytest.mark.parametrize(("unit", "size"), [("mm", 1), ("cm", 10), ("in", 25.4), ("ft", 304.8)])
    def test_the_unit_is_that_of_the_cloud(self, tmp_path, unit, size):
        line(unit=unit).save(tmp_path / "out.step")
        assert self.surfaces(tmp_path / "out.step")[0][1].Radius() == pytest.approx(0.2 * size, rel=1e-10)

    def test_an_unknown_unit_is_told_as_mm_with_a_warning(self, tmp_path):
        with pytest.warns(sm.SimplexMeshWarning, match=r"^the STEP file says mm, as the unit .* is not known"):
            line(unit=None).save(tmp_path / "out.step")
        assert self.surfaces(tmp_path / "out.step")[0][1].Radius() == pytest.approx(0.2, rel=1e-10)

    def test_what_others_set_for_the_library_stays_and_nothing_is_printed(self, tmp_path, capfd):
        from OCP.Interface import Interface_Static
        from OCP.Message import Message

        line().save(tmp_path / "first.step")
        Interface_Static.SetCVal_s("write.step.unit", "KM")
        printers = len(list(Message.DefaultMessenger_s().Printers()))
        try:
            line().save(tmp_path / "out.step")
            assert Interface_Static.CVal_s("write.step.unit") == "KM"
        finally:
            Interface_Static.SetCVal_s("write.step.unit", "MM")
        assert len(list(Message.DefaultMessenger_s().Printers())) == printers
        assert capfd.readouterr() == ("", "")

    def test_what_cannot_be_written_is_told(self, tmp_path):
        with pytest.raises(ValueError, match=r"^nothing was found that could be saved as STEP$"):
            Plant((), (), FEW, "m").save(tmp_path / "out.step")
        with pytest.raises(ValueError, match=r"^STEP files have no nanometers"):
            line(unit="nm").save(tmp_path / "out.step")
        assert not list(tmp_path.iterdir())


def test_without_the_library_one_sentence_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP", None)
    monkeypatch.setitem(sys.modules, "OCP.gp", None)
    for found in (plant(), line(), Extraction(sm.PointCloud(np.eye(4)[:, :3]), tuple(shapes()), FEW, 0.1)):
        with pytest.raises(ImportError, match=r"^this needs the extra step: pip install 'simplexmesh\[step\]'$"):
            found.save(tmp_path / "out.step")
    assert not list(tmp_path.iterdir())
