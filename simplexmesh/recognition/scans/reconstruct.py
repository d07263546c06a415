"""The public `reconstruct`: that of `motion`, which knows nothing of registration, with the poses of scans found."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import wraps
from itertools import combinations
from typing import Any, ParamSpec

import numpy as np
from scipy.sparse.csgraph import connected_components

from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Progress, part_of, reporting
from simplexmesh.data.conversion import as_data
from simplexmesh.data.points import PointCloud, cloud_of_vertices
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.reconstruct import pipeline
from simplexmesh.motion.reconstruct.conversion import are_scans, check_for_no_volume
from simplexmesh.motion.reconstruct.options import Options
from simplexmesh.motion.reconstruct.result import Reconstruction
from simplexmesh.numerics.rigid import rotation_angle
from simplexmesh.recognition.register.oriented_points import FEWEST_POINTS
from simplexmesh.recognition.scans.assembly import TOUCHING
from simplexmesh.recognition.scans.register_all import Registered, names_of, registered, registered_named, tell_groups
from simplexmesh.recognition.scans.scan_pairs import Pair, Scan, contact

P = ParamSpec("P")

ADJOINING, TRUSTED = 0.003, 0.7
"""Fraction of a scan near another from which the two are compared, a seam between parts; and the share of it that must
agree: of bodies in unrelated frames less than half does, and poses measured otherwise may be somewhat off."""

SHARE = 0.4
"""Part of the progress that finding poses takes."""


def _with_poses(fit: Callable[P, Reconstruction]) -> Callable[P, Reconstruction]:
    """Return `fit` with the poses of scans found where they are wanted or missing, and a warning if interrupted."""
    signature = inspect.signature(fit)

    def told(model: Reconstruction) -> Reconstruction:
        if model.interrupted:
            warn("interrupted: the model is its last complete state, not finished")
        return model

    @wraps(fit)
    def posed(*arguments: P.args, **options: P.kwargs) -> Reconstruction:
        given = signature.bind(*arguments, **options)
        given.apply_defaults()
        chosen = given.arguments
        if not needs_poses(chosen["data"], chosen["poses"]):
            return told(fit(*arguments, **options))
        check_choices(chosen)
        with reporting(chosen["progress"], "reconstructing") as report:
            chosen["data"], found = posed_scans(chosen["data"], chosen["poses"], part_of(report, 0.0, SHARE))
            chosen["poses"] = None if found is None else found.poses[list(found.groups[0])]
            chosen["progress"] = part_of(report, SHARE, 1.0)
            return told(fit(*given.args, **given.kwargs))

    posed.__module__ = __name__  # where it can be imported from, which pickling needs
    return posed


reconstruct = _with_poses(pipeline.reconstruct)


def needs_poses(data: Any, poses: Any) -> bool:
    """Whether poses of scans are to be found, or none are given and the frames are to be compared."""
    automatic = isinstance(poses, str) and poses == "auto"
    if automatic and not (are_scans(data) and len(data) > 1):
        raise ValueError("poses='auto' needs several scans, in a list")
    return automatic or (poses is None and are_scans(data) and len(data) > 1)


def check_choices(chosen: Mapping[str, Any]) -> None:
    """Check the options of a reconstruction from scans, before the long search for poses."""
    given = inspect.signature(pipeline.reconstruct).bind(**{"data": None, **chosen})
    given.apply_defaults()
    Options(**{each.name: given.arguments[each.name] for each in fields(Options) if each.init})
    check_for_no_volume("PointCloud", *(given.arguments[name] for name in ("level", "label", "inside")))


def posed_scans(data: Sequence[Any], poses: Any, report: Progress) -> tuple[list[Any], Registered | None]:
    """Return the scans that hang together and all poses, None where frames agree or cannot be compared."""
    names, scans = names_of(data), [as_data(scan) for scan in data]
    if poses == "auto":
        found = registered_named(scans, names, report)
    else:
        compared = _compared(scans, names, report)
        if compared is None:
            return scans, None
        found = compared
    group = list(found.groups[0])
    if len(group) == 1:
        raise ValueError(f"poses cannot be found: no two of the {len(scans)} scans fit each other")
    if len(found.groups[1:]) and len(found.groups[1]) > 1:
        warn(f"the model is of the first group only: {', '.join(names[k] for k in group)}")
    return [_turned_over(scans[k]) if k in found.flipped else scans[k] for k in group], found


def _turned_over(scan: Any) -> PointCloud:
    """Return the points of a scan with opposite normals."""
    cloud = scan if isinstance(scan, PointCloud) else cloud_of_vertices(scan)
    return cloud if cloud.normals is None else replace(cloud, normals=-cloud.normals)


def _compared(scans: list[Any], names: tuple[str, ...], report: Progress) -> Registered | None:
    """Return poses, with a warning, if scans in their own frames contradict each other and fit in others."""
    sizes = [len(scan.points if isinstance(scan, PointCloud) else scan.vertices) for scan in scans
             if isinstance(scan, PointCloud | TriangleMesh)]  # fmt: skip
    if len(sizes) < len(scans) or min(sizes) < FEWEST_POINTS:
        return None  # what is no scan is refused by `reconstruct`, and a few points tell no pose
    report(0.0, "comparing frames")
    prepared = Scan.all_of(scans, names)
    agreeing, contradicting = _contacts(prepared)
    if not contradicting:
        if not _hang_together(agreeing, len(scans)):
            warn("not all scans meet in their frames, which are kept; poses='auto' finds others")
        return None
    found = registered(prepared, names, report)
    turned = [edge for edge in found.edges if edge.accepted and (edge.source, edge.target) not in agreeing]
    moved = [edge for edge in turned if (edge.target, edge.source) not in agreeing]
    if moved:
        edge = max(moved, key=lambda edge: edge.overlap)
        angle = np.degrees(rotation_angle(edge.T_target_source))
        warn(
            f"the scans are in different frames: {names[edge.source]} fits {names[edge.target]} turned by "
            f"{angle:.0f} degrees; all were registered, as by poses='auto' "
            f"(poses=[np.eye(4)] * {len(scans)} keep the frames)"
        )
        tell_groups(found)
        return found
    for i, j in contradicting:
        if any({i, j} <= {*group} for group in found.groups):
            continue  # the others join them as their frames do: what meets is two sides of something thin
        warn(f"{names[i]} and {names[j]} contradict each other where they meet, and fit in no other pose: give poses")
    return None


def _contacts(scans: list[Scan]) -> tuple[set[Pair], list[Pair]]:
    """Return the pairs of scans that agree where they meet in their own frames, and those that do not."""
    agreeing, contradicting = set(), []
    for i, j in combinations(range(len(scans)), 2):
        T = np.eye(4)
        T[:3, 3] = (scans[i].center - scans[j].center) / scans[i].unit
        near, agreement = contact(scans[i], scans[j], T)
        if near > ADJOINING and agreement > TRUSTED:
            agreeing.add((i, j))
        elif near > TOUCHING:
            contradicting.append((i, j))
    return agreeing, contradicting


def _hang_together(pairs: set[Pair], count: int) -> bool:
    """Whether pairs join all of so many scans."""
    meeting = np.zeros((count, count), bool)
    for pair in pairs:
        meeting[pair] = True
    return int(connected_components(meeting, directed=False)[0]) == 1
