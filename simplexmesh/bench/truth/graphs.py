"""Test surfaces z = f(x, y) of the literature (Hamann 1993; Charton 2012, 2014), with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.bench.truth.exact import Exact, of_level_set, paired

Jet = Callable[[Array, Array], tuple[Array, ...]]
"""Function of x, y that returns f, f_x, f_y, f_xx, f_xy, f_yy."""


@dataclass(frozen=True)
class Graph:
    """A surface z = f(x, y) over the square from -1 to 1, with the outside above."""

    name: str
    formula: str
    jet: Jet

    def points(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the (n, 3) points above (x, y)."""
        u, v = paired(x, y)
        return np.stack([u, v, self.jet(u, v)[0]], axis=1)

    def exact(self, x: ArrayLike = 0.0, y: ArrayLike = 0.0) -> Exact:
        """Return the exact values above (x, y), with upward normals."""
        u, v = paired(x, y)
        _, fx, fy, fxx, fxy, fyy = self.jet(u, v)
        gradients = np.stack([-fx, -fy, np.ones_like(u)], axis=1)
        hessians = np.zeros((len(u), 3, 3))
        hessians[:, 0, 0], hessians[:, 1, 1] = -fxx, -fyy
        hessians[:, 0, 1] = hessians[:, 1, 0] = -fxy
        return of_level_set(gradients, hessians)


def _polynomial(terms: dict[tuple[int, int], float]) -> Jet:
    """Return the jet of the sum of c x^i y^j, with c by (i, j)."""

    def derived(x: Array, y: Array, p: int, q: int) -> Array:
        """Return the derivative p times by x and q times by y, each at most 2."""
        out = np.zeros(np.broadcast(x, y).shape)
        for (i, j), c in terms.items():
            if i >= p and j >= q:
                factor = (1, i, i * (i - 1))[p] * (1, j, j * (j - 1))[q]
                out += c * factor * x ** (i - p) * y ** (j - q)
        return out

    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    return lambda x, y: tuple(derived(x, y, p, q) for p, q in orders)


def _of(outer: Callable[[Array], tuple[Array, Array, Array]], terms: dict[tuple[int, int], float]) -> Jet:
    """Return the jet of g(polynomial), with `outer` that returns g and its first two derivatives."""
    inner = _polynomial(terms)

    def jet(x: Array, y: Array) -> tuple[Array, ...]:
        q, qx, qy, qxx, qxy, qyy = inner(x, y)
        g, first, second = outer(q)
        seconds = ((qx, qx, qxx), (qx, qy, qxy), (qy, qy, qyy))
        return g, first * qx, first * qy, *(second * a * b + first * ab for a, b, ab in seconds)

    return jet


def _root(scale: float, terms: dict[tuple[int, int], float]) -> Jet:
    return _of(lambda q: (scale * np.sqrt(q), 0.5 * scale / np.sqrt(q), -0.25 * scale / np.sqrt(q) ** 3), terms)


def _exponential(terms: dict[tuple[int, int], float]) -> Jet:
    return _of(lambda q: (np.exp(q),) * 3, terms)


def cosines(size: float, u: ArrayLike, v: ArrayLike, phases: ArrayLike) -> Jet:
    """Return the jet of the sum of size cos(u x + v y + phase) over the arrays u, v and phases."""
    u, v, phases = (np.asarray(part, float) for part in (u, v, phases))

    def jet(x: Array, y: Array) -> tuple[Array, ...]:
        angles = np.multiply.outer(x, u) + np.multiply.outer(y, v) + phases
        even, odd = size * np.cos(angles), -size * np.sin(angles)
        return even.sum(axis=-1), odd @ u, odd @ v, -even @ (u * u), -even @ (u * v), -even @ (v * v)

    return jet


def _named(*graphs: Graph) -> dict[str, Graph]:
    return {one.name: one for one in graphs}


_CUBIC = {(3, 0): 0.15, (2, 1): 0.3, (1, 1): -0.15}

ARTICLE = _named(
    Graph("plane", "0.2 (x + y)", _polynomial({(1, 0): 0.2, (0, 1): 0.2})),
    Graph("paraboloid", "0.4 (x^2 + y^2)", _polynomial({(2, 0): 0.4, (0, 2): 0.4})),
    Graph("cubic", "0.15 (x^3 + 2 x^2 y - x y + 2 y^2)", _polynomial(_CUBIC | {(0, 2): 0.3})),
    Graph("exponential", "exp(-(x^2 + y^2) / 2)", _exponential({(2, 0): -0.5, (0, 2): -0.5})),
    Graph("trigonometric", "0.1 (cos pi x + cos pi y)", cosines(0.1, [np.pi, 0], [0, np.pi], [0, 0])),
    Graph("cylinder", "sqrt(2 - x^2)", _root(1.0, {(0, 0): 2, (2, 0): -1})),
    Graph("sphere", "sqrt(4 - x^2 - y^2)", _root(1.0, {(0, 0): 4, (2, 0): -1, (0, 2): -1})),
    Graph("elliptic_paraboloid", "2 x^2 + y^2", _polynomial({(2, 0): 2, (0, 2): 1})),
    Graph("hyperboloid", "0.4 (x^2 - y^2)", _polynomial({(2, 0): 0.4, (0, 2): -0.4})),
    Graph("monkey_saddle", "0.2 (x^3 - 3 x y^2)", _polynomial({(3, 0): 0.2, (1, 2): -0.6})),
    Graph("ellipsoid", "sqrt(1 - x^2/3 - y^2/2) / 4", _root(0.25, {(0, 0): 1, (2, 0): -1 / 3, (0, 2): -0.5})),
)
"""As printed in the article of 2012, with the two surfaces that only the thesis has; the thesis's results are those of
these formulas."""

THESIS = {name: one for name, one in ARTICLE.items() if name not in ("plane", "paraboloid")} | _named(
    Graph("cubic", "0.15 (x^3 + 2 x^2 y - x y + 2 y)", _polynomial(_CUBIC | {(0, 1): 0.3})),
    Graph("exponential", "exp(2 x + y^2 - y)", _exponential({(1, 0): 2, (0, 2): 1, (0, 1): -1})),
    Graph("trigonometric", "0.1 (cos pi x + sin pi y)", cosines(0.1, [np.pi, 0], [0, np.pi], [0, -np.pi / 2])),
)
"""As printed in the thesis of 2014; three differ, most likely by misprints."""

PRINTINGS = {"article": ARTICLE, "thesis": THESIS}


def graph(name: str, printing: str = "article") -> Graph:
    """Return a test surface by name, as printed in the "article" or the "thesis"; that has no plane or paraboloid."""
    known = PRINTINGS[checks.choice("printing", printing, sorted(PRINTINGS))]
    return known[checks.choice("name", name, sorted(known))]
