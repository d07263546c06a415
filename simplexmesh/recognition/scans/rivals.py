"""Poses of pairs that contradict those of all scans, and scans that fit the others about as well in one of them."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.recognition.scans.assembly import Assembly, Hypothesis
from simplexmesh.recognition.scans.scan_pairs import Scan, contact

CONTRADICTING = 10.0
"""Shift, in root mean square distances of pairs, from which the pose of a pair alone contradicts the others."""

AS_WELL, MOST = 0.9, 8
"""Support of another pose of a scan, relative to that of the pose found, from which this may be wrong; poses tried."""


def contradicting(assembly: Assembly) -> list[tuple[Hypothesis, float]]:
    """Return the poses of pairs of one group that contradict those of all, and how far off they are."""
    typical = float(np.median([each.error for each in assembly.measured.values()] or [0.0]))
    out = []
    for found in assembly.hypotheses:
        i, j = found.pair
        if assembly.group_of(i) is assembly.group_of(j):
            off = shift(assembly.scans[i], found.T, assembly.relative(i, j))
            if off > CONTRADICTING * typical:
                out.append((found, off))
    return out


def rivaled(assembly: Assembly, others: list[Hypothesis]) -> tuple[int, ...]:
    """Return the scans of ambiguous pairs, and those that fit their group about as well in one of other poses."""
    ambiguous = {k for pair in assembly.ambiguous for k in pair}
    rivals = [[found for found in others if k in found.pair] for k in range(len(assembly.scans))]
    return tuple(k for k, its in enumerate(rivals) if k in ambiguous or _is_rivaled(assembly, k, its))


def _is_rivaled(assembly: Assembly, scan: int, others: list[Hypothesis]) -> bool:
    """Whether one of the likeliest of other poses of a scan is supported about as well as its own."""
    likeliest = sorted(others, key=lambda found: -found.found.score * found.near)[:MOST]
    least = AS_WELL * _support(assembly, scan, assembly.poses[scan]) if likeliest else 0.0
    return any(_support(assembly, scan, _pose(assembly, scan, found)) > least for found in likeliest)


def _pose(assembly: Assembly, scan: int, found: Hypothesis) -> Array:
    """Return the pose (4, 4) in its group that a pose of one of its pairs gives a scan."""
    i, j = found.pair
    return assembly.poses[j] @ found.T if scan == i else assembly.poses[i] @ np.linalg.inv(found.T)


def _support(assembly: Assembly, scan: int, pose: Array) -> float:
    """Return how many points of a scan in a pose (4, 4), and of others near it, agree less those that do not."""
    total = 0.0
    for k in assembly.group_of(scan):
        if k != scan:
            T = np.asarray(np.linalg.solve(assembly.poses[k], pose))
            near, agreement = contact(assembly.scans[scan], assembly.scans[k], T)
            total += near * (2 * agreement - 1)
    return total


def shift(scan: Scan, one: Array, other: Array) -> float:
    """Return the root mean square distance between the points of a scan in two poses (4, 4)."""
    difference = (one - other)[:3]
    return float(np.sqrt((norm(scan.matched[0].points @ difference[:, :3].T + difference[:, 3]) ** 2).mean()))
