"""The result of a reconstruction: the model, with the arrays of its data, the distances to it, and its record."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.html import card, grid
from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import State
from simplexmesh.motion.start.report import StartReport
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.motion.topology.handles import HandleProposal
from simplexmesh.motion.topology.holes import HoleProposal
from simplexmesh.numerics.blending import blended
from simplexmesh.surface.features.lines.network import FeatureLine

Rows = tuple[Indices, Array]

COLUMNS = ("mean", "rms", "95 %", "max", "points")

LEAST_BARE = 0.02
"""Share of a model without data nearby from which it is told: of closed bodies it is 0, the bottom of an object scanned
from all other sides is 4 to 11 %, the back of a face or of a single range image 30 to 40 %."""

NEAREST = 4
"""Points whose values are averaged, by the inverse of their squared distances."""


@dataclass(frozen=True)
class Summary:
    """Mean, root mean square, 95th percentile, maximum and number of a set of distances.

    Examples
    --------
    >>> Summary.of(np.array([0.0, 3.0, 4.0, np.nan]))
    Summary(mean=2.333, rms=2.887, p95=3.9, max=4, count=3)
    """

    mean: float
    rms: float
    p95: float
    max: float
    count: int

    @classmethod
    def of(cls, distances: Array) -> Summary:
        """Return the summary of the absolute values of the finite ones of (n,) distances; NaN without any."""
        known = np.abs(distances[np.isfinite(distances)])
        if not len(known):
            return cls(float("nan"), float("nan"), float("nan"), float("nan"), 0)
        return cls(
            float(known.mean()),
            float(np.sqrt((known**2).mean())),
            float(np.percentile(known, 95)),
            float(known.max()),
            len(known),
        )

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name}={getattr(self, name):.4g}" for name in ("mean", "rms", "p95", "max"))
        return f"Summary({numbers}, count={self.count})"


@dataclass(frozen=True, repr=False)
class Distance:
    """Distances between a mesh and its data, both ways, in the data's unit.

    Attributes
    ----------
    mesh_to_data : Summary
        From the vertices of the mesh to the surface in the data along their normals, or to the nearest point of the
        data where there is none within reach.
    data_to_mesh : Summary
        From the points of the data to the surface of the mesh (its fan triangulation). Of a volume, these are the
        points reached from the background.
    enclosed : Summary
        The part of `data_to_mesh` inside the model and far from its surface: walls of cavities that the model closes
        over, such as airways behind sealed nostrils.
    """

    mesh_to_data: Summary
    data_to_mesh: Summary
    enclosed: Summary

    def _rows(self) -> dict[str, tuple[str, ...]]:
        """Return the rows of a table; without `enclosed` where there is none."""
        kinds = {"mesh to data": self.mesh_to_data, "data to mesh": self.data_to_mesh, "enclosed": self.enclosed}
        return {
            name: (*(f"{value:.4g}" for value in (one.mean, one.rms, one.p95, one.max)), f"{one.count:,}")
            for name, one in kinds.items()
            if one.count or name != "enclosed"
        }

    def __repr__(self) -> str:
        rows = {"": COLUMNS, **self._rows()}
        return "\n".join(f"{name:12}" + "".join(f"{cell:>11}" for cell in cells) for name, cells in rows.items())

    def _repr_html_(self) -> str:
        """Return the table, as notebooks show."""
        return grid(COLUMNS, self._rows())

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Return plain numbers, ready for JSON."""
        return asdict(self)


UNMEASURED = Distance(*(Summary.of(np.zeros(0)) for _ in range(3)))


@dataclass(frozen=True)
class TopologyRecord:
    """The changes of topology and connectivity made by a reconstruction.

    Attributes
    ----------
    holes : tuple of HoleProposal
        The zones far from the data, each cut off or with the reason for refusal.
    handles : tuple of HandleProposal
        The pairs of faces considered for a handle, likewise.
    refined : int
        Number of vertices added by refinement.
    exchanged : int
        Number of pairs of faces merged in exchange for divisions of other faces.
    swapped : int
        Number of edges swapped to even out face sizes, except while wrapping.
    exceptions : tuple of int
        The faces of the final mesh, without holes, that have fewer than five or more than seven vertices.
    """

    holes: tuple[HoleProposal, ...] = ()
    handles: tuple[HandleProposal, ...] = ()
    refined: int = 0
    exchanged: int = 0
    swapped: int = 0
    exceptions: tuple[int, ...] = ()


