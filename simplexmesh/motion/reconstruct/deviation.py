"""Signed deviation of a surface from a reference, such as a surgical result from its plan."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.units import common_unit
from simplexmesh.data.conversion import as_given, as_triangles
from simplexmesh.data.foreign import converted
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.reconstruct.result import Summary
from simplexmesh.motion.targets.inward import warn_inward
from simplexmesh.motion.targets.triangles import Triangles


@dataclass(frozen=True, eq=False, repr=False)
class Deviation:
    """Signed distances from the vertices or points of a surface to a reference, in their unit.

    Attributes
    ----------
    distances : (n,) array of float
        Positive outside the reference, negative inside; NaN where undefined.
    summary : Summary
        Summary of their absolute values.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.deviation(sm.sphere(20, radius=1.1), sm.sphere(20)).bias.__round__(2)
    0.1
    """

    distances: Array

    def __repr__(self) -> str:
        s = self.summary
        return f"Deviation(mean={s.mean:.4g}, rms={s.rms:.4g}, p95={s.p95:.4g}, max={s.max:.4g}, bias={self.bias:.4g})"

    @cached_property
    def summary(self) -> Summary:
        """Mean, rms, 95th percentile, maximum and number of the absolute values that are known."""
        return Summary.of(self.distances)

    @property
    def mean(self) -> float:
        """Mean absolute value."""
        return self.summary.mean

    @property
    def rms(self) -> float:
        """Root mean square."""
        return self.summary.rms

    @property
    def p95(self) -> float:
        """95th percentile of the absolute values."""
        return self.summary.p95

    @property
    def max(self) -> float:
        """Maximum absolute value."""
        return self.summary.max

    @property
    def bias(self) -> float:
        """Mean signed value: positive when the surface is outside the reference on average."""
        known = self.distances[np.isfinite(self.distances)]
        return float(known.mean()) if len(known) else float("nan")


def deviation(source: Any, target: Any, *, reach: float | None = None, beyond_border: bool = False) -> Deviation:
    """Return the signed distance from each vertex of a surface to a reference.

    Parameters
    ----------
    source : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface measured, at its vertices or points, one row of the result each.
    target : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        The reference, faces counter-clockwise seen from outside; duplicate positions are merged.
    reach : float, optional
        Distances beyond this, in the unit of the surfaces, become NaN. Default: no limit.
    beyond_border : bool
        Whether distances count whose nearest point of an open reference is on its border. By default they are NaN:
        the reference says nothing beyond its border.

    Returns
    -------
    Deviation
        Draw its `distances` with `plot.heat`.

    Raises
    ------
    ValueError, TypeError
        For anything but a surface, two units, or a reach that is not positive.

    Warns
    -----
    SimplexMeshWarning
        Faces of the reference are turned inward, or against their neighbors.

    Notes
    -----
    Distances are to the triangles. The sign for a closed reference is by winding number. For an open one it is that of
    the normal at the nearest point, on an edge or vertex the angle-weighted pseudonormal (Baerentzen and Aanaes 2005),
    which is correct wherever the nearest point is not on the border.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> planned = sm.sphere(20).triangulated("dual")
    >>> done = sm.TriangleMesh(planned.vertices * [1, 1, 1.1], planned.faces)
    >>> found = sm.deviation(done, planned)
    >>> round(found.max, 2), bool(found.distances[planned.vertices[:, 2].argmax()] > 0.09)
    (0.1, True)
    """
    points, measured = _points(source)
    mesh = as_triangles(target, "target").welded(report=False)
    common_unit("source and target", (measured, mesh))
    checks.size("target", mesh.bounds)
    warn_inward("target", mesh, "signs are wrong there")
    if len(points):
        checks.size("source", np.stack([points.min(axis=0), points.max(axis=0)]))
    distances, _, beyond = Triangles(mesh).signed(points)
    if not beyond_border and not mesh.is_closed:
        distances = np.where(beyond, np.nan, distances)
    if reach is not None:
        reach = checks.number("reach", reach, 0.0, open_low=True)
        distances = np.where(np.abs(distances) <= reach, distances, np.nan)
    return Deviation(checks.frozen(distances))


def _points(source: Any) -> tuple[Array, Any]:
    """Return the (n, 3) vertices or points of a surface, in order, and the surface."""
    if isinstance(source, np.ndarray):
        return checks.array("source", source, (None, 3)), source
    found = converted(source, "source")
    data = as_given(source, "source") if found is None else found
    if isinstance(data, PointCloud):
        return data.points, data
    if not hasattr(data, "vertices"):
        raise TypeError(f"source must be a mesh or points, not {checks.type_name(data)}")
    return np.asarray(data.vertices), data
