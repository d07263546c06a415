"""The poses of several scans of one object, in any order and without an initial guess."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.html import card
from simplexmesh._base.progress import Progress, reporting
from simplexmesh.data.conversion import as_given
from simplexmesh.data.points import PointCloud
from simplexmesh.data.volume import Volume
from simplexmesh.recognition.register.icp import about_origin, between_frames
from simplexmesh.recognition.scans.assembly import Assembly, Hypothesis
from simplexmesh.recognition.scans.rivals import contradicting, rivaled, shift
from simplexmesh.recognition.scans.scan_pairs import Scan


@dataclass(frozen=True, eq=False, repr=False)
class ScanPair:
    """Two scans of a set that overlap, or seemed to; made by `register_all`.

    Attributes
    ----------
    source, target : int
        The places of the scans in the list.
    T_target_source : (4, 4) array of float
        The pose of the source on the target as these two scans alone have it.
    error : float
        Root mean square distance between the two, where they overlap, in the data's unit.
    overlap : float
        Fraction of the smaller scan near the other.
    accepted : bool
        Whether it is measured from the poses of all scans. Otherwise it is a pose in which the two fit alone and that
        contradicts these, on which it has no influence.
    ambiguous : bool
        Whether the pose is one of several that fit as well, and no other scan tells which: what the two have in common
        is symmetric.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 20).vertices
    >>> egg = egg + 0.1 * egg**2
    >>> sm.register_all([egg[egg[:, 0] < 1], egg[egg[:, 0] > -1]]).edges[0].accepted
    True
    """

    source: int
    target: int
    T_target_source: Array
    error: float
    overlap: float
    accepted: bool
    ambiguous: bool

    def __repr__(self) -> str:
        said = ("" if self.accepted else ", rejected") + (", ambiguous" if self.ambiguous else "")
        return f"ScanPair({self.source} on {self.target}, overlap {self.overlap:.0%}, error {self.error:.3g}{said})"


@dataclass(frozen=True, eq=False, repr=False)
class Registered:
    """The poses of several scans; made by `register_all`.

    Attributes
    ----------
    poses : (n, 4, 4) array of float
        T_world_scan of each scan; the world of a group is the frame of its first scan. `reconstruct` takes them.
    groups : tuple of tuple of int
        Scans that hang together, the largest group first. Between groups poses mean nothing.
    edges : tuple of ScanPair
        The pairs of scans that overlap, and after these poses of pairs alone that contradict those of all, not
        `accepted`.
    residuals : (e,) array of float
        How far the poses move each pair from where it fits best, root mean square over the source, in the data's unit.
    covariance : (n, 6, 6) array of float
        Of a small motion after each pose: a rotation vector in radians about the world's origin, and a shift, by
        what pairs tell, before all poses are refined together. Zero for the first scan of a group.
    flipped : tuple of int
        Scans whose own normals point the other way than those of most of their group that have any.
    names : tuple of str
        What messages call the scans: names of files, or places in the list.
    doubtful : tuple of int
        Scans that fit the others about as well in another pose, as those of nearly symmetric objects do, so that the
        poses may be wrong.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 20).vertices
    >>> egg = egg + 0.1 * egg**2
    >>> found = sm.register_all([egg[egg[:, 0] < 1], egg[egg[:, 0] > -1] + [5, 0, 0]])
    >>> found
    Registered(2 scans in 1 group, 2 edges)
    >>> bool(np.allclose(found.poses[1, :3, 3], [-5, 0, 0], atol=0.02))
    True
    """

    poses: Array
    groups: tuple[tuple[int, ...], ...]
    edges: tuple[ScanPair, ...]
    residuals: Array
    covariance: Array
    flipped: tuple[int, ...]
    names: tuple[str, ...]
    doubtful: tuple[int, ...]
    _points: tuple[Array, ...] = ()  # of each scan, which a notebook shows

    @property
    def alone(self) -> tuple[int, ...]:
        """The scans that fit nowhere; their poses mean nothing."""
        return tuple(group[0] for group in self.groups if len(group) == 1)

    def _repr_html_(self) -> str:
        """Return a picture of the largest group and a table of what hangs together, as notebooks show."""
        accepted = [edge.accepted for edge in self.edges]
        residuals = self.residuals[accepted]
        rows = {
            "scans": f"{len(self.names)}",
            "groups": ", ".join(f"{len(group)} scans" if len(group) > 1 else "1 alone" for group in self.groups),
            "pairs": f"{len(residuals)} agree, {len(self.edges) - len(residuals)} contradict",
            "largest residual": f"{residuals.max():.3g}" if len(residuals) else "none",
            "doubtful": ", ".join(self.names[k] for k in self.doubtful) or "none",
        }
        shown = (PointCloud(self._points[k]).transformed(self.poses[k]) for k in self.groups[0] if self._points)
        return card("Registered", rows, *shown)

    def __repr__(self) -> str:
        groups = f"{len(self.groups)} group{'s' if len(self.groups) > 1 else ''}"
        alone = f", {', '.join(self.names[k] for k in self.alone)} alone" if self.alone else ""
        return f"Registered({len(self.names)} scans in {groups}, {len(self.edges)} edges{alone})"


def register_all(scans: Sequence[Any], *, progress: bool | Progress = False) -> Registered:
    """Find the poses of several scans of one object, in any order, without an initial guess.

    Pairs are registered as by `register` until all scans hang together. A pair joins two groups only if all their scans
    that come to touch agree. Then all pairs that overlap are measured from the poses found, and all poses are computed
    together, each pair with the weight of its covariance, those that contradict the others with little: errors do not
    add up along a chain of scans. In the end all poses are refined on the surface that the scans have in common.

    Parameters
    ----------
    scans : sequence of SimplexMesh, TriangleMesh, PointCloud, array, pyvista or trimesh object, or path
        At least two, in one unit. Missing normals are estimated.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    Registered

    Raises
    ------
    ValueError, TypeError, OSError
        Fewer than two scans, data that is missing, fewer than 50 points, two units.

    Warns
    -----
    SimplexMeshWarning
        Scans fit nowhere, or form several groups; normals of scans are opposite to those of the others; scans fit about
        as well in another pose.

    References
    ----------
    F. Lu, E. Milios, *Globally consistent range scan alignment for environment mapping*, Autonomous Robots 4, 1997,
    333-349 (poses from pairs); Z. Liu, F. Zhang, *BALM: bundle adjustment for lidar mapping*, IEEE Robotics and
    Automation Letters 6, 2021, 3184-3191 (planes of all scans); H. Delingette, thesis, 1994, section 6.3.3
    (points to planes).

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 20).vertices
    >>> egg = egg + 0.1 * egg**2
    >>> parts = [egg[egg[:, 0] < 1], egg[egg[:, 0] > -1], egg[egg[:, 1] < 1] @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]]
    >>> found = sm.register_all(parts)
    >>> found.groups
    ((0, 1, 2),)
    >>> np.abs(found.poses[2, :3, :3].round(1))
    array([[0., 1., 0.],
           [1., 0., 0.],
           [0., 0., 1.]])
    """
    if not isinstance(scans, list | tuple):
        raise TypeError(f"scans must be a list of scans, not {type(scans).__name__}")
    if len(scans) < 2:
        raise ValueError(f"scans must be at least 2, not {len(scans)}")
    read = [scan if isinstance(scan, list | tuple) else as_given(scan, f"scans[{k}]") for k, scan in enumerate(scans)]
    for k, scan in enumerate(read):
        if isinstance(scan, Volume):
            raise TypeError(f"scans[{k}] must be points or a surface, not a {checks.type_name(scan)}")
    with reporting(progress, "registering") as report:
        report(0.0, "reading")
        return registered_named(read, names_of(scans), report)


def registered_named(scans: Sequence[Any], names: tuple[str, ...], report: Progress) -> Registered:
    """Return the poses of scans, with warnings that call them by these names."""
    found = registered(Scan.all_of(list(scans), names), names, report)
    report(1.0, "done")
    tell_groups(found)
    return found


def tell_groups(found: Registered) -> None:
    """Warn of scans that fit nowhere, groups that do not fit each other, opposite normals and doubtful poses."""
    alone = ", ".join(found.names[k] for k in found.alone)
    groups = [", ".join(found.names[k] for k in group) for group in found.groups if len(group) > 1]
    if len(groups) > 1:
        warn(f"the scans form {len(groups)} groups that do not fit each other: {'; '.join(groups)}")
    if alone:
        warn(f"scans that fit none of the others have no pose among them: {alone}")
    if found.flipped:
        flipped = ", ".join(found.names[k] for k in found.flipped)
        warn(f"normals that are opposite to those of the other scans were turned over: {flipped}")
    if found.doubtful:
        doubtful = ", ".join(found.names[k] for k in found.doubtful)
        warn(f"poses may be wrong, as scans fit the others about as well in other ones: {doubtful}")


def names_of(scans: Sequence[Any]) -> tuple[str, ...]:
    """Return what messages call the scans: files of one name in several folders by their paths."""
    short = [Path(scan).name if isinstance(scan, str | os.PathLike) else f"scans[{k}]" for k, scan in enumerate(scans)]
    return tuple(name if short.count(name) == 1 else str(scan) for name, scan in zip(short, scans, strict=True))


def registered(scans: list[Scan], names: tuple[str, ...], report: Progress) -> Registered:
    """Return the poses of prepared scans, in the frames and unit of the data."""
    assembly = Assembly.of(scans)
    assembly.assemble(lambda fraction: report(0.1 + 0.6 * fraction, "registering pairs"))
    poses, covariances = np.empty((len(scans), 4, 4)), np.empty((len(scans), 6, 6))
    for group in assembly.groups:
        for k in group:
            poses[k] = between_frames(assembly.poses[k], scans[k].center, scans[group[0]].center, scans[0].unit)
            A = about_origin(scans[group[0]].center) @ np.diag([1.0] * 3 + [scans[0].unit] * 3)
            covariances[k] = A @ assembly.covariances[k] @ A.T
    rejected = contradicting(assembly)
    edges, residuals = _edges(assembly, rejected)
    doubtful = rivaled(assembly, [found for found, _ in rejected])
    groups = sorted(map(tuple, assembly.groups), key=lambda group: (-len(group), group))
    flipped = tuple(k for k, scan in enumerate(scans) if scan.turned and scan.surface.given)
    points = tuple(checks.frozen(scan.center + scan.unit * scan.matched[0].points) for scan in assembly.scans)
    return Registered(
        checks.frozen(poses), tuple(groups), edges, checks.frozen(residuals), checks.frozen(covariances), flipped,
        names, doubtful, points,
    )  # fmt: skip


def _edges(assembly: Assembly, rejected: list[tuple[Hypothesis, float]]) -> tuple[tuple[ScanPair, ...], Array]:
    """Return the pairs measured, and poses found for pairs alone that contradict, with their residuals (e,)."""
    scans, edges, residuals = assembly.scans, [], []
    for (i, j), each in assembly.measured.items():
        edges.append(((i, j), each.T, each.error, each.near, True, (i, j) in assembly.ambiguous))
        residuals.append(shift(scans[i], each.T, assembly.relative(i, j)))
    for found, off in rejected:
        edges.append((found.pair, found.T, found.found.error, found.near, False, False))
        residuals.append(off)
    unit = scans[0].unit
    pairs = []
    for (i, j), T, error, near, accepted, ambiguous in edges:
        pose = checks.frozen(between_frames(T, scans[i].center, scans[j].center, unit))
        pairs.append(ScanPair(i, j, pose, error * unit, near, accepted, ambiguous))
    return tuple(pairs), unit * np.array(residuals)
