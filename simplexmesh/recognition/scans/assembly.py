"""Scans put together, group by group: pairs are registered until all scans hang together or nothing is left to try."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations, permutations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.recognition.register.verify import SAME_SCORE, Evaluation
from simplexmesh.recognition.scans.adjustment import adjusted
from simplexmesh.recognition.scans.pose_graph import optimized
from simplexmesh.recognition.scans.scan_pairs import Measured, Pair, Scan, contact, measure, search, verifier_of

CERTAIN, POSSIBLE = 0.4, 0.3
"""Scores from which a pair is believed by itself, and from which it may be where nothing better is known.

In 537 pairs of views of nine bodies, wrong poses without rivals score at most 0.29; of poses whose surfaces agree, 46
of 51 that score 0.3 to 0.4 are right, and 40 of 187 that score less. Of a block of plane faces wrong ones reach 0.6.
"""

RIVAL = 0.7
"""Scores of other poses of a pair, relative to the best one's, from which the pair alone does not tell its pose."""

AGREEING = 0.8
"""Share of the points near another scan that must lie on it: of the bunny's wrong pairs, refined, at most 0.65 do, of
the right ones 0.9 and more."""

TOUCHING = 0.04
"""Fraction of the smaller of two scans that must be near the other for the two to be measured against each other."""

CONTRADICTING = 0.65
"""Share below which two scans that touch speak against joining their groups."""

MOST_CLOSURES = 6
"""Pairs of scans of two groups that decide whether these are joined: those that come nearest."""

CLOSING, CLOSE = (8.0, 4.0, 2.0, 1.0), (2.0, 1.0)
"""Reaches of the refinement that closes a chain of scans, whose errors add up; and of one between known poses."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A pose of one scan on another, found without a guess."""

    pair: Pair
    found: Evaluation
    near: float  # fraction of the smaller scan near the other
    certain: bool
    opposite: bool  # whether the normals of one scan are to be turned over, from how they were given

    @property
    def T(self) -> Array:
        """The pose (4, 4)."""
        return self.found.T


@dataclass(eq=False)
class Assembly:
    """Scans with poses (n, 4, 4) in groups, each in the frame of its first; `ambiguous` pairs have several poses."""

    scans: list[Scan]
    poses: Array
    groups: list[list[int]]
    covariances: Array
    measured: dict[Pair, Measured] = field(default_factory=dict)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    ambiguous: set[Pair] = field(default_factory=set)

    @staticmethod
    def of(scans: list[Scan]) -> Assembly:
        """Return scans that are all alone."""
        count = len(scans)
        alone = [[k] for k in range(count)]
        poses, covariances = np.tile(np.eye(4), (count, 1, 1)), np.zeros((count, 6, 6))
        return Assembly(scans, poses, alone, covariances)

    def assemble(self, report: Callable[[float], None]) -> None:
        """Register pairs, neighbors first and then with normals turned, and join what fits; refine all poses."""
        pairs = len(self.scans) * (len(self.scans) - 1) // 2
        for opposite in (False, True):
            for tried, pair in enumerate(self._untried()):
                if opposite and not any(self.scans[k].surface.given for k in pair):
                    continue
                report((tried / pairs + opposite) / 2)
                for found in self._searched(pair, opposite=opposite):
                    if found.certain:
                        self._join(found)
            while any(self._join(found, equal=equal) for found, equal in self._supported()):
                pass
        for group in self.groups:
            turned = [self.scans[k].turned for k in group if self.scans[k].surface.given]
            if 2 * sum(turned) > len(turned):
                self._flip(group)
        for both in (False, True):  # the last time in both directions
            for group in self.groups:
                self._measure(permutations(group, 2) if both else combinations(group, 2))
                self._settle(group)
        for group in (each for each in self.groups if len(each) > 1):
            self.poses[group] = adjusted([self.scans[k].matched[0] for k in group], self.poses[group])

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

    def _searched(self, pair: Pair, *, opposite: bool) -> list[Hypothesis]:
        """Return the best pose of a pair, and its rivals, those whose surfaces agree; of opposite normals if wanted."""
        source, target = self.scans[pair[0]], self.scans[pair[1]]
        source = source.flipped if opposite else source
        found = search(source, target)
        rivals = [each for each in found if each.score > max(POSSIBLE, RIVAL * found[0].score)]
        opposite = source.turned != target.turned
        out = []
        for each in rivals:
            near, agreement = contact(source, target, each.T)
            if near > TOUCHING and agreement > AGREEING:
                certain = each is found[0] and len(rivals) == 1 and each.score > CERTAIN
                out.append(Hypothesis(pair, each, near, certain, opposite))
        self.hypotheses += out
        return out

    def _supported(self) -> list[tuple[Hypothesis, bool]]:
        """Return poses between groups, by support after those that have no equal, and whether they have one."""
        open_ones = [each for each in self.hypotheses if self.group_of(each.pair[0]) is not self.group_of(each.pair[1])]
        support = [self._support(each) for each in open_ones]
        out = []
        for one, most in zip(open_ones, support, strict=True):
            equal = any(
                other is not one and other.pair == one.pair and other.opposite == one.opposite
                and its > (1 - SAME_SCORE) * most and other.found.is_equivalent(one.found)
                for other, its in zip(open_ones, support, strict=True)
            )  # fmt: skip
            out.append((equal, -most, one))
        return [(one, equal) for equal, _, one in sorted(out, key=lambda each: each[:2])]

    def _face(self, found: Hypothesis) -> None:
        """Turn over the normals of one of the two groups if a pose between them needs that."""
        i, j = found.pair
        if found.opposite != (self.scans[i].turned != self.scans[j].turned):
            self._flip(self.group_of(i))

    def _flip(self, group: list[int]) -> None:
        """Turn over the normals of the scans of a group."""
        for k in group:
            self.scans[k] = self.scans[k].flipped

    def _support(self, found: Hypothesis) -> float:
        """Return how many points of all scans of two groups agree less those that do not, in a pose between them."""
        self._face(found)
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

    def _join(self, found: Hypothesis, *, equal: bool = False) -> bool:
        """Join the two groups of a pair, unless they are one or most of what comes to touch does not agree."""
        source, target = map(self.group_of, found.pair)
        if source is target:
            return False
        self._face(found)
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
        if equal or all(slides(self.scans[i], self.scans[j], each.T) for (i, j), each in agreeing.items()):
            self.ambiguous |= {found.pair, found.pair[::-1]}
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


def slides(source: Scan, target: Scan, T: Array) -> bool:
    """Whether two scans fit as well after small motions of one along the other, as surfaces of revolution do."""
    return len(verifier_of(source, target).open_motions(T)) > 0


def is_sound(found: Measured) -> bool:
    """Whether two scans touch in a measured pose, agree there, and determine a pose at all."""
    return found.near > TOUCHING and found.agreement > AGREEING and bool(np.isfinite(found.covariance).all())
