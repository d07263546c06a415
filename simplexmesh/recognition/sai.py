"""Spherical attribute images: shape signatures, a simplex angle per vertex of a sphere, torus, cylinder or disc."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.motion.subjects import as_subject
from simplexmesh.recognition.flat_domains import TOPOLOGIES, FlatDomain, domain
from simplexmesh.recognition.flat_fitting import fit_flat_domain
from simplexmesh.recognition.sai_files import read, write
from simplexmesh.recognition.sphere_domain import SphereDomain, checked_frequency
from simplexmesh.recognition.sphere_fitting import fit_sphere, vertex_areas
from simplexmesh.recognition.surface_samples import check_samples, samples, visibility_threshold

Array = NDArray[np.float64]

MINIMUM_VISIBLE = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class SAI:
    """The signature of a shape: simplex angles on a quasi-regular sphere fitted to it (Delingette 1994, chapter 6).

    Parameters
    ----------
    frequency : int
        f, 5 to 12: the mesh has 20 f^2 vertices, a disc about as many.
    mesh : SimplexMesh
        The sphere fitted to the object, in the object's frame; its connectivity is that of ``sm.sphere(frequency)``.
        For other topologies a torus, a cylinder or a disc: see `simplexmesh.recognition.flat_domains`.
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
    hidden: NDArray[np.bool_] = None  # type: ignore[assignment]
    distance: Array = None  # type: ignore[assignment]
    threshold: float = float("inf")
    topology: str = "sphere"

    def __post_init__(self) -> None:
        f = checked_frequency(self.frequency)
        if not isinstance(self.mesh, SimplexMesh):
            raise TypeError(f"mesh must be a SimplexMesh, not {type(self.mesh).__name__}")
        shared = domain(_check.choice("topology", self.topology, TOPOLOGIES), f).mesh.connectivity
        if self.mesh.connectivity is not shared and not np.array_equal(self.mesh.connectivity.twin, shared.twin):
            raise ValueError(
                f"mesh must have the connectivity of the {self.topology} of frequency {f}, not that of {self.mesh!r}"
            )
        n = self.mesh.n_vertices
        hidden = np.zeros(n, bool) if self.hidden is None else np.asarray(self.hidden)
        if hidden.dtype != bool or hidden.shape != (n,):
            raise ValueError(f"hidden must be {n} booleans, not {hidden.dtype} of shape {hidden.shape}")
        distance = np.zeros(n) if self.distance is None else _check.array("distance", self.distance, (n,))
        object.__setattr__(self, "hidden", _check.frozen(hidden))
        object.__setattr__(self, "distance", _check.frozen(distance))

    def __repr__(self) -> str:
        kind = "" if self.topology == "sphere" else f"{self.topology}, "
        seen = "" if not self.hidden.any() else f", {self.visible_fraction:.0%} of the {self.topology} seen"
        return f"SAI({kind}frequency {self.frequency}, {self.n_vertices} vertices{seen})"

    @property
    def domain(self) -> SphereDomain | FlatDomain:
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
        return self.domain.vertices

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
        cells = self.domain.cell_areas
        return float(cells[~self.hidden].sum() / cells.sum())

    @cached_property
    def center(self) -> Array:
        """(3,) mean direction of the visible part, a unit vector; the x axis if all is visible."""
        cells = self.domain.cell_areas
        mean = (self.directions * cells[:, None])[~self.hidden].sum(axis=0)
        length = float(np.linalg.norm(mean))
        return np.array([1.0, 0.0, 0.0]) if length < 1e-6 * cells.sum() else mean / length

    def plot(self, **options: Any) -> Any:
        """Show the signature on its domain, on the sphere with vertices at radius pi + phi; hidden vertices are gray.

        Parameters
        ----------
        **options
            As for `simplexmesh.plot.signature`.

        Returns
        -------
        pyvista.Plotter
            `.show()` opens a window; `simplexmesh.plot.picture` writes a file.
        """
        from simplexmesh.plot.attribute_image import signature

        return signature(self, **options)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the signature to a file, atomically.

        Parameters
        ----------
        path : str or Path
            By convention ending in .npz.
        """
        write(
            path,
            frequency=np.array(self.frequency),
            vertices=self.mesh.vertices,
            hidden=self.hidden,
            distance=self.distance,
            threshold=np.array(self.threshold),
            topology=np.array(self.topology),
        )

    @staticmethod
    def load(path: str | os.PathLike[str]) -> SAI:
        """Read a signature written by `save`.

        Raises
        ------
        OSError
            The file is missing, of another kind or truncated.
        """
        with read(path) as parts:
            frequency = int(parts["frequency"])
            topology = str(parts["topology"]) if "topology" in parts else "sphere"
            mesh = domain(topology, frequency).mesh.moved(parts["vertices"])
            return SAI(frequency, mesh, parts["hidden"], parts["distance"], float(parts["threshold"]), topology)


def sai(
    data: Any,
    frequency: int = 9,
    *,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    poses: ArrayLike | None = None,
    threshold: float | None = None,
    topology: str = "sphere",
    progress: bool | Report = False,
) -> SAI:
    """Return the spherical attribute image of an object, or its image on a torus, a cylinder or a disc.

    A quasi-regular sphere starts as an ellipsoid around the data and is deformed with metric parameters 1/3, under
    strong, then light smoothing, until it converges. Its simplex angles are invariant to translation and scale of the
    object; rotating the object rotates them on the sphere.

    Parameters
    ----------
    data : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or sequence of scans
        A complete object, several views of it in one frame, or one view.
    frequency : int
        f, 5 to 12; the signature has 20 f^2 values, on a disc about as many. Only signatures of one frequency can be
        compared.
    level, label, inside
        The surface of a volume, as in `reconstruct`.
    poses : path, mapping or sequence, optional
        T_world_scan of each of several scans, as in `reconstruct`.
    threshold : float, optional
        Vertices farther than this from the data are hidden, in the data's unit. Default: three times the distance
        between neighboring samples where they are sparse, and at least three quarters of the mean edge of the mesh.
    topology : {"sphere", "torus", "cylinder", "plane"}
        Of the domain: "torus" for objects with one handle and no border, knotted or not, "cylinder" for tubes with two
        borders, "plane" for sheets with one border. The sphere suits any object; it closes handles.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    SAI

    Raises
    ------
    ValueError, TypeError, OSError
        Data that is missing, too few points or coplanar, or of another topology; a frequency out of range.
    DivergedError
        The deformation produced numbers that are not finite.

    Notes
    -----
    The converged mesh is nearly a conformal image of the sphere. Of all such images the one whose area is balanced
    about the center of the sphere is taken, which makes the result repeatable: see
    `simplexmesh.recognition.sphere_fitting`. Handles of the data are closed.

    A torus, cylinder or disc is mapped to the data by a conformal parameterization followed by an affine stretch
    (`simplexmesh.recognition.parameterization`), then relaxed on the data.

    References
    ----------
    H. Delingette, thesis, 1994, section 6.2 and figure 6.21; H. Delingette, M. Hebert, K. Ikeuchi, *A spherical
    representation for the recognition of curved objects*, ICCV 1993.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> signature = sm.sai(sm.ellipsoid((3, 2, 1), 12), frequency=5)
    >>> bool(abs(signature.area / sm.ellipsoid((3, 2, 1), 40).area - 1) < 0.03)
    True
    """
    frequency = checked_frequency(frequency)
    limit = None if threshold is None else _check.number("threshold", threshold, 0.0, open_low=True)
    _check.choice("inside", inside, ("above", "below"))
    _check.choice("topology", topology, TOPOLOGIES)
    with reporting(progress) as report:
        report(0.0, "reading")
        subject = as_subject(data, level=level, label=label, inside=inside, components="largest", poses=poses)
        points, normals = samples(subject)
        check_samples(points)
        report(0.1, "fitting")
        if topology == "sphere":
            mesh = fit_sphere(points, normals, frequency)
        else:
            options = {"level": level, "label": label, "inside": inside, "poses": poses}
            mesh = fit_flat_domain(subject, data, topology, frequency, options)
        report(0.9, "labeling")
        tree = cKDTree(points)
        distance = tree.query(mesh.vertices, workers=-1)[0]
        limit = visibility_threshold(points, tree, mesh) if limit is None else limit
        found = SAI(frequency, mesh, distance > limit, distance, limit, topology)
        if found.visible_fraction < MINIMUM_VISIBLE:
            raise ValueError(
                f"data must be near the {topology} fitted to it on at least {MINIMUM_VISIBLE:.0%} of it; it is on "
                f"{found.visible_fraction:.1%}, with threshold {limit:g}"
            )
        report(1.0, "done")
    return found
