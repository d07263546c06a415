"""Spherical attribute images, in memory and in files: a simplex angle per vertex of a sphere, torus, tube or disc."""

from __future__ import annotations

import os
import zipfile
import zlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.drafts import draft
from simplexmesh._base.html import card
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.recognition.sai.flat_domains import TOPOLOGIES, FlatDomain, domain
from simplexmesh.recognition.sai.sphere_domain import SphereDomain, checked_frequency
from simplexmesh.recognition.sai.sphere_fitting import vertex_areas

KIND = "simplexmesh SAI 1"

DAMAGE = (
    *(ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OSError, MemoryError),
    *(NotImplementedError, OverflowError, zipfile.BadZipFile, zlib.error),
)
"""Exceptions that reading a damaged file may raise."""

LARGEST_FILE = 1 << 20
"""Bytes of an unpacked file, ten times those of the largest signature: what is packed may be a thousand times more."""


@dataclass(frozen=True, eq=False, repr=False)
class SAI:
    """The signature of a shape: simplex angles on a quasi-regular sphere fitted to it (Delingette 1994, chapter 6).

    Parameters
    ----------
    frequency : int
        f, 5 to 12: the mesh has 20 f^2 vertices, a disc about as many.
    mesh : SimplexMesh
        The sphere fitted to the object, in the object's frame; its connectivity is that of ``sm.sphere(frequency)``.
        For other topologies a torus, a cylinder or a disc: see `simplexmesh.recognition.sai.flat_domains`.
    hidden : (n,) array of bool, optional
        Vertices without data nearby: they bridge what was not seen. By default none.
    distance : (n,) array of float, optional
        From each vertex to the nearest data, in the data's unit.
    threshold : float
        Vertices farther than this from the data are hidden, in the data's unit.
    topology : {"sphere", "torus", "cylinder", "plane"}
        Of the mesh; "plane" is a disc.

    Raises
    ------
    ValueError, TypeError

    Examples
    --------
    >>> import simplexmesh as sm
    >>> signature = sm.sai(sm.ellipsoid((3, 2, 1), 12).vertices, frequency=5)
    >>> signature.angles.shape, bool(signature.hidden.any())
    ((500,), False)
    """

    frequency: int
    mesh: SimplexMesh
    hidden: Mask = None  # type: ignore[assignment]
    distance: Array = None  # type: ignore[assignment]
    threshold: float = float("inf")
    topology: str = "sphere"

    def __post_init__(self) -> None:
        f = checked_frequency(self.frequency)
        if not isinstance(self.mesh, SimplexMesh):
            raise TypeError(f"mesh must be a SimplexMesh, not {type(self.mesh).__name__}")
        shared = domain(checks.choice("topology", self.topology, TOPOLOGIES), f).mesh.connectivity
        if self.mesh.connectivity is not shared and not np.array_equal(self.mesh.connectivity.twin, shared.twin):
            raise ValueError(
                f"mesh must have the connectivity of the {self.topology} of frequency {f}, not that of {self.mesh!r}"
            )
        n = self.mesh.n_vertices
        hidden = np.zeros(n, bool) if self.hidden is None else np.asarray(self.hidden)
        if hidden.dtype != bool or hidden.shape != (n,):
            raise ValueError(f"hidden must be {n} booleans, not {hidden.dtype} of shape {hidden.shape}")
        distance = np.zeros(n) if self.distance is None else checks.array("distance", self.distance, (n,))
        object.__setattr__(self, "hidden", checks.frozen(hidden))
        object.__setattr__(self, "distance", checks.frozen(distance))

    def __repr__(self) -> str:
        kind = "" if self.topology == "sphere" else f"{self.topology}, "
        seen = "" if not self.hidden.any() else f", {self.visible_fraction:.0%} of the {self.topology} seen"
        return f"SAI({kind}frequency {self.frequency}, {self.n_vertices} vertices{seen})"

    def _repr_html_(self) -> str:
        """Return a picture of the angles, gray where nothing was seen, and a table, as notebooks show."""
        low, middle, high = np.degrees(np.quantile(self.angles, [0.05, 0.5, 0.95]))
        rows = {
            "topology, frequency": f"{self.topology}, {self.frequency}",
            "vertices": f"{self.n_vertices:,}",
            "seen": f"{self.visible_fraction:.0%}",
            "area": f"{self.area:.4g}",
            "angles, 5 %, median, 95 %": f"{low:.1f}, {middle:.1f}, {high:.1f} degrees",
        }
        return card("SAI", rows, self.mesh, values=np.where(self.hidden, np.nan, self.angles))

    @property
    def _domain(self) -> SphereDomain | FlatDomain:
        """The regular mesh of the signature: the unit sphere, or the torus, cylinder or disc of its topology."""
        return domain(self.topology, self.frequency)

    @property
    def n_vertices(self) -> int:
        """Number of vertices: 20 f^2, on a disc about as many."""
        return self.mesh.n_vertices

    @property
    def angles(self) -> Array:
        """(n,) simplex angle at each vertex, in radians, positive where the surface is convex."""
        return self.mesh.simplex_angle

    @property
    def directions(self) -> Array:
        """(n, 3) position of each vertex on the unit sphere, or on the domain of another topology."""
        return self._domain.vertices

    @property
    def area(self) -> float:
        """Area of the fitted mesh, in the data's unit squared."""
        return self.mesh.area

    @cached_property
    def visible_area(self) -> float:
        """The visible part of `area` (A1 of equation 6.8)."""
        areas = vertex_areas(self.mesh)
        return float(self.area * areas[~self.hidden].sum() / areas.sum())

    @cached_property
    def visible_fraction(self) -> float:
        """The visible fraction of the unit sphere (A2 of equation 6.8, over 4 pi)."""
        cells = self._domain.cell_areas
        return float(cells[~self.hidden].sum() / cells.sum())

    @cached_property
    def center(self) -> Array:
        """(3,) mean direction of the visible part, a unit vector; the x axis if all is visible."""
        cells = self._domain.cell_areas
        mean = (self.directions * cells[:, None])[~self.hidden].sum(axis=0)
        length = float(np.linalg.norm(mean))
        return np.array([1.0, 0.0, 0.0]) if length < 1e-6 * cells.sum() else mean / length

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the signature to a file, atomically.

        Parameters
        ----------
        path : str or Path
            By convention ending in .npz.
        """
        parts = {
            "frequency": self.frequency, "vertices": self.mesh.vertices, "hidden": self.hidden,
            "distance": self.distance, "threshold": self.threshold, "topology": self.topology,
        }  # fmt: skip
        with draft(checks.path("path", path)) as part, part.open("wb") as file:
            np.savez_compressed(file, kind=np.array(KIND), **parts)  # type: ignore[arg-type]

    @staticmethod
    def load(path: str | os.PathLike[str]) -> SAI:
        """Read a signature written by `save`.

        Raises
        ------
        OSError
            The file is missing, of another kind or truncated.
        """
        target = checks.path("path", path)
        if not target.is_file():
            raise FileNotFoundError(f"there is no file {target}")
        try:
            with target.open("rb") as raw, np.load(raw, allow_pickle=False) as parts:
                if sum(member.file_size for member in parts.zip.infolist()) > LARGEST_FILE:
                    raise ValueError(f"unpacked it is larger than {LARGEST_FILE:,} bytes")
                if str(parts["kind"]) != KIND:
                    raise ValueError(f"it is of kind {str(parts['kind'])[:40]!r}")
                frequency = int(parts["frequency"])
                topology = str(parts["topology"]) if "topology" in parts else "sphere"
                mesh = domain(topology, frequency).mesh.moved(parts["vertices"])
                return SAI(frequency, mesh, parts["hidden"], parts["distance"], float(parts["threshold"]), topology)
        except DAMAGE as error:
            raise OSError(f"{target} is not a whole signature written by SAI.save: {str(error)[:100]}") from None
