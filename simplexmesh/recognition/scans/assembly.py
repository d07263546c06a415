"""Scans put together, group by group: pairs are registered until all scans hang together or nothing is left to try."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition.scans.pose_graph import optimized
from simplexmesh.recognition.scans.scan_pairs import Measured, Scan, contact, measure, search

Array = NDArray[np.float64]
Pair = tuple[int, int]

CERTAIN, POSSIBLE = 0.4, 0.1
"""Scores from which a pair is believed by itself, and from which it may be where nothing better is known."""

RIVAL = 0.7
"""Scores of other poses of a pair, relative to the best one's, from which the pair alone does not tell its pose."""

AGREEING = 0.8
"""Share of the points near another scan that must lie on it: of the bunny's wrong pairs, refined, at most 0.65 do, of
the right ones 0.9 and more."""

TOUCHING = 0.04
"""Fraction of a scan that must be near another for the two to be measured against each other."""

CONTRADICTING = 0.65
"""Share below which two scans that touch speak against joining their groups."""

MOST_CLOSURES = 6
"""Pairs of scans of two groups that decide whether these are joined: those that come nearest."""

CLOSING, CLOSE = (8.0, 4.0, 2.0, 1.0), (2.0, 1.0)
"""Reaches of the refinement that closes a chain of scans, whose errors add up; and of one between known poses."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A pose (4, 4) of one scan on another, found without a guess."""

    pair: Pair
    T: Array
    score: float
    near: float  # fraction of the source near the target
    certain: bool


