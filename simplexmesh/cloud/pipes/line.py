"""What is found of pipes: elements in their order along a line, and their points."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.cloud.mesh_path import mesh_path
from simplexmesh.cloud.pipes import saving, tube
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.data.primitives import Primitive
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh

if TYPE_CHECKING:
    import pyvista as pv


class Deviations(NamedTuple):
    """Standard deviations of the measures of an element, those that it has.

    Where a line ends is known to three distances between its points along it, as the deviation of a length there says;
    the deviations of its outer ends are those across.

    Attributes
    ----------
    start, end : float
        Of the distance of an end from its true place.
    radius, end_radius, length : float
        As of the element.
    bend_radius, bend_angle : float or None
        Of a bend, the angle in radians.
    offset : float or None
        Of an eccentric reducer.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> points = np.stack([np.cos(turn), np.sin(turn), height], axis=1)
    >>> points += 0.01 * np.random.default_rng(1).normal(size=points.shape)
    >>> line = sm.follow_pipe(points, pick=(1, 0, 6))
    >>> line.elements[0].deviations.radius < 0.001
    True
    """

    start: float
    end: float
    radius: float
    end_radius: float
    length: float
    bend_radius: float | None = None
    bend_angle: float | None = None
    offset: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class PipeElement:
    """A part of a pipe line.

    Attributes
    ----------
    kind : str
        "straight", "bend", "reducer" or "tee".
    start, end : (3,) array of float
        Where the axis starts and ends; of a tee, where the axes of branch and run meet, and where the branch starts.
    radius : float
        Of the pipe; of a reducer at its start.
    end_radius : float
        Of the pipe at the end.
    bend_radius, bend_angle : float or None
        Of the axis of a bend, the angle in radians.
    length : float
        Along the axis.
    primitive : Primitive
        The cylinder, torus or cone, of an eccentric reducer oblique cone, with the extent of the element and the
        covariance of its parameters.
    deviations : Deviations or None
        Standard deviations of these measures; None of a tee, which follows from run and branch.
    offset : float
        Of an eccentric reducer: between the parallel axes on its two sides. It is 0 of all other elements.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> line = sm.follow_pipe(np.stack([np.cos(turn), np.sin(turn), height], axis=1), pick=(1, 0, 6))
    >>> line.elements[0].kind, round(line.elements[0].radius, 3)
    ('straight', 1.0)
    """

    kind: str
    start: Array
    end: Array
    radius: float
    end_radius: float
    bend_radius: float | None
    bend_angle: float | None
    length: float
    primitive: Primitive
    deviations: Deviations | None
    offset: float = 0.0

    def __repr__(self) -> str:
        text = f"PipeElement({self.kind}, diameter {2 * self.radius:.6g}, length {self.length:.6g}"
        if self.bend_angle is not None:
            text += f", {np.degrees(self.bend_angle):.1f} degrees on radius {self.bend_radius:.6g}"
        return text + (f", offset {self.offset:.6g})" if self.offset else ")")


class Pipes:
    """What lines of pipe and plants have in common: meshes and files of all their lines."""

    lines: tuple[PipeLine, ...]
    tees: tuple[PipeElement, ...]
    unit: str | None

    def triangulated(self, edge: float | None = None) -> TriangleMesh:
        """Return the tubes in triangles with edges of about a length, by default 32 around, closed where lines are."""
        if not self.lines:
            raise ValueError("the plant has no lines")
        parts = [tube.swept(line.chain, edge) for line in self.lines]
        starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
        faces = np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=True)])
        return TriangleMesh(np.concatenate([vertices for vertices, _ in parts]), faces, unit=self.unit)

    def mesh(self, edge: float | None = None) -> SimplexMesh:
        """Return the tubes as a simplex mesh, ready to be deformed, closed where lines are."""
        return dual(self.triangulated(edge), outward=False)

    def to_pyvista(self) -> pv.PolyData:
        """Return the tubes as PyVista's."""
        return self.triangulated().to_pyvista()

    def as_dict(self) -> dict[str, Any]:
        """Return all that is known as plain lists and numbers, angles in radians, as the JSON file has it."""
        return saving.described(self.lines, self.tees, self.unit)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the elements: all that is known of them as .json, a bill of materials as .csv, solids as .step or .stp.

        STEP files need the extra `step`. They are in the cloud's unit, or say mm if that is not known. The tubes in
        triangles are written as meshes are, as .vtp, .ply or .glb.
        """
        file = checks.path("path", path)
        if file.suffix.lower() in saving.ENDINGS:
            saving.save(self.lines, self.tees, self.unit, file)
        else:
            self.triangulated().save(mesh_path(file, saving.ENDINGS))


@dataclass(frozen=True, eq=False, repr=False)
class PipeLine(Pipes):
    """A line of pipe: straights, bends and reducers, each tangent to the next one, but for straights at a miter.

    Attributes
    ----------
    elements : tuple of PipeElement
        In order along the line.
    labels : (n,) array of int
        Element of each point of the cloud, -1 for those that are not on the line.
    rms : float
        Root mean square distance of the line's points.
    stops : (str, str)
        Why it ends where it does, at its start and its end: "end" of the points; "obstacle" where something else
        begins, such as a flange, a vessel or a wall; "tee" at the side of another line of a plant; "closed" where it
        comes back to itself; closed at both it comes back to where its first straight starts.
    chain : Chain
        Axis and radii of all elements as one surface.
    unit : str or None
        Unit of length of the cloud, if it is known.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> line = sm.follow_pipe(np.stack([np.cos(turn), np.sin(turn), height], axis=1), pick=(1, 0, 6))
    >>> line
    PipeLine(1 element, diameter 2, length 11.9...)
    >>> line.mesh().n_holes
    2
    """

    elements: tuple[PipeElement, ...]
    labels: Indices
    rms: float
    stops: tuple[str, str]
    chain: Chain
    unit: str | None = None

    def __repr__(self) -> str:
        count = len(self.elements)
        sizes = ", ".join(f"{2 * r:.6g}" for r in self.chain.radii)
        return f"PipeLine({count} element{'s' * (count != 1)}, diameter {sizes}, length {self.length:.6g})"

    @property
    def lines(self) -> tuple[PipeLine, ...]:  # type: ignore[override]
        """Itself, as those of a plant."""
        return (self,)

    @property
    def tees(self) -> tuple[PipeElement, ...]:  # type: ignore[override]
        """None."""
        return ()

    @property
    def length(self) -> float:
        """Length along the axis."""
        return float(self.chain.stations[-1])

    def distance(self, points: Any) -> Array:
        """Return the signed distances (n,) of points (n, 3) from the line's surface, which goes on past its ends."""
        return self.chain.distance(points)
