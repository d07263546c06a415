"""Normal estimators as the papers write them, one point at a time: P (3,), its neighbors Q (m, 3) in order."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.linalg import lstsq, norm, svd
from scipy.optimize import root

from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.sampled_surface import SampledSurface


def ringed(points):
    """A surface whose first point has the others around it, in order, and these none; and the first one's row."""
    n = len(points)
    links = Neighborhoods(np.arange(n), np.append(0, np.full(n, n - 1)), np.arange(1, n), np.arange(n) == 0)
    return SampledSurface(points, links=links), links.taken([0])


def unit(v):
    return v / norm(v)


def angle(u, v):
    return np.arctan2(norm(np.cross(u, v)), u @ v)


WEIGHTS = {
    "mean": lambda u, v: 1.0,
    "area": lambda u, v: norm(np.cross(u, v)) / 2,
    "angle": angle,
    "max": lambda u, v: np.sin(angle(u, v)) / (norm(u) * norm(v)),
}


def of_faces(P, wedges, kind):
    """The sum of the unit normals of the triangles (P, A, B), each times its weight."""
    total = np.zeros(3)
    for A, B in wedges:
        if angle(A - P, B - P) > 1e-10 and np.pi - angle(A - P, B - P) > 1e-10:
            total = total + WEIGHTS[kind](A - P, B - P) * unit(np.cross(A - P, B - P))
    return unit(total)


def around(Q):
    """The wedges of a closed ring."""
    return list(zip(Q, np.roll(Q, -1, axis=0), strict=True))


def plane(P, Q, side, variant="pca"):
    X = np.vstack([P, Q])
    n = svd(X - X.mean(axis=0))[2][2] if variant == "pca" else unit(svd(np.c_[X, np.ones(len(X))])[2][3][:3])
    return n * np.sign(n @ side)


def frame(N):
    """Rows: the x axis, or the y axis, projected to the tangent plane; the other tangent; N."""
    i = np.eye(3)[0] if abs(N[0]) < 0.9 else np.eye(3)[1]
    first = unit(i - N * (N @ i))
    return np.array([first, np.cross(N, first), N])


def quadric(P, Q, N, passes=1):
    for _ in range(passes):
        R = frame(N)
        x, y, z = ((Q - P) @ R.T).T
        *_, d, e = lstsq(np.c_[x * x, y * y, x * y, x, y], z, rcond=None)[0]
        N = unit(R.T @ [-d, -e, 1.0])
    return N


def tangent(P, A, B):
    """Of the circle through A, P, B at P: n x unit((P - A) x (B - P)), n toward the circumcenter (3.11)."""
    a, b = A - P, B - P
    c = np.cross(a, b)
    if norm(c) < 1e-12 * norm(a) * norm(b):
        return unit(B - A)
    center = (np.cross(c, a) * (b @ b) + np.cross(b, c) * (a @ a)) / (2 * (c @ c))
    return np.cross(unit(center), unit(np.cross(P - A, B - P)))


def opposed(P, Q, normalized=False):
    """All pairs (-w, a, b), the most opposite first."""
    sizes = norm(Q - P, axis=1) if normalized else np.ones(len(Q))
    return sorted((-((P - Q[a]) @ (Q[b] - P)) / (sizes[a] * sizes[b]), a, b) for a, b in combinations(range(len(Q)), 2))


def chen_schmitt(P, Q, side, normalized=False):
    lines = [tangent(P, Q[a], Q[b]) for _, a, b in opposed(P, Q, normalized)[: len(Q)]]
    products = [np.cross(s, t) for s, t in combinations(lines, 2)]
    return unit(sum(p if p @ side > 0 else -p for p in products))


