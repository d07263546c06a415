"""Readable twins of the curvature estimators, one neighborhood at a time, written from the papers, and slow.

Each takes a point P (3,), its neighbors Q (m, 3), counter-clockwise where the order matters, and its unit normal N.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.linalg import lstsq, norm


def unit(v):
    return v / norm(v)


def area_normal(P, Q):
    """Charton 2014, 3.3."""
    return unit(sum(np.cross(Q[i] - P, Q[(i + 1) % len(Q)] - P) for i in range(len(Q))))


def mean_normal(P, Q):
    """Charton 2014, 3.1-3.2."""
    return unit(sum(unit(np.cross(Q[i] - P, Q[(i + 1) % len(Q)] - P)) for i in range(len(Q))))


def frame(N):
    axis = np.eye(3)[0] if abs(N[0]) < 0.9 else np.eye(3)[1]
    first = unit(axis - N * (N @ axis))
    return np.array([first, np.cross(N, first), N])


def normal_curvatures(P, Q, N):
    """Charton 2014, 2.39: of the circles through P and each neighbor, tangent to the surface at P."""
    v = P - Q
    return 2 * (v @ N) / np.sum(v * v, axis=1)


def azimuths(P, Q, N):
    """Angles of the neighbors around N from the first, in [0, 2 pi), and their unit tangents."""
    T = Q - P
    T = T - np.outer(T @ N, N)
    T /= norm(T, axis=1)[:, None]
    return np.arctan2(T @ np.cross(N, T[0]), T @ T[0]) % (2 * np.pi), T


def of(H, swing, direction=None):
    return {"mean": H, "gauss": H * H - swing * swing, "k1": H + swing, "k2": H - swing, "d1": direction}


def of_tensor(M, N):
    """Principal values and the first direction of a symmetric 3 x 3 matrix that takes N to zero."""
    B = frame(N)[:2]
    (low, high), vectors = np.linalg.eigh(B @ M @ B.T)
    return low, high, vectors[:, 1] @ B


def discrete(P, Q, N, area="mixed", projected=False):
    """Charton 2014, 2.3-2.5, corrected; Meyer, Desbrun, Schroeder, Barr 2003."""
    cell, angles, L = 0.0, 0.0, np.zeros(3)

    def cot(u, v):
        return (u @ v) / norm(np.cross(u, v))

    for i in range(len(Q)):
        a, b = Q[i], Q[(i + 1) % len(Q)]
        u, v = a - P, b - P
        angles += np.arctan2(norm(np.cross(u, v)), u @ v)
        at_a, at_b = cot(P - a, b - a), cot(P - b, a - b)
        L += at_a * (P - b) + at_b * (P - a)
        face = norm(np.cross(u, v)) / 2
        if area == "barycentric":
            cell += face / 3
        elif area == "mixed" and u @ v < 0:
            cell += face / 2
        elif area == "mixed" and min(at_a, at_b) < 0:
            cell += face / 4
        else:
            cell += (at_a * (v @ v) + at_b * (u @ u)) / 8
    L /= 2 * cell
    H = L @ N / 2 if projected else norm(L) / 2 * np.sign(L @ N)
    K = (2 * np.pi - angles) / cell
    swing = np.sqrt(max(H * H - K, 0))
    return {"mean": H, "gauss": K, "k1": H + swing, "k2": H - swing, "d1": None}


def quadric(P, Q, N, terms):
    """Charton 2014, 2.7, 2.15 and 2.16, with the curvatures of a graph at P."""
    x, y, z = ((Q - P) @ frame(N).T).T
    columns = np.array([x * x, x * y, y * y, x, y, np.ones_like(x)]).T
    if terms == 6 and abs(np.linalg.qr(columns / norm(columns, axis=0))[1][5, 5]) < 0.25:
        terms = 5  # the neighbors do not tell the offset from the rest
    columns = columns[:, :terms]
    a, b, c, d, e = [*lstsq(columns, z, rcond=None)[0], 0.0, 0.0][:5]
    g = 1 + d * d + e * e
    H = -(a * (1 + e * e) + c * (1 + d * d) - b * d * e) / g**1.5
    K = (4 * a * c - b * b) / g**2
    first, second = np.array([[1 + d * d, d * e], [d * e, 1 + e * e]]), np.array([[2 * a, b], [b, 2 * c]])
    values, vectors = np.linalg.eig(np.linalg.solve(first, second))
    p, q = vectors[:, np.argmin(values.real)].real
    direction = unit(frame(N).T @ [p, q, d * p + e * q])
    return of(H, np.sqrt(max(H * H - K, 0)), direction) | {"normals": unit(frame(N).T @ [-d, -e, 1])}


def taubin(P, Q, N, weights=None):
    """Charton 2014, 2.19-2.29."""
    _, T = azimuths(P, Q, N)
    if weights is None:
        faces = np.array([norm(np.cross(Q[i] - P, Q[(i + 1) % len(Q)] - P)) for i in range(len(Q))])
        weights = faces + np.roll(faces, 1)
    w = weights / np.sum(weights)
    low, high, direction = of_tensor((T * (w * normal_curvatures(P, Q, N))[:, None]).T @ T, N)
    return of(low + high, 2 * (high - low), direction)


def langer_weights(P, Q, N, times, least=0.0):
    """Charton 2014, 2.30, with the angles between projected neighbors in order of azimuth; None if they cancel."""
    angles, _ = azimuths(P, Q, N)
    order = np.argsort(angles)
    gaps = np.diff(np.append(angles[order], angles[order[0]] + 2 * np.pi))
    tangents = np.tan(times * gaps)
    weights = np.empty(len(Q))
    weights[order] = tangents + np.roll(tangents, 1)
    if abs(weights.sum()) < least * np.abs(weights).sum():
        return None
    return weights / weights.sum()


def langer(P, Q, N):
    return taubin(P, Q, N, langer_weights(P, Q, N, 1))


def langer_exact(P, Q, N):
    """Langer, Belyaev, Seidel 2007: the difference of the principal curvatures by a second quadrature."""
    k, (angles, T) = normal_curvatures(P, Q, N), azimuths(P, Q, N)
    H = langer_weights(P, Q, N, 1) @ k
    w = langer_weights(P, Q, N, 2, 0.02)
    if w is None:
        C, S = lstsq(np.c_[np.cos(2 * angles), np.sin(2 * angles)], k - H, rcond=None)[0]
    else:
        C, S = 2 * w @ ((k - H) * np.cos(2 * angles)), 2 * w @ ((k - H) * np.sin(2 * angles))
    return of(H, np.hypot(C, S), _turned(T[0], N, 0.5 * np.arctan2(S, C)))


def _turned(tangent, N, angle):
    return np.cos(angle) * tangent + np.sin(angle) * np.cross(N, tangent)


def sine(P, Q, N):
    """Charton 2014, 2.44."""
    angles, T = azimuths(P, Q, N)
    rows = np.c_[np.cos(2 * angles), np.sin(2 * angles), np.ones(len(angles))]
    a, b, c = lstsq(rows, normal_curvatures(P, Q, N), rcond=None)[0]
    return of(c, np.hypot(a, b), _turned(T[0], N, 0.5 * np.arctan2(b, a)))


def circle(P, a, b, N):
    """Signed normal curvature of the circle through three points by Meusnier, and its tangent at P."""
    a, b = a - P, b - P
    c = np.cross(a, b)
    if norm(c) < 1e-11 * norm(a) * norm(b):
        return 0.0, unit(b - a)
    center = (np.cross(c, a) * (b @ b) + np.cross(b, c) * (a @ a)) / (2 * c @ c)
    toward = unit(center)
    return -(toward @ N) / norm(center), np.cross(toward, unit(np.cross(-a, b)))


def chen_schmitt(P, Q, N, weighted=True, normalized=False):
    """Charton 2014, 2.33-2.38, corrected: as many of the most opposed triples as there are neighbors."""

    def opposition(pair):
        a, b = Q[pair[0]] - P, Q[pair[1]] - P
        return round(-(a @ b) / (norm(a) * norm(b) if normalized else np.mean(norm(Q - P, axis=1)) ** 2), 9)

    pairs = sorted(combinations(range(len(Q)), 2), key=lambda pair: -opposition(pair))[: len(Q)]
    k, tangents = zip(*(circle(P, Q[a], Q[b], N) for a, b in pairs), strict=True)
    k, T = np.array(k), np.array(tangents)
    scale = np.mean(norm(Q - P, axis=1))
    if weighted and np.min(np.abs(k)) * scale < 1e-11:
        return of(0.0, 0.0, None)
    angles, T = azimuths(P, P + T, N)
    weights = 1 / np.abs(k) if weighted else np.ones(len(k))
    rows = np.c_[np.cos(angles) ** 2, np.cos(angles) * np.sin(angles), np.sin(angles) ** 2]
    A, B, C = lstsq(weights[:, None] * rows, weights * k, rcond=None)[0]
    return of((A + C) / 2, np.hypot(A - C, B) / 2, _turned(T[0], N, 0.5 * np.arctan2(B, A - C)))


def simplex_nodes(points, neighbors):
    """H by the circumscribed sphere and K by the turn of normals at points with three neighbors (Delingette 1994)."""
    n = len(points)
    H, normals, areas = np.full(n, np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)
    for i, row in enumerate(neighbors):
        if (row < 0).any():
            continue
        A, B, C = points[row]
        w = np.cross(B - A, C - A)
        normals[i], areas[i] = unit(w), norm(w) / 2
        # the center O of the sphere is as far from all four
        four = np.array([A, B, C]) - points[i]
        if abs(np.linalg.det(four)) < 1e-12 * norm(four) ** 3:
            H[i] = 0.0
            continue
        center = np.linalg.solve(2 * four, np.sum(four * four, axis=1))
        H[i] = np.sign(-four[0] @ w) / norm(center)
    K = np.full(n, np.nan)
    for i, row in enumerate(neighbors):
        if (row >= 0).all():
            a, b, c = normals[row]
            K[i] = 2 * np.arctan2(a @ np.cross(b, c), 1 + a @ b + b @ c + c @ a) / areas[i]
    return H, K


def simplex_angle(points, faces):
    """The simplex angle's H and K on the centers of the faces, averaged at the vertices."""
    sides = {(f[j], f[(j + 1) % 3]): i for i, f in enumerate(faces.tolist()) for j in range(3)}
    across = np.array([[sides.get((f[(j + 1) % 3], f[j]), -1) for j in range(3)] for f in faces.tolist()])
    H, K = simplex_nodes(points[faces].mean(axis=1), across)
    mean, gauss = np.full(len(points), np.nan), np.full(len(points), np.nan)
    for i in range(len(points)):
        good = (faces == i).any(axis=1) & np.isfinite(H) & np.isfinite(K)
        if good.any():
            mean[i], gauss[i] = H[good].mean(), K[good].mean()
    return mean, gauss
