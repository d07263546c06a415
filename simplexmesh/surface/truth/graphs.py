"""Test surfaces z = f(x, y) of the literature (Hamann 1993; Charton 2012, 2014), and random ones; exact derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.truth.exact import Exact, of_level_set, paired

Array = NDArray[np.float64]
Jet = tuple[Array, Array, Array, Array, Array, Array]

WAVES = 600
"""Cosines of which a random surface is the sum."""


@dataclass(frozen=True)
class Graph:
    """A surface z = f(x, y) over the square from -1 to 1, with the outside above.

    Attributes
    ----------
    name : str
    formula : str
        Formula of f as text.
    jet : function
        Function of x, y that returns f, f_x, f_y, f_xx, f_xy, f_yy.

    Examples
    --------
    >>> surface = graph("sphere")
    >>> surface
    Graph(sphere: sqrt(4 - x^2 - y^2))
    >>> at = surface.exact(0.3, [0.0, 0.5])
    >>> at.mean.round(9), at.gauss.round(9)
    (array([0.5, 0.5]), array([0.25, 0.25]))
    """

    name: str
    formula: str
    jet: Callable[[Array, Array], Jet]

    def __repr__(self) -> str:
        return f"Graph({self.name}: {self.formula})"

    def points(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the (n, 3) points above (x, y)."""
        u, v = paired(x, y)
        return np.stack([u, v, self.jet(u, v)[0] + 0 * u], axis=1)

    def exact(self, x: ArrayLike = 0.0, y: ArrayLike = 0.0) -> Exact:
        """Return the exact values above (x, y), with upward normals."""
        u, v = paired(x, y)
        _, fx, fy, fxx, fxy, fyy = (part + 0 * u for part in self.jet(u, v))
        gradients = np.stack([-fx, -fy, np.ones_like(u)], axis=1)
        hessians = np.zeros((len(u), 3, 3))
        hessians[:, 0, 0], hessians[:, 1, 1] = -fxx, -fyy
        hessians[:, 0, 1] = hessians[:, 1, 0] = -fxy
        return of_level_set(gradients, hessians)


def _plane(x: Array, y: Array) -> Jet:
    zero = 0 * x
    return 0.2 * (x + y), zero + 0.2, zero + 0.2, zero, zero, zero


def _cylinder(x: Array, y: Array) -> Jet:
    s, zero = np.sqrt(2 - x**2), 0 * y
    return s, -x / s, zero, -2 / s**3, zero, zero


def _sphere(x: Array, y: Array) -> Jet:
    s = np.sqrt(4 - x**2 - y**2)
    return s, -x / s, -y / s, -(4 - y**2) / s**3, -x * y / s**3, -(4 - x**2) / s**3


def _quadratic(a: float, b: float) -> Callable[[Array, Array], Jet]:
    """Return the jet of a x^2 + b y^2."""

    def jet(x: Array, y: Array) -> Jet:
        zero = 0 * x
        return a * x**2 + b * y**2, 2 * a * x, 2 * b * y, zero + 2 * a, zero, zero + 2 * b

    return jet


def _ellipsoid(x: Array, y: Array) -> Jet:
    s = np.sqrt(1 - (x**2 / 3 + y**2 / 2))
    xx, yy = -1 / (3 * s) - x**2 / (9 * s**3), -1 / (2 * s) - y**2 / (4 * s**3)
    return s / 4, -x / (12 * s), -y / (8 * s), xx / 4, -x * y / (24 * s**3), yy / 4


def _monkey(x: Array, y: Array) -> Jet:
    return 0.2 * (x**3 - 3 * x * y**2), 0.6 * (x**2 - y**2), -1.2 * x * y, 1.2 * x, -1.2 * y, -1.2 * x


def _cubic(x: Array, y: Array) -> Jet:
    f = x**3 + 2 * x**2 * y - x * y + 2 * y**2
    parts = (f, 3 * x**2 + 4 * x * y - y, 2 * x**2 - x + 4 * y, 6 * x + 4 * y, 4 * x - 1, 4 + 0 * x)
    return tuple(0.15 * part for part in parts)  # type: ignore[return-value]


def _cubic_thesis(x: Array, y: Array) -> Jet:
    f = x**3 + 2 * x**2 * y - x * y + 2 * y
    parts = (f, 3 * x**2 + 4 * x * y - y, 2 * x**2 - x + 2, 6 * x + 4 * y, 4 * x - 1, 0 * x)
    return tuple(0.15 * part for part in parts)  # type: ignore[return-value]


def _exponential(x: Array, y: Array) -> Jet:
    e = np.exp(-(x**2 + y**2) / 2)
    return e, -x * e, -y * e, (x**2 - 1) * e, x * y * e, (y**2 - 1) * e


def _exponential_thesis(x: Array, y: Array) -> Jet:
    e, t = np.exp(2 * x + y**2 - y), 2 * y - 1
    return e, 2 * e, t * e, 4 * e, 2 * t * e, (2 + t**2) * e