@dataclass(eq=False)
class Assembly:
    """Scans with poses (n, 4, 4) in groups; each group has the frame of its first scan."""

    scans: list[Scan]
    poses: Array
    groups: list[list[int]]
    covariances: Array
    measured: dict[Pair, Measured] = field(default_factory=dict)
    hypotheses: list[Hypothesis] = field(default_factory=list)

    @staticmethod
    def of(scans: list[Scan]) -> Assembly:
        """Return scans that are all alone."""
        count = len(scans)
        return Assembly(scans, np.tile(np.eye(4), (count, 1, 1)), [[k] for k in range(count)], np.zeros((count, 6, 6)))

    def assemble(self, report: Callable[[float], None]) -> None:
        """Register pairs, the next ones in the order given first, and join what fits; then refine all poses."""
        pairs = len(self.scans) * (len(self.scans) - 1) // 2
        for tried, pair in enumerate(self._untried()):
            report(tried / pairs)
            for found in self._searched(pair):
                if found.certain:
                    self._join(found)
        while any(self._join(found) for found in self._supported()):
            pass
        for both in (False, True):  # the last time in both directions
            for group in self.groups:
                self._measure(permutations(group, 2) if both else combinations(group, 2))
                self._settle(group)

    def relative(self, source: int, target: int) -> Array:
        """Return the pose (4, 4) of a scan on another of its group."""
        return np.asarray(np.linalg.solve(self.poses[target], self.poses[source]))

    def group_of(self, scan: int) -> list[int]:
        """Return the group of a scan."""
        return next(group for group in self.groups if scan in group)

    def _untried(self) -> Iterator[Pair]:
        """Yield pairs of scans in different groups, neighbors in the order given first, as long as there are any."""
        waiting = sorted(combinations(range(len(self.scans)), 2), key=lambda pair: pair[1] - pair[0])
        for pair in waiting:
            if self.group_of(pair[0]) is not self.group_of(pair[1]):
                yield pair

    def _searched(self, pair: Pair) -> list[Hypothesis]:
        """Return the best pose of a pair, and its rivals, those whose surfaces agree."""
        found = search(self.scans[pair[0]], self.scans[pair[1]])
        rivals = [each for each in found if each.score > max(POSSIBLE, RIVAL * found[0].score)]
        out = []
        for each in rivals:
            near, agreement = contact(self.scans[pair[0]], self.scans[pair[1]], each.T)
            if near > TOUCHING and agreement > AGREEING:
                certain = each is found[0] and len(rivals) == 1 and each.score > CERTAIN
                out.append(Hypothesis(pair, each.T, each.score, near, certain))
        self.hypotheses += out
        return out

    def _supported(self) -> list[Hypothesis]:
        """Return the poses between groups that are not yet joined, those that most points speak for first."""
        open_ones = [each for each in self.hypotheses if self.group_of(each.pair[0]) is not self.group_of(each.pair[1])]
        return sorted(open_ones, key=lambda each: -self._support(each))

    def _support(self, found: Hypothesis) -> float:
        """Return how many points of all scans of two groups agree less those that do not, in a pose between them."""
        total = 0.0
        for (i, j), T in self._across(found):
            near, agreement = contact(self.scans[i], self.scans[j], T, wider=2.0)
            total += near * (2 * agreement - 1)
        return total

    def _across(self, found: Hypothesis) -> Iterator[tuple[Pair, Array]]:
        """Yield the pairs of scans of two groups with the poses (4, 4) that a pose between the groups gives them."""
        source, target = found.pair
        joining = self.poses[target] @ found.T @ np.linalg.inv(self.poses[source])
        for i in self.group_of(source):
            for j in self.group_of(target):
                yield (i, j), np.linalg.solve(self.poses[j], joining @ self.poses[i])

    def _join(self, found: Hypothesis) -> bool:
        """Join the two groups of a pair, unless they are one or most of what comes to touch does not agree."""
        source, target = map(self.group_of, found.pair)
        if source is target:
            return False
        across = {pair: (self._near(pair, T), T) for pair, T in self._across(found)}
        touching = sorted((pair for pair in across if across[pair][0] > TOUCHING), key=lambda pair: -across[pair][0])
        closures = {
            pair: measure(self.scans[pair[0]], self.scans[pair[1]], across[pair][1], wider=CLOSING)
            for pair in {found.pair: None, **dict.fromkeys(touching[:MOST_CLOSURES])}
        }
        agreeing = {pair: each for pair, each in closures.items() if is_sound(each)}
        against = sum(
            each.near for each in closures.values() if each.near > TOUCHING and each.agreement < CONTRADICTING
        )
        if found.pair not in agreeing or sum(each.near for each in agreeing.values()) < against:
            return False
        joining = self.poses[found.pair[1]] @ found.T @ np.linalg.inv(self.poses[found.pair[0]])
        self.poses[source] = joining @ self.poses[source]
        self.measured |= agreeing
        joined = sorted(source + target)
        self.groups = sorted([each for each in self.groups if each not in (source, target)] + [joined])
        self._settle(joined)
        return True

    def _near(self, pair: Pair, T: Array) -> float:
        """Return the fraction of a scan that a pose (4, 4) with errors of a chain brings near another."""
        return contact(self.scans[pair[0]], self.scans[pair[1]], T, wider=CLOSE[0])[0]

    def _measure(self, pairs: Iterable[Pair]) -> None:
        """Measure pairs of scans that touch anew, from their poses; what was measured before stays if that fails."""
        for i, j in pairs:
            T = self.relative(i, j)
            if self._near((i, j), T) > TOUCHING:
                found = measure(self.scans[i], self.scans[j], T, wider=CLOSE)
                if is_sound(found):
                    self.measured[i, j] = found

    def _settle(self, group: list[int]) -> None:
        """Find the poses of a group that agree best with all of its measured pairs."""
        if len(group) == 1:
            return
        place = {scan: k for k, scan in enumerate(group)}
        pairs = [pair for pair in self.measured if pair[0] in place and pair[1] in place]
        first = np.linalg.inv(self.poses[group[0]])
        start = first @ self.poses[group]
        start[0] = np.eye(4)  # without the last bit of the product
        radius = float(np.median([self.scans[k].extent for k in group])) / 4
        poses, covariances = optimized(
            start, [(place[i], place[j]) for i, j in pairs], [self.measured[pair] for pair in pairs], radius
        )
        self.poses[group], self.covariances[group] = poses, covariances


def is_sound(found: Measured) -> bool:
    """Whether two scans touch in a measured pose, agree there, and determine a pose at all."""
    return found.near > TOUCHING and found.agreement > AGREEING and bool(np.isfinite(found.covariance).all())