@dataclass(frozen=True, repr=False)
class Reconstruction:
    """A reconstructed surface model, its quality of fit, and the record of how it was made.

    Attributes
    ----------
    mesh : SimplexMesh
        The model, in the data's physical space; its data array `distance` is that of each vertex to the data.
    distance : Distance
        Mean, rms, 95th percentile and maximum distance, from mesh to data and from data to mesh, in the data's unit.
        NaN when the run was interrupted before they were measured.
    history : tuple of State
        One state per iteration; none for a model made along the sharp edges of triangles.
    converged : bool
        Whether the mesh came to rest within the iterations.
    start : SimplexMesh
        The start mesh.
    found : StartReport or None
        Report of the automatic start: grid, genus, tunnels sealed, pieces dropped. Also where a sphere did not come to
        the genus of the data, and the model continued from the automatic start. None for a start that was given, and
        for a model made along the sharp edges of triangles.
    tangled : int or None
        Number of vertices on faces that are folded or intersect others after untangling: 0, unless the model is too
        coarse for the data or of another topology. `mesh.check(self_intersections=True)` lists them. None when the
        motion was interrupted before the test.
    interrupted : bool
        Whether the run was interrupted (Ctrl-C); `mesh` is then the last complete state.
    topology : TopologyRecord
        The holes and handles proposed, each accepted or refused with a reason, and the counts of refinement.
    bare : float
        Share of the area of the mesh without data nearby, as of a lid that closes open data; NaN as for `distance`.
    restored : int
        Number of vertices put back where parts of the model had strayed from the data: vertices or centers of faces
        were farther from it than the start was there, by more than a mean edge, or twice the noise or spacing of the
        data where that is more.
    strayed : int
        Number of vertices that, or whose faces, are still farther from the data than that.
    creases : tuple of FeatureLine
        The sharp edges of the data, the longest first: lines along edges of the mesh, through its vertices whose data
        array `crease` is 1. Empty where all is smooth.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> model = sm.reconstruct(sm.sphere(16).vertices, vertices=300)
    >>> model.mesh.n_vertices, model.tangled, model.interrupted
    (300, 0, False)
    """

    mesh: SimplexMesh
    distance: Distance
    history: tuple[State, ...] = ()
    converged: bool = False
    start: SimplexMesh | None = None
    found: StartReport | None = None
    tangled: int | None = None
    interrupted: bool = False
    topology: TopologyRecord = field(default_factory=TopologyRecord)
    bare: float = float("nan")
    restored: int = 0
    strayed: int = 0
    creases: tuple[FeatureLine, ...] = ()

    def _repr_html_(self) -> str:
        """Return a small picture of the model and a table, as notebooks show."""
        rows = {
            **self.mesh._facts(),
            "mesh to data": f"rms {self.distance.mesh_to_data.rms:.4g}, max {self.distance.mesh_to_data.max:.4g}",
            "data to mesh": f"rms {self.distance.data_to_mesh.rms:.4g}, max {self.distance.data_to_mesh.max:.4g}",
            "sharp edges": f"{len(self.creases)}, length {sum(line.length for line in self.creases):.4g}",
            "area without data": f"{self.bare:.0%}",
            "motion": f"{self._end}, {len(self.history)} iterations",
        }
        return card(f"Reconstruction, {self.mesh.n_vertices:,} vertices", rows, self.mesh)

    @property
    def _end(self) -> str:
        return "interrupted" if self.interrupted else "at rest" if self.converged else "still moving"

    def __repr__(self) -> str:
        bare = f"{self.bare:.0%} of its area without data, " if self.bare >= LEAST_BARE else ""
        return (
            f"Reconstruction({self.mesh!r}, mesh to data rms {self.distance.mesh_to_data.rms:.4g}, "
            f"data to mesh rms {self.distance.data_to_mesh.rms:.4g}, {bare}{self._end} "
            f"after {len(self.history)} iterations)"
        )


def with_data_of(mesh: SimplexMesh, source: Any) -> SimplexMesh:
    """Return a mesh with the unit of its data, and arrays from the nearest points or places; it keeps its own."""
    data = getattr(source, "data", {})
    if not data:
        return replace(mesh, unit=source.unit)
    rows, weights = (_corners if isinstance(source, TriangleMesh) else _neighbors)(source, mesh.vertices)
    return replace(mesh, data={**blended(data, rows, weights), **mesh.data}, unit=source.unit)


def _neighbors(cloud: Any, places: Array) -> Rows:
    distance, rows = cKDTree(cloud.points).query(places, k=min(NEAREST, len(cloud)), workers=-1)
    nearest = np.maximum(distance[:, :1], np.finfo(np.float64).tiny)
    return rows, np.where(distance > 0, nearest / np.maximum(distance, nearest), 1.0) ** 2


def _corners(surface: TriangleMesh, places: Array) -> Rows:
    """Return the corners of the nearest triangles and the shares of their areas opposite the nearest points."""
    _, closest, faces = Triangles(surface).closest(places)
    rows = surface.faces[faces]
    ends = surface.vertices[rows] - closest[:, None]
    whole = surface.face_vectors[faces]
    shares = [dot(cross(ends[:, (j + 1) % 3], ends[:, (j + 2) % 3]), whole) for j in range(3)]
    weights = np.clip(np.stack(shares, axis=1), 0.0, None)
    known = weights.sum(axis=1, keepdims=True) > 0  # not for a triangle without area
    return rows, np.where(known, weights, 1.0)
