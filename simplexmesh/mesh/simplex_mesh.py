"""The simplex mesh: vertex positions on a connectivity. A thin class that forwards to the geometry modules."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.html import card
from simplexmesh._base.named_arrays import Located, joined, named_arrays
from simplexmesh._base.units import unit_or_none
from simplexmesh.mesh import face_geometry, geometry, triangulation
from simplexmesh.mesh.check import Report, check
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.paths import path_vertices, same_edges


@dataclass(frozen=True, eq=False, repr=False)
class SimplexMesh(Located):
    """A surface mesh in which every vertex has three neighbors.

    Immutable: arrays are read-only copies; `moved` and `with_data` return new meshes that share the connectivity.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions, finite, in the unit of the data.
    connectivity : Connectivity
        The topology; neighbors and faces are counter-clockwise seen from outside.
    data : mapping of str to array, optional
        Named arrays with one row per vertex.
    unit : str, optional
        Unit of length of the vertices: "nm", "um", "mm", "cm", "m", "km", "in" or "ft".

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(6, radius=2.0)
    >>> ball
    SimplexMesh(720 vertices, 362 faces, genus 0, 0 holes)
    >>> bool(np.allclose(ball.sphere_curvature, 1 / 2.0))
    True
    >>> round(ball.moved(2 * ball.vertices).area / ball.area, 12)
    4.0
    """

    vertices: Array
    connectivity: Connectivity
    data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    unit: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.connectivity, Connectivity):
            raise TypeError(f"connectivity must be a Connectivity, not {type(self.connectivity).__name__}")
        n = self.connectivity.n_vertices
        vertices = checks.array("vertices", self.vertices, (n, 3))
        object.__setattr__(self, "vertices", checks.frozen(vertices, np.float64))
        object.__setattr__(self, "data", named_arrays(self.data, n, "vertex"))
        object.__setattr__(self, "unit", unit_or_none("unit", self.unit))

    def __repr__(self) -> str:
        components = "" if self.n_components == 1 else f", {self.n_components} components"
        counts = f"{self.n_vertices} vertices, {self.n_faces} faces"
        return f"SimplexMesh({counts}, genus {self.genus}, {self.n_holes} holes{components})"

    def _repr_html_(self) -> str:
        """Return a small picture and a table, as notebooks show."""
        return card(f"SimplexMesh, {self.n_vertices:,} vertices", self._facts(), self)

    def _facts(self) -> dict[str, str]:
        """Return the rows of a table of what matters."""
        pieces = "" if self.n_components == 1 else f", {self.n_components} pieces"
        named = list(self.connectivity.contour_darts)
        return {
            "faces": f"{self.n_faces:,}",
            "topology": f"genus {self.genus}, {self.n_holes} holes{pieces}",
            "area, volume": f"{self.area:.4g}, {self.volume:.4g}",
            **super()._facts(),
            **({"contours": ", ".join(named[:6] + ["..."] * (len(named) > 6))} if named else {}),
        }

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the arguments only, not the cached arrays."""
        return SimplexMesh, (self.vertices, self.connectivity, dict(self.data), self.unit)

    # ---- topology

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return self.connectivity.n_vertices

    @property
    def n_faces(self) -> int:
        """Number of faces of the surface, holes excluded."""
        return self.connectivity.n_faces

    @property
    def n_holes(self) -> int:
        """Number of holes."""
        return self.connectivity.n_holes

    @property
    def n_components(self) -> int:
        """Number of connected components."""
        return self.connectivity.n_components

    @property
    def genus(self) -> int:
        """Number of handles."""
        return self.connectivity.genus

    @property
    def neighbors(self) -> Indices32:
        """(n, 3) the neighbors of each vertex, counter-clockwise seen from outside."""
        return self.connectivity.neighbors

    @cached_property
    def faces(self) -> tuple[Indices32, ...]:
        """The vertices of each face of the surface, counter-clockwise seen from outside; holes excluded."""
        c = self.connectivity
        loops = np.split(c.face_vertices, c.face_offsets[1:-1])
        return tuple(loop for loop, hole in zip(loops, c.face_is_hole, strict=True) if not hole)

    @property
    def _faces(self) -> tuple[Indices32, Indices32]:
        return self.connectivity.face_vertices, self.connectivity.face_offsets

    # ---- geometry, computed on first access

    @property
    def _measured(self) -> Array:
        """The vertices, refused where products of areas overflow or vanish."""
        checks.size("mesh", self.bounds)
        return self.vertices

    @cached_property
    def normals(self) -> Array:
        """(n, 3) unit normals, outward; see `geometry.normals`."""
        return checks.frozen(geometry.normals(self._measured, self.neighbors))

    @cached_property
    def simplex_angle(self) -> Array:
        """(n,) simplex angles in radians, positive where convex; see `geometry.simplex_angle`."""
        return checks.frozen(geometry.simplex_angle(self._measured, self.neighbors))

    @cached_property
    def sphere_curvature(self) -> Array:
        """(n,) curvature of the sphere through a vertex and its neighbors, 1 / unit; see `geometry.sphere_curvature`.

        It is what the forces of the deformable model even out. Of the surface it is the mean curvature on spheres only.
        """
        return checks.frozen(geometry.sphere_curvature(self._measured, self.neighbors))

    @cached_property
    def metric(self) -> Array:
        """(n, 3) metric parameters, with sum 1; see `geometry.metric_parameters`."""
        return checks.frozen(geometry.metric_parameters(self._measured, self.neighbors))

    @cached_property
    def face_areas(self) -> Array:
        """(f,) area of each face, holes included; see `face_geometry.face_areas`."""
        return checks.frozen(face_geometry.face_areas(self._measured, *self._faces))

    @cached_property
    def face_gauss(self) -> Array:
        """(f,) Gaussian measure of each face, holes included; see `face_geometry.face_gauss`."""
        return checks.frozen(face_geometry.face_gauss(self.normals, *self._faces))

    @cached_property
    def area(self) -> float:
        """Area of the surface, holes excluded, in the squared unit of the vertices."""
        return float(self.face_areas[~self.connectivity.face_is_hole].sum())

    @cached_property
    def volume(self) -> float:
        """Signed enclosed volume in the cubed unit of the vertices, each hole closed by a fan."""
        return face_geometry.enclosed_volume(self._measured, *self._faces)

    def check(self, *, self_intersections: bool = False) -> Report:
        """Return a report of the defects of the mesh, true when there are none; see `check.check`.

        Examples
        --------
        >>> from simplexmesh.mesh.shapes import sphere
        >>> print(sphere(4).check(self_intersections=True))
        nothing wrong
        """
        return check(self, crossings=checks.flag("self_intersections", self_intersections))

    # ---- contours

    @property
    def contours(self) -> dict[str, Contour]:
        """The named contours of the mesh, each a `Contour`; see `with_contours`."""
        c = self.connectivity
        return {name: Contour(self, *path_vertices(darts, c.twin)) for name, darts in c.contour_darts.items()}

    def with_contours(self, **contours: Contour | None) -> SimplexMesh:
        """Return the mesh with named contours added, replaced, or renamed if it has them; None removes one.

        They are part of its connectivity: they move with it, go through edits, batches of edits, `refine`,
        `redistribute`, `decimate` and `regularize`, and are saved with it (VTP). Edits insert vertices on them and
        remove some, but refuse what would break one: removing an edge of it or an end, swapping an edge at one of its
        vertices, an edge between two of its edges. Only a cut or join drops contours that lose edges, with a warning.
        Decimation keeps the vertices that are left on contours in place, but those of `crease`.

        Parameters
        ----------
        **contours : Contour, or None
            Contours of this mesh, or of one with the same connectivity, that have no edges in common.

        Raises
        ------
        TopologyError
            When one is not on this mesh, or two have an edge in common.
        ValueError
            When one to be removed is not there.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> ball = sm.sphere(6)
        >>> x, y, z = ball.vertices.T
        >>> equator = sm.Contour.through(ball, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
        >>> named = ball.with_contours(equator=equator)
        >>> 3 < len(sm.decimate(named, vertices=300).mesh.contours["equator"]) < len(equator)
        True
        """
        kept: dict[str, NDArray[Any]] = {k: v for k, v in self.connectivity.contour_darts.items() if k not in contours}
        for name, contour in contours.items():
            if contour is None and name not in self.connectivity.contour_darts:
                raise ValueError(
                    f"contours to remove must be of {sorted(self.connectivity.contour_darts)}, not {name!r}"
                )
            if contour is not None:
                given = checks.instance(f"contour {name!r}", contour, Contour)
                if not np.array_equal(given.mesh.connectivity.twin, self.connectivity.twin):
                    raise TopologyError(f"contour {name!r} is on another mesh, or on this one before an edit")
                darts, twin = Contour(self, given.vertices, given.closed).darts, self.connectivity.twin
                kept = {k: v for k, v in kept.items() if k in contours or not same_edges(darts, v, twin)} | {
                    name: darts
                }
        return replace(self, connectivity=replace(self.connectivity, contour_darts=kept))

    # ---- new objects

    def moved(self, vertices: ArrayLike) -> SimplexMesh:
        """Return the mesh with new vertex positions, sharing the connectivity and keeping the data."""
        return SimplexMesh(vertices, self.connectivity, self.data, self.unit)  # type: ignore[arg-type]

    def transformed(self, T_target_source: ArrayLike) -> SimplexMesh:
        """Return the mesh in the target frame of a (4, 4) affine; reflections, which turn it inside out, are refused.

        Examples
        --------
        >>> from simplexmesh.mesh.shapes import sphere
        >>> round(sphere(4).transformed(np.diag([2.0, 2.0, 2.0, 1.0])).diagonal / sphere(4).diagonal, 12)
        2.0
        """
        T = checks.affine("T_target_source", T_target_source)
        if np.linalg.slogdet(T[:3, :3])[0] < 0:
            raise ValueError("T_target_source must keep the orientation of a simplex mesh; it is a reflection")
        return self.moved(self.vertices @ T[:3, :3].T + T[:3, 3])

    # ---- imported when called: these belong to higher packages, but users look for them on the mesh

    @cached_property
    def mean_curvature(self) -> Array:
        """(n,) mean curvature of the surface in 1 / unit, positive where convex: `mean` of `simplexmesh.curvature`.

        NaN, with a warning, where there is no estimate.
        """
        return importlib.import_module("simplexmesh.surface.curvature.estimate").curvature(self).mean

    def triangulated(self, method: str = "fan") -> Any:
        """Return a `TriangleMesh` of the surface, holes left open, with the data (of centroids: means) and the unit.

        Parameters
        ----------
        method : {"fan", "curved", "dual"}
            "fan" divides each face into triangles around its centroid and keeps the border exactly; "curved" does too,
            with centroids lifted onto the surface that the normals of the vertices tell, and vertices so much beyond
            it that the triangles are as far outside as inside in the mean: closest to what is smooth, with its volume,
            but not checked for crossings; "dual" has a vertex for each face and a triangle for each vertex, fewer of
            both, and underestimates the curvature.

        Examples
        --------
        >>> from simplexmesh.mesh.shapes import sphere
        >>> len(sphere(2).triangulated("dual").faces)
        80
        """
        checks.choice("method", method, ["fan", "curved", "dual"])
        c = self.connectivity
        data = triangulation.data_of_faces(self.data, c)
        if method == "dual":
            points, triangles = triangulation.dual_triangles(self.vertices, c)
        elif method == "curved":
            points, triangles = triangulation.curved_fan(self.vertices, self.normals, c, self.data.get("crease"))
        else:
            points, triangles = triangulation.fan(self.vertices, c)
        kind = importlib.import_module("simplexmesh.data.triangles").TriangleMesh
        return kind(points, triangles, data if method == "dual" else joined([self.data, data]), self.unit)
