"""Neighborhoods of vertices: rings, balls, nearest points (Charton 2014, def. 1.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices, Mask
from simplexmesh._base.checks import flag


class Rows(NamedTuple):
    """Neighbors as kernels take them: those of row r are `members[offsets[r] : offsets[r + 1]]`, closed if a cycle."""

    offsets: Indices
    members: Indices
    closed: Mask


@dataclass(frozen=True)
class Rings:
    """All vertices within `count` edges; made by `rings`."""

    count: int


@dataclass(frozen=True)
class Ball:
    """All vertices at a distance between `inner` and `radius`; made by `ball`."""

    radius: float
    connected: bool = True
    inner: float = 0.0


@dataclass(frozen=True)
class Nearest:
    """The `count` nearest vertices; made by `nearest`."""

    count: int


@dataclass(frozen=True, eq=False, repr=False)
class Neighborhoods:
    """The neighbors of each center, in CSR form.

    Parameters
    ----------
    centers : (c,) array of int
        Indices of the points whose neighborhoods these are.
    offsets : (c + 1,) array of int
        The neighbors of row r are `members[offsets[r] : offsets[r + 1]]`.
    members : (m,) array of int
        Point indices; never the center itself.
    closed : (c,) array of bool
        Whether the neighbors are the cycle around an inner vertex, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        Offsets that do not rise from 0 to the number of members, inconsistent lengths, negative indices.
    TypeError
        Arrays that are not of integers.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.surface.sampled_surface import as_sampled_surface
    >>> around = as_sampled_surface(sm.sphere(4).triangulated("dual")).around(sm.rings(1))
    >>> int(around.valence.min()), int(around.valence.max()), bool(around.closed.all())
    (5, 6, True)
    """

    centers: Indices
    offsets: Indices
    members: Indices
    closed: Mask

    def __post_init__(self) -> None:
        for name in ("centers", "offsets", "members", "closed"):
            given, kind = checks.any_array(name, getattr(self, name)), np.bool_ if name == "closed" else np.int64
            rows = checks.array(name, given if given.size else given.astype(kind), (None,), kind)
            object.__setattr__(self, name, checks.frozen(rows))
        n = len(self.centers)
        if len(self.offsets) != n + 1 or len(self.closed) != n:
            raise ValueError(f"offsets and closed must have {n + 1} and {n} entries for {n} centers")
        if self.offsets[0] != 0 or self.offsets[-1] != len(self.members) or (np.diff(self.offsets) < 0).any():
            raise ValueError(f"offsets must rise from 0 to the number of members, {len(self.members)}")
        if len(self.members) and np.min(self.members) < 0:
            raise ValueError(f"members must be point indices, not {np.min(self.members)}")
        if n and np.min(self.centers) < 0:
            raise ValueError(f"centers must be point indices, not {np.min(self.centers)}")

    def __repr__(self) -> str:
        return f"Neighborhoods({len(self)} centers, {self.members.size} neighbors)"

    def __len__(self) -> int:
        return len(self.centers)

    def __getitem__(self, row: int) -> Indices:
        return self.members[self.offsets[row] : self.offsets[row + 1]]

    @property
    def valence(self) -> Indices:
        """(c,) array of int: number of neighbors of each center."""
        return np.diff(self.offsets)

    @property
    def _rows(self) -> Rows:
        """The neighbors as kernels take them."""
        return Rows(self.offsets, self.members, self.closed)

    def taken(self, at: ArrayLike) -> Neighborhoods:
        """Return those of some rows, in the given order.

        Parameters
        ----------
        at : (c,) array of int or (n,) array of bool
            The rows.

        Examples
        --------
        >>> around = Neighborhoods.of([[1, 2, -1], [0, 2, -1], [0, 1, -1]])
        >>> around.taken([2]).members
        array([0, 1])
        """
        chosen = checks.selection("at", at, len(self))
        counts = self.valence[chosen]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        members = self.members[np.arange(offsets[-1]) + np.repeat(self.offsets[chosen] - offsets[:-1], counts)]
        return Neighborhoods(self.centers[chosen], offsets, members, self.closed[chosen])

    @classmethod
    def of(cls, neighbors: ArrayLike, *, closed: bool = False) -> Neighborhoods:
        """Return neighborhoods of all points from an (n, k) array of neighbors; negative entries are ignored.

        Parameters
        ----------
        neighbors : (n, k) array of int
            Point indices.
        closed : bool
            Whether the rows are cycles, counter-clockwise seen from outside.

        Examples
        --------
        >>> Neighborhoods.of([[1, 2, -1], [0, 2, -1], [0, 1, -1]])
        Neighborhoods(3 centers, 6 neighbors)
        """
        rows = np.asarray(neighbors)
        if rows.ndim != 2 or rows.dtype.kind not in "iu":
            raise TypeError(f"neighborhood must be a (n, k) array of point indices, not {rows.dtype} of {rows.shape}")
        n = len(rows)
        if rows.size and rows.max() >= n:
            raise ValueError(f"neighborhood must name points below {n:,}, not {rows.max():,}")
        kept = (rows >= 0) & (rows != np.arange(n)[:, None])
        offsets = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return cls(np.arange(n), offsets, rows[kept], np.full(n, closed))


Neighborhood = Rings | Ball | Nearest | Neighborhoods


def rings(count: int = 1) -> Rings:
    """Select all vertices within `count` edges: 6 for 1, the one-ring, on a regular mesh, 18 for 2.

    Raises
    ------
    ValueError
        Fewer than one ring.

    Examples
    --------
    >>> rings(2)
    Rings(count=2)
    """
    return Rings(checks.integer("rings", count, 1))


def ball(radius: float, *, inner: float = 0.0, connected: bool = True) -> Ball:
    """Select all vertices within a distance, or in a shell, in the data's unit.

    Parameters
    ----------
    radius : float
        Radius of the ball, positive.
    inner : float
        Inner radius of a shell: vertices nearer than this are left out.
    connected : bool
        Take only vertices connected to the center by edges inside the ball, which excludes the other side of a thin
        wall. Ignored for clouds, which have no edges.

    Raises
    ------
    ValueError
        A radius that is not positive, or an inner one below zero or above it.
    TypeError
        Not a number, or `connected` neither true nor false.

    Examples
    --------
    >>> ball(0.5)
    Ball(radius=0.5, connected=True, inner=0.0)
    """
    radius = checks.number("radius", radius, 0.0, open_low=True)
    return Ball(radius, flag("connected", connected), checks.number("inner", inner, 0.0, radius))


def nearest(count: int) -> Nearest:
    """Select the `count` nearest points, by Euclidean distance.

    Raises
    ------
    ValueError
        Fewer than one.

    Examples
    --------
    >>> nearest(12)
    Nearest(count=12)
    """
    return Nearest(checks.integer("nearest", count, 1))
