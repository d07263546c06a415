"""Whether residuals of a fitted model are those of noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation import regression, selection, smoothing
from simplexmesh.cloud.validation.normality import normality_test
from simplexmesh.cloud.validation.outcome import SIGNIFICANCE, Outcome
from simplexmesh.cloud.validation.runs import helix_order, runs_test
from simplexmesh.cloud.validation.unfolding import unfolded

MOST_POINTS = 2000
"""That are tested: relief of an eighth of the noise is found, and a registration error of less does not matter."""

TERMS = regression.polynomial_terms(np.zeros((1, 2))).shape[1]
"""Of the polynomial that residuals are compared with."""

NEGLIGIBLE = 1e-9
"""Of the size of the points: no scanner resolves it, residuals below are of rounding and of ended iterations."""

ROUNDING = 64 * float(np.finfo(float).eps)
"""Of the coordinates, which may be far from the origin."""


@dataclass(frozen=True, repr=False)
class Validation:
    """Tests of the residuals of a fitted model; `valid` is the verdict.

    The verdict is that neither a polynomial of the surface coordinates (`regression`) nor smoothing over neighbors
    (`smoothness`) finds relief in the residuals, and where the noise is known that they are not larger (`chi_square`).
    Each is tested at the level at which one of all rejects a right model in 5 of 100 cases. It is this combination
    because only these tests keep their level for noise of any law and of a deviation that varies over the surface, and
    because they complement each other: polynomials find what is wide, smoothing what is small. Normality rejects right
    models wherever noise is not normal, signs in order find little: both are told, and do not decide.

    Attributes
    ----------
    rms, noise : float
        Root mean square residual e, and the deviation e' of the noise that it means, of all points.
    count, tested : int
        Points, and how many of them, taken at random, were tested.
    regression : Outcome
        F of a polynomial of degree 4, with the p-value of residuals of random sign.
    smoothness : Outcome
        Ratio rho of what smoothing keeps to what it takes away, likewise.
    chi_square : Outcome or None
        Sum of squares by the known noise; None where it is not known.
    normality : Outcome
        Largest difference D_n from the normal law.
    runs : Outcome
        Number of runs of one sign along a helix, less its expectation, in deviations.

    References
    ----------
    T. Chaperon, *Segmentation de nuage de points 3D*, 2002, chapter 5.
    """

    rms: float
    noise: float
    count: int
    tested: int
    regression: Outcome
    smoothness: Outcome
    chi_square: Outcome | None
    normality: Outcome
    runs: Outcome

    @property
    def valid(self) -> bool:
        """Whether the residuals are those of noise."""
        return all(outcome.passed for outcome in self._deciding)

    @property
    def p_value(self) -> float:
        """Probability that one of the deciding tests speaks as much against a right model."""
        least = min(outcome.p_value for outcome in self._deciding)
        return 1.0 - (1.0 - least) ** len(self._deciding)

    @property
    def _deciding(self) -> list[Outcome]:
        return [each for each in (self.regression, self.smoothness, self.chi_square) if each is not None]

    def __repr__(self) -> str:
        tests = f"F {self.regression.statistic:.3g}, rho {self.smoothness.statistic:.3g}"
        chi = "" if self.chi_square is None else f", chi-square p {self.chi_square.p_value:.3g}"
        return f"Validation({'valid' if self.valid else 'not valid'}, p {self.p_value:.3g}: {tests}{chi})"


def validated(
    points: Array,
    residuals: Array,
    coordinates: Array,
    parameters: int,
    *,
    noise: float | None = None,
    periods: tuple[bool, bool] = (False, False),
    derivatives: Array | None = None,
    rng: int | np.random.Generator = 0,
) -> Validation:
    """Return whether residuals of a fitted surface are those of noise, independent of where on the surface.

    Of more than 2000 points (n, 3) on the surface as many are taken at random for the tests, so that an error of a
    model that is small against the noise does not come to matter with the number of points. With the `derivatives`
    (n, p) of the distances by the `parameters` that were fitted the level is kept: a fit takes from residuals what
    these explain, so that without them only 1 or 2 right models in 100 are rejected, and wrong ones less too.
    """
    at, d, uv, n = points, residuals, coordinates, len(points)
    J = np.ones((n, 1)) if derivatives is None else derivatives
    square_sum = float(d @ d)
    told = (selection.rms(square_sum, n), selection.noise(square_sum, n, parameters), n)
    if told[0] <= max(NEGLIGIBLE * float(np.ptp(at, axis=0).max()), ROUNDING * float(np.abs(at).max())):
        exact = Outcome(0.0, 1.0)
        return Validation(*told, 0, exact, exact, None if noise is None else exact, exact, exact)
    generator = np.random.default_rng(rng)
    if n > MOST_POINTS:
        some = generator.choice(n, MOST_POINTS, replace=False)
        at, d, uv, J = at[some], d[some], uv[some], J[some]
    inner, flat = regression.orthonormal(J), unfolded(uv, periods)
    rest = d - inner @ (inner.T @ d)
    level = 1 - (1 - SIGNIFICANCE) ** (1 / (2 if noise is None else 3))
    relief, smooth = _relief_tests(rest, inner, flat, at, generator, level)
    chi = None
    if noise is not None:
        known = chi_square_test(d, noise, parameters * len(d) / n)
        chi = Outcome(known.statistic, known.p_value, level)
    return Validation(*told, len(d), relief, smooth, chi, normality_test(rest), runs_test(rest[helix_order(flat)]))


def chi_square_test(residuals: Array, noise: float, parameters: float) -> Outcome:
    """Test whether residuals are larger than noise of a deviation.

    The sum of (residual / noise)^2 has the chi-square law with n - parameters degrees of freedom (Chaperon 2002,
    section 5.2.2, where the ratio of deviations is said to have it).
    """
    statistic = float(((residuals / noise) ** 2).sum())
    return Outcome(statistic, float(chdtrc(len(residuals) - parameters, statistic)))


def _relief_tests(
    rest: Array, inner: Array, flat: Array, at: Array, rng: np.random.Generator, level: float
) -> tuple[Outcome, Outcome]:
    """Return the tests by regression and by smoothing, of residuals without what a basis (m, q) explains."""
    trial = smoothing.sign_flips(rest, rng)
    trial -= inner @ (inner.T @ trial)
    outer = regression.orthonormal(np.column_stack([inner, regression.polynomial_terms(flat)]))
    if outer.shape[1] == inner.shape[1]:
        raise ValueError("coordinates must differ: relief has no place in one")
    averaging = smoothing.nearest_neighbors(at)
    found = float(regression.nested_model_statistic(rest, outer, inner))
    law = regression.nested_model_statistic(trial, outer, inner)
    rho = float(smoothing.smoothed_ratio(rest, averaging @ rest))
    rho_law = smoothing.smoothed_ratio(trial, averaging @ trial)
    return (
        Outcome(found, smoothing.at_least(found, law), level),
        Outcome(rho, smoothing.at_least(rho, rho_law), level),
    )
