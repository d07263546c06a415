"""Errors of normals on the thesis's rings, from an independent implementation: |estimate - truth| at 0.1 / 0.0005.

Columns: neighbors, surface, scheme, then plane, area, quadric, chen_schmitt, extended_sine. "0" is below 2e-9.
"""

from __future__ import annotations

METHODS = ("plane", "area", "quadric", "chen_schmitt", "extended_sine")

TABLE = """\
 6 sphere              R    0/0             0/0             0/0             0/0             0/0
 6 sphere              Rda  2.5e-4/1.3e-6   0/0             0/0             0/0             0/0
 6 sphere              Rdd  4.0e-3/2.0e-5   3.4e-3/1.7e-5   2.3e-6/0        0/0             0/0
 6 sphere              Rdds 1.4e-2/6.8e-5   1.3e-2/6.4e-5   3.5e-6/0        0/0             0/0
 6 sphere              U    3.3e-3/1.7e-5   0/0             0/0             0/0             0/0
 6 cylinder            R    0/0             0/0             0/0             5.7e-3/2.9e-5   0/0
 6 cylinder            Rda  2.4e-3/1.2e-5   1.3e-3/6.4e-6   2.4e-6/0        3.9e-3/1.9e-5   1.1e-6/0
 6 cylinder            Rdd  9.6e-4/4.8e-6   1.5e-3/7.7e-6   2.5e-6/0        6.2e-3/3.1e-5   3.2e-7/0
 6 cylinder            Rdds 1.1e-3/5.4e-6   9.0e-4/4.5e-6   8.0e-7/0        5.1e-3/2.6e-5   6.0e-7/0
 6 cylinder            U    1.1e-2/5.4e-5   8.5e-3/4.2e-5   9.8e-6/0        1.4e-2/6.8e-5   9.2e-6/0
 6 elliptic_paraboloid R    0/0             0/0             0/0             1.5e-2/8.1e-5   0/0
 6 elliptic_paraboloid Rda  6.6e-3/3.3e-5   3.6e-3/1.8e-5   1.4e-4/0        1.0e-2/5.5e-5   1.6e-4/0
 6 elliptic_paraboloid Rdd  1.9e-2/9.3e-5   1.7e-2/8.7e-5   8.9e-4/0        1.7e-2/8.7e-5   3.0e-4/0
 6 elliptic_paraboloid Rdds 5.8e-2/2.9e-4   5.3e-2/2.7e-4   6.6e-4/0        1.4e-2/7.3e-5   5.6e-4/0
 6 elliptic_paraboloid U    4.2e-2/2.1e-4   2.4e-2/1.2e-4   1.9e-3/0        3.7e-2/1.9e-4   1.2e-3/0
 6 hyperboloid         R    0/0             0/0             0/0             6.7e-3/3.4e-5   0/0
 6 hyperboloid         Rda  5.5e-3/2.8e-5   2.9e-3/1.5e-5   4.0e-6/0        8.8e-3/4.4e-5   3.8e-6/0
 6 hyperboloid         Rdd  4.2e-3/2.1e-5   3.5e-3/1.7e-5   6.2e-6/0        1.2e-2/6.1e-5   1.2e-6/0
 6 hyperboloid         Rdds 1.9e-2/9.6e-5   1.8e-2/9.2e-5   1.5e-5/0        7.4e-3/3.7e-5   2.3e-6/0
 6 hyperboloid         U    2.0e-2/1.0e-4   1.9e-2/9.6e-5   4.8e-5/0        3.1e-2/1.5e-4   4.0e-5/0
 6 monkey_saddle       R    0/0             0/0             0/0             3.4e-4/8.4e-9   0/0
 6 monkey_saddle       Rda  2.0e-4/4.9e-9   1.3e-4/3.2e-9   2.4e-4/6.0e-9   3.5e-4/8.8e-9   2.4e-4/6.0e-9
 6 monkey_saddle       Rdd  6.1e-4/1.5e-8   4.5e-4/1.1e-8   4.4e-4/1.1e-8   3.0e-4/7.5e-9   1.4e-4/3.5e-9
 6 monkey_saddle       Rdds 7.1e-4/1.8e-8   4.1e-4/1.0e-8   1.5e-3/3.8e-8   5.4e-4/1.4e-8   2.9e-4/7.1e-9
 6 monkey_saddle       U    2.7e-4/6.7e-9   5.4e-4/1.3e-8   2.6e-3/6.4e-8   4.0e-4/1.0e-8   2.6e-3/6.4e-8
 6 cubic               R    1.4e-3/3.4e-8   1.4e-3/3.4e-8   1.4e-3/3.4e-8   8.4e-3/4.0e-5   1.4e-3/3.4e-8
 6 cubic               Rda  3.7e-3/1.2e-5   2.6e-3/5.8e-6   1.5e-3/3.8e-8   6.0e-3/2.4e-5   1.5e-3/3.8e-8
 6 cubic               Rdd  1.4e-3/1.3e-5   1.9e-3/1.2e-5   1.4e-3/3.6e-8   3.2e-3/1.3e-5   1.5e-3/3.7e-8
 6 cubic               Rdds 1.6e-2/7.8e-5   1.5e-2/7.4e-5   1.4e-3/3.5e-8   1.9e-3/6.2e-6   1.0e-3/2.5e-8
 6 cubic               U    1.1e-2/6.2e-5   1.2e-2/6.2e-5   1.7e-4/4.4e-9   1.6e-2/8.3e-5   1.7e-4/4.4e-9
 6 exponential         R    0/0             0/0             0/0             0/0             0/0
 6 exponential         Rda  5.0e-4/2.5e-6   0/0             0/0             0/0             0/0
 6 exponential         Rdd  7.9e-3/4.0e-5   6.8e-3/3.4e-5   5.9e-5/0        6.0e-5/0        3.8e-5/0
 6 exponential         Rdds 2.7e-2/1.4e-4   2.5e-2/1.3e-4   9.9e-5/0        6.5e-5/0        7.2e-5/0
 6 exponential         U    6.7e-3/3.3e-5   0/0             0/0             0/0             0/0
 6 trigonometric       R    0/0             0/0             0/0             1.7e-5/0        0/0
 6 trigonometric       Rda  5.0e-4/2.5e-6   2.2e-5/0        3.0e-5/0        2.2e-5/0        3.0e-5/0
 6 trigonometric       Rdd  7.7e-3/3.9e-5   6.7e-3/3.4e-5   7.9e-5/0        6.4e-5/0        5.7e-5/0
 6 trigonometric       Rdds 2.7e-2/1.3e-4   2.5e-2/1.3e-4   1.3e-4/0        8.3e-5/0        1.1e-4/0
 6 trigonometric       U    6.6e-3/3.3e-5   7.0e-5/0        2.1e-4/0        7.0e-5/0        2.1e-4/0
12 sphere              R    0/0             0/0             0/0             0/0             0/0
12 sphere              Rda  3.4e-5/1.7e-7   0/0             0/0             0/0             0/0
12 sphere              Rdd  2.1e-3/1.0e-5   1.8e-3/8.9e-6   8.5e-7/0        0/0             0/0
12 sphere              Rdds 1.5e-2/7.5e-5   1.3e-2/6.7e-5   4.1e-6/0        0/0             0/0
12 sphere              U    1.9e-3/9.5e-6   0/0             0/0             0/0             0/0
12 cylinder            R    0/0             0/0             0/0             3.1e-3/1.6e-5   0/0
12 cylinder            Rda  5.3e-4/2.7e-6   4.4e-5/2.2e-7   3.4e-7/0        1.5e-3/7.2e-6   2.3e-7/0
12 cylinder            Rdd  2.5e-3/1.2e-5   2.1e-3/1.0e-5   2.4e-6/0        1.2e-3/6.1e-6   4.7e-7/0
12 cylinder            Rdds 4.0e-3/2.0e-5   1.7e-4/8.1e-7   8.5e-7/0        4.6e-3/2.3e-5   8.2e-7/0
12 cylinder            U    4.1e-3/2.1e-5   3.1e-3/1.5e-5   2.2e-6/0        3.4e-3/1.7e-5   1.2e-6/0
12 elliptic_paraboloid R    0/0             0/0             0/0             8.4e-3/4.4e-5   0/0
12 elliptic_paraboloid Rda  1.6e-3/7.8e-6   1.2e-4/6.2e-7   4.8e-6/0        3.9e-3/2.1e-5   3.7e-5/0
12 elliptic_paraboloid Rdd  1.5e-2/7.7e-5   1.3e-2/6.3e-5   9.1e-4/0        2.8e-3/1.7e-5   3.9e-4/0
12 elliptic_paraboloid Rdds 7.2e-2/3.5e-4   5.3e-2/2.7e-4   7.4e-4/0        1.3e-2/6.6e-5   8.0e-4/0
12 elliptic_paraboloid U    1.2e-2/6.2e-5   8.7e-3/4.4e-5   4.3e-4/0        9.1e-3/4.8e-5   1.8e-4/0
12 hyperboloid         R    0/0             0/0             0/0             1.9e-3/1.7e-5   0/0
12 hyperboloid         Rda  1.2e-3/5.9e-6   9.9e-5/4.9e-7   1.6e-7/0        2.2e-3/2.8e-5   6.0e-7/0
12 hyperboloid         Rdd  2.2e-3/1.1e-5   2.4e-3/1.2e-5   4.1e-6/0        3.5e-3/1.8e-5   6.0e-7/0
12 hyperboloid         Rdds 1.5e-2/7.5e-5   2.2e-2/1.1e-4   1.2e-5/0        9.8e-3/4.9e-5   5.8e-6/0
12 hyperboloid         U    1.0e-2/5.2e-5   7.0e-3/3.5e-5   9.7e-6/0        7.7e-3/3.9e-5   1.1e-5/0
12 monkey_saddle       R    0/0             0/0             0/0             3.4e-4/0        0/0
12 monkey_saddle       Rda  1.0e-4/2.6e-9   3.4e-5/0        1.0e-4/2.6e-9   3.9e-4/3.4e-9   1.0e-4/2.6e-9
12 monkey_saddle       Rdd  0/0             1.3e-4/3.2e-9   0/0             7.6e-4/8.8e-9   0/0
12 monkey_saddle       Rdds 4.2e-4/1.0e-8   2.2e-4/5.5e-9   1.3e-3/3.2e-8   5.4e-4/1.3e-8   1.2e-4/3.1e-9
12 monkey_saddle       U    4.4e-4/1.1e-8   3.6e-4/8.9e-9   4.9e-4/1.2e-8   5.0e-4/1.3e-8   4.9e-4/1.2e-8
12 cubic               R    1.4e-3/3.4e-8   1.4e-3/3.4e-8   1.4e-3/3.4e-8   1.9e-3/1.8e-6   1.4e-3/3.4e-8
12 cubic               Rda  1.6e-3/1.8e-6   1.3e-3/7.7e-8   1.4e-3/3.4e-8   1.9e-3/1.1e-5   1.4e-3/3.4e-8
12 cubic               Rdd  1.9e-3/1.6e-6   1.5e-3/2.6e-6   1.6e-3/3.9e-8   2.2e-3/1.7e-6   1.5e-3/3.7e-8
12 cubic               Rdds 1.5e-2/7.5e-5   1.7e-2/8.4e-5   1.3e-3/3.2e-8   4.8e-3/2.3e-5   8.2e-4/2.0e-8
12 cubic               U    7.3e-3/3.9e-5   3.4e-3/1.9e-5   1.1e-3/2.7e-8   3.6e-3/2.2e-5   1.1e-3/2.7e-8
12 exponential         R    0/0             0/0             0/0             0/0             0/0
12 exponential         Rda  6.7e-5/3.4e-7   0/0             0/0             0/0             0/0
12 exponential         Rdd  4.1e-3/2.1e-5   3.5e-3/1.8e-5   3.1e-5/0        2.4e-5/0        1.9e-5/0
12 exponential         Rdds 3.0e-2/1.5e-4   2.7e-2/1.3e-4   1.1e-4/0        6.5e-5/0        7.7e-5/0
12 exponential         U    3.8e-3/1.9e-5   0/0             0/0             0/0             0/0
12 trigonometric       R    0/0             0/0             0/0             2.2e-5/0        0/0
12 trigonometric       Rda  6.7e-5/3.3e-7   4.0e-6/0        6.7e-6/0        2.4e-5/0        6.7e-6/0
12 trigonometric       Rdd  4.1e-3/2.1e-5   3.5e-3/1.8e-5   3.8e-5/0        5.9e-5/0        2.8e-5/0
12 trigonometric       Rdds 2.9e-2/1.5e-4   2.6e-2/1.3e-4   1.3e-4/0        8.4e-5/0        1.3e-4/0
12 trigonometric       U    3.7e-3/1.9e-5   2.2e-5/0        3.5e-5/0        3.9e-5/0        3.5e-5/0
"""


def rows() -> list[tuple[int, str, str, dict[str, tuple[float, float]]]]:
    """Count, surface, scheme, and for each method the errors at the two distances."""
    found = []
    for line in TABLE.splitlines():
        count, surface, scheme, *cells = line.split()
        errors = [tuple(float(value) for value in cell.split("/")) for cell in cells]
        found.append((int(count), surface, scheme, dict(zip(METHODS, errors, strict=True))))
    return found