def harmonics(P, Q, N):
    """a, b, c, d, e of k = a cos 2t + b sin 2t + c + d cos t + e sin t by least squares, and the first direction."""
    v = P - Q
    k = 2 * (v @ N) / np.sum(v * v, axis=1)
    T = Q - P - np.outer((Q - P) @ N, N)
    T /= norm(T, axis=1)[:, None]
    t = np.arctan2(T @ np.cross(N, T[0]), T @ T[0])
    M = np.c_[np.cos(2 * t), np.sin(2 * t), np.ones(len(t)), np.cos(t), np.sin(t)]
    return lstsq(M, k, rcond=None)[0], T[0]


def error(P, Q, N):
    return np.hypot(*harmonics(P, Q, N)[0][3:])


def extended_sine(P, Q, N, tolerance=1e-12, most=50):
    """The thesis's algorithm 4, mended: tilt along (d, e) by what a ternary search finds best, until they are gone."""
    for _ in range(most):
        (a, b, c, d, e), T0 = harmonics(P, Q, N)
        if np.hypot(d, e) * np.mean(norm(Q - P, axis=1)) / 2 < tolerance:
            break
        at = np.arctan2(e, d)
        f = lambda t: a * np.cos(2 * t) + b * np.sin(2 * t) + c + d * np.cos(t) + e * np.sin(t)  # noqa: B023, E731
        left, right = f(np.pi + at), f(at)
        q = 2 * max(abs(left), abs(right)) ** 2
        TR = np.cos(at) * T0 + np.sin(at) * np.cross(N, T0)
        low, high = 0.0, np.arctan((left - right) / (np.sqrt(q - left**2) + np.sqrt(q - right**2)))
        turned = lambda p: unit(np.cos(p) * N - np.sin(p) * TR)  # noqa: B023, E731
        while abs(high - low) > 1e-12:
            one, other = low + (high - low) / 3, low + 2 * (high - low) / 3
            if error(P, Q, turned(one)) <= error(P, Q, turned(other)):
                high = other
            else:
                low = one
        N = turned((low + high) / 2)
    return N


def extended_sine_root(P, Q, N):
    """The same normal as the root of two equations in two unknowns."""
    R = frame(N)

    def residual(u):
        n = unit(N + u[0] * R[0] + u[1] * R[1])
        (*_, d, e), T0 = harmonics(P, Q, n)
        return R[:2] @ (d * T0 + e * np.cross(n, T0))

    u = root(residual, np.zeros(2), tol=1e-13).x
    return unit(N + u[0] * R[0] + u[1] * R[1])


def propagated(rows, points, normals, softening):
    """Signs that spread along the minimum spanning forest of neighbors, found edge by edge (Kruskal)."""

    def agreement(i, j, a, b):
        step = points[j] - points[i]
        return a @ b - 2 * (a @ step) * (b @ step) / (step @ step + softening)

    edges = [(1 - abs(agreement(i, j, normals[i], normals[j])), i, j) for i, row in enumerate(rows) for j in row]
    tree = list(range(len(points)))
    links = [[] for _ in points]

    def root(i):
        while tree[i] != i:
            i = tree[i]
        return i

    for _, i, j in sorted(edges):
        if root(i) != root(j):
            tree[root(i)] = root(j)
            links[i].append(j)
            links[j].append(i)
    out = [None] * len(points)
    for first in range(len(points)):
        if out[first] is None:
            out[first], part = normals[first], [first]
            for i in part:
                for j in links[i]:
                    if out[j] is None:
                        out[j] = normals[j] if agreement(i, j, out[i], normals[j]) >= 0 else -normals[j]
                        part.append(j)
            center = points[part].mean(axis=0)
            if sum(out[i] @ (points[i] - center) for i in part) < 0:
                for i in part:
                    out[i] = -out[i]
    return np.array(out)


def clashing_edges(faces):
    """Edges that two different triangles or more traverse in one direction, and none in the other."""
    distinct = {tuple(np.roll(face, -np.argmin(face)).tolist()) for face in np.asarray(faces)}
    directed = [(face[k], face[(k + 1) % 3]) for face in distinct for k in range(3)]
    return sum(directed.count((a, b)) > 1 and (b, a) not in directed for a, b in set(directed))