def _trigonometric(x: Array, y: Array) -> Jet:
    a, b, w = np.pi * x, np.pi * y, np.pi
    f, zero = 0.1 * (np.cos(a) + np.cos(b)), 0 * x
    return f, -0.1 * w * np.sin(a), -0.1 * w * np.sin(b), -0.1 * w**2 * np.cos(a), zero, -0.1 * w**2 * np.cos(b)


def _trigonometric_thesis(x: Array, y: Array) -> Jet:
    a, b, w = np.pi * x, np.pi * y, np.pi
    f, zero = 0.1 * (np.cos(a) + np.sin(b)), 0 * x
    return f, -0.1 * w * np.sin(a), 0.1 * w * np.cos(b), -0.1 * w**2 * np.cos(a), zero, -0.1 * w**2 * np.sin(b)


def _named(*graphs: Graph) -> dict[str, Graph]:
    return {one.name: one for one in graphs}


_COMMON = _named(
    Graph("cylinder", "sqrt(2 - x^2)", _cylinder),
    Graph("sphere", "sqrt(4 - x^2 - y^2)", _sphere),
    Graph("elliptic_paraboloid", "2 x^2 + y^2", _quadratic(2.0, 1.0)),
    Graph("hyperboloid", "0.4 (x^2 - y^2)", _quadratic(0.4, -0.4)),
    Graph("monkey_saddle", "0.2 (x^3 - 3 x y^2)", _monkey),
    Graph("ellipsoid", "sqrt(1 - x^2/3 - y^2/2) / 4", _ellipsoid),
)

ARTICLE = {
    **_named(
        Graph("plane", "0.2 (x + y)", _plane),
        Graph("paraboloid", "0.4 (x^2 + y^2)", _quadratic(0.4, 0.4)),
        Graph("cubic", "0.15 (x^3 + 2 x^2 y - x y + 2 y^2)", _cubic),
        Graph("exponential", "exp(-(x^2 + y^2) / 2)", _exponential),
        Graph("trigonometric", "0.1 (cos pi x + cos pi y)", _trigonometric),
    ),
    **_COMMON,
}
"""As printed in the article of 2012, with the two surfaces that only the thesis has; the thesis's results are those of
these formulas."""

THESIS = {
    **_COMMON,
    **_named(
        Graph("cubic", "0.15 (x^3 + 2 x^2 y - x y + 2 y)", _cubic_thesis),
        Graph("exponential", "exp(2 x + y^2 - y)", _exponential_thesis),
        Graph("trigonometric", "0.1 (cos pi x + sin pi y)", _trigonometric_thesis),
    ),
}
"""As printed in the thesis of 2014; three differ, most likely by misprints."""

PRINTINGS = {"article": ARTICLE, "thesis": THESIS}


def graph(name: str, printing: str = "article") -> Graph:
    """Return a test surface by name.

    Parameters
    ----------
    name : str
        One of plane, cylinder, sphere, paraboloid, elliptic_paraboloid, hyperboloid, ellipsoid, monkey_saddle, cubic,
        exponential, trigonometric; the thesis has neither plane nor paraboloid.
    printing : {"article", "thesis"}
        Source of the formula.

    Raises
    ------
    ValueError
        An unknown name or printing.

    Examples
    --------
    >>> graph("cubic", "thesis")
    Graph(cubic: 0.15 (x^3 + 2 x^2 y - x y + 2 y))
    """
    known = PRINTINGS[_check.choice("printing", printing, sorted(PRINTINGS))]
    return known[_check.choice("name", name, sorted(known))]


def random_graph(length: float, bending: float, rng: np.random.Generator | int | None = None) -> Graph:
    """Return a random smooth surface, without the symmetries that flatter estimators on known ones.

    Its heights are a stationary, isotropic Gaussian process with the covariance a^2 exp(-r^2 / (2 length^2)), drawn as
    a sum of cosines of random wave vectors (Rahimi and Recht 2007).

    Parameters
    ----------
    length : float
        Distance over which heights are correlated; the square is 2 wide.
    bending : float
        Standard deviation of f_xx and f_yy, 1 / length. That of slopes is length / sqrt(3) times as large.
    rng : numpy.random.Generator or int, optional

    Raises
    ------
    ValueError
        A length or bending that is not positive.

    Examples
    --------
    >>> surface = random_graph(0.3, 1.0, rng=0)
    >>> surface.points(0.0, 0.0).shape
    (1, 3)
    """
    length = _check.number("length", length, 0.0, open_low=True)
    bending = _check.number("bending", bending, 0.0, open_low=True)
    generator = _check.generator("rng", rng)
    u, v = generator.normal(size=(2, WAVES)) / length
    phases = generator.uniform(0.0, 2 * np.pi, WAVES)
    size = bending * length**2 / np.sqrt(3) * np.sqrt(2 / WAVES)

    def jet(x: Array, y: Array) -> Jet:
        angles = np.multiply.outer(x, u) + np.multiply.outer(y, v) + phases
        even, odd = size * np.cos(angles), -size * np.sin(angles)
        return even.sum(axis=-1), odd @ u, odd @ v, -even @ (u * u), -even @ (u * v), -even @ (v * v)

    return Graph("random", f"{WAVES} cosines, correlated over {length:g}", jet)
