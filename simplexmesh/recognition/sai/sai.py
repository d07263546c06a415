"""The spherical attribute image of an object: its shape signature."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Progress, reporting
from simplexmesh._base.vectors import norm
from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.numerics.rigid import relative_extents
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.flat_domains import TOPOLOGIES
from simplexmesh.recognition.sai.flat_fitting import fit_flat_domain
from simplexmesh.recognition.sai.sphere_domain import checked_frequency
from simplexmesh.recognition.sai.sphere_fitting import fit_sphere

FAR, MOST_FAR = 3.0, 0.15
"""Data is far from the mesh beyond so many mean edges; a warning tells if more than this fraction is."""


def sai(
    data: Any,
    frequency: int = 9,
    *,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    poses: ArrayLike | None = None,
    tolerance: float | None = None,
    topology: str = "sphere",
    progress: bool | Progress = False,
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
    tolerance : float, optional
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

    Warns
    -----
    SimplexMeshWarning
        Much of the data is not in the signature, or points are so few that it ends far beyond their border.

    Notes
    -----
    The converged mesh is nearly a conformal image of the sphere. Of all such images the one whose area is balanced
    about the center of the sphere is taken, which makes the result repeatable: see
    `simplexmesh.recognition.sai.sphere_fitting`. Handles of the data are closed.

    A torus, cylinder or disc is mapped to the data by a conformal parameterization followed by an affine stretch
    (`simplexmesh.recognition.sai.parameterization`), then relaxed on the data.

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
    limit = None if tolerance is None else checks.number("tolerance", tolerance, 0.0, open_low=True)
    checks.choice("inside", inside, ("above", "below"))
    checks.choice("topology", topology, TOPOLOGIES)
    with reporting(progress, "computing the signature") as report:
        report(0.0, "reading")
        known = as_input(data, level=level, label=label, inside=inside, poses=poses)
        cloud = _checked_samples(known.samples())
        points = cloud.points
        report(0.1, "fitting")
        if topology == "sphere":
            mesh = fit_sphere(points, cloud.normals, frequency)
        else:
            mesh = fit_flat_domain(known, topology, frequency)
        report(0.9, "labeling")
        tree = cKDTree(points)
        distance = tree.query(mesh.vertices, workers=-1)[0]
        limit = visibility_threshold(points, tree, mesh) if limit is None else limit
        found = SAI(frequency, mesh, distance > limit, distance, limit, topology)
        if found.visible_fraction < 0.05:
            raise ValueError(
                f"data must be near the {topology} fitted to it on at least 5% of it; it is on "
                f"{found.visible_fraction:.1%}, with threshold {limit:g}: is it of several bodies, or one with holes?"
            )
        _warn(found, points, by_default=tolerance is None)
        report(1.0, "done")
    return found


def _warn(found: SAI, points: Array, *, by_default: bool) -> None:
    """Warn of data far from the mesh, and of points so few that much beyond their border counts as seen."""
    some, edge = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)], mean_edge(found.mesh)
    far = float((cKDTree(found.mesh.vertices).query(some)[0] > FAR * edge).mean())
    if far > MOST_FAR:
        place = f"is far from the {found.topology} fitted to it, as several bodies, long limbs and handles are"
        warn(f"{far:.0%} of the data {place}, and not in the signature")
    if by_default and found.threshold > FAR * edge:
        border = border_of_points(some).width.max(initial=0.0)
        if border > 0.3 * norm(np.ptp(some, axis=0)):
            around = f"all within {found.threshold:.3g} of them, also beyond their border"
            warn(f"few points: {around}, counts as seen; give a tolerance")


def _checked_samples(cloud: PointCloud) -> PointCloud:
    """Return points on the surface, enough and not coplanar."""
    if len(cloud.points) < 100:
        raise ValueError(f"data must hold at least 100 points to carry a signature, not {len(cloud.points)}")
    if relative_extents(cloud.points)[2] < 1e-3:
        raise ValueError("data must bend to carry a signature; its points lie in a plane")
    return cloud


def visibility_threshold(points: Array, tree: cKDTree, mesh: SimplexMesh) -> float:
    """Return the largest distance from the data at which a vertex is visible, from sample spacing and edge length."""
    sample = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    distance = tree.query(sample, k=min(5, len(points)), workers=-1)[0][:, -1]
    return max(3.0 * float(np.quantile(distance, 0.95)), 0.75 * mean_edge(mesh))
