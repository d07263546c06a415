"""One iteration of a simplex mesh by the formulas of the thesis, in plain NumPy; the kernels must equal it.

Written from H. Delingette (1994), chapters 3 to 5, with angles, circumcenters and equation numbers, not from the
kernels, which multiply these formulas out and avoid the trigonometric functions.
"""

from __future__ import annotations

import math

import numpy as np

NAMES = ("free", "orientation", "angle", "mean_curvature", "shape", "curvature")


def dot(a, b):
    return (a * b).sum(axis=-1)


def frame(vertices, neighbors):
    """Return n (3.30), C0 and r of the neighbors' circle, and the height h, the zero vector and NaN where collinear."""
    A, B, C = (vertices[neighbors[:, k]] for k in range(3))
    w = np.cross(B - A, C - A)
    size = np.linalg.norm(w, axis=1)
    collinear = size <= 1e-12 * np.linalg.norm(B - A, axis=1) * np.linalg.norm(C - A, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        n = np.where(collinear[:, None], 0.0, w / size[:, None])
        b, c = B - A, C - A
        to_center = np.cross(dot(b, b)[:, None] * c - dot(c, c)[:, None] * b, w) / (2 * size[:, None] ** 2)
    to_center[collinear] = np.nan
    return n, A + to_center, np.linalg.norm(to_center, axis=1), dot(vertices - A, n)


def simplex_angle(vertices, neighbors):
    """Return phi = atan2(2 h r, r^2 - d^2 - h^2), zero where the neighbors are collinear."""
    n, center, r, h = frame(vertices, neighbors)
    d = np.linalg.norm(vertices - h[:, None] * n - center, axis=1)
    return np.where(np.isnan(r), 0.0, np.arctan2(2 * h * r, r**2 - d**2 - h**2))


def mean_curvature(vertices, neighbors):
    """Return H = sin(phi) / r, zero where the neighbors are collinear."""
    r = frame(vertices, neighbors)[2]
    return np.where(np.isnan(r), 0.0, np.sin(simplex_angle(vertices, neighbors)) / r)


def one_ring_mean(values, neighbors):
    """Return the plain mean over each vertex and its neighbors, vertex by vertex."""
    return np.array([np.mean([values[i], *values[around]]) for i, around in enumerate(neighbors)])


def one_ring_mean_angle(angles, neighbors, radii):
    """Return the mean angle over each vertex and its neighbors, angles converted to the vertex's own circumradius.

    On one sphere of radius R an angle phi on a circle of radius r has sin(phi) = r / R, so that phi_j carried to the
    circle of vertex i has the sine sin(phi_j) r_i / r_j, on the same side of a right angle.
    """
    out = np.zeros(len(angles))
    for i, around in enumerate(neighbors):
        total = angles[i]
        for j in around:
            phi = angles[j]
            if np.isfinite(radii[i]) and np.isfinite(radii[j]):
                carried = math.asin(max(-1.0, min(1.0, math.sin(phi) * radii[i] / radii[j])))
                phi = carried if abs(phi) <= math.pi / 2 else math.copysign(math.pi, phi) - carried
            total += phi
        out[i] = total / 4
    return out


def height(r, d, phi):
    """Return L(r, d, phi) (3.7 with its two branches); it has no value below pi/2 for a foot outside the circle."""
    sine, cosine = np.sin(phi), np.cos(phi)
    q = np.sqrt(np.maximum(r**2 - (d * sine) ** 2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        shallow = np.nan_to_num(np.maximum(r**2 - d**2, 0.0) * sine / (r * cosine + q))
        steep = (q - r * cosine) / sine
    return np.where(cosine >= 0, shallow, steep)


def beyond_a_right_angle(vertices, neighbors):
    """Return the sign of phi where |phi| > pi/2, else 0."""
    phi = simplex_angle(vertices, neighbors)
    return np.where(np.abs(phi) > np.pi / 2, np.sign(phi), 0).astype(np.int8)


def angle_of_curvature(curvature, vertices, neighbors):
    """Return the phi with sin(phi) = r H, beyond pi/2 where the vertex and all three neighbors are."""
    r = frame(vertices, neighbors)[2]
    with np.errstate(invalid="ignore"):
        phi = np.arcsin(np.clip(r * curvature, -1, 1))
    beyond = beyond_a_right_angle(vertices, neighbors)
    steep = (beyond[neighbors] == beyond[:, None]).all(axis=1) & (beyond * curvature > 0)
    return np.where(steep, beyond * np.pi - phi, phi)


def wanted_angle(constraint, vertices, neighbors, *, curvature=None, angle=None):
    """Return phi* of each vertex by the name of its constraint (section 4.3)."""
    phi = simplex_angle(vertices, neighbors)
    of_curvature = angle_of_curvature(np.zeros(len(vertices)) if curvature is None else curvature, vertices, neighbors)
    choices = {
        "free": phi,
        "orientation": np.zeros_like(phi),
        "angle": angle,
        "mean_curvature": of_curvature,
        "shape": angle,
        "curvature": of_curvature,
    }
    return np.array([choices[name][i] for i, name in enumerate(constraint)])


def resting_place(vertices, neighbors, metric, phi):
    """Return P* = e1 A + e2 B + e3 C + L n (4.49), |L| at most the neighbors' root mean square distance."""
    n, center, r, _ = frame(vertices, neighbors)
    foot = np.einsum("ij,ijk->ik", metric, vertices[neighbors])
    L = height(r, np.linalg.norm(foot - center, axis=1), phi)
    size = size_of_stars(vertices, neighbors)
    L = np.where(np.isnan(r), 0.0, np.clip(L, -size, size))
    return foot + L[:, None] * n


def size_of_stars(vertices, neighbors):
    """Return the root mean square distance of each vertex to its neighbors."""
    return np.sqrt(((vertices[neighbors] - vertices[:, None]) ** 2).sum(axis=2).mean(axis=1))


def step(vertices, previous, neighbors, metric, phi, gaps, *, alpha=0.4, beta=0.2, damping=0.6, extra=0.0):
    """Return the next positions (5.2), the squared moves and the energy of each vertex."""
    n = frame(vertices, neighbors)[0]
    internal = resting_place(vertices, neighbors, metric, phi) - vertices
    upright = dot(n, n[neighbors].sum(axis=1)) > 0
    pull = np.where(np.isnan(gaps) | ~upright, 0.0, gaps)
    alpha, beta, damping = (np.broadcast_to(x, len(vertices)) for x in (alpha, beta, damping))
    move = (1 - damping)[:, None] * (vertices - previous) + alpha[:, None] * internal + (beta * pull)[:, None] * n
    move = move + extra
    limit = size_of_stars(vertices, neighbors) / 2
    size = np.linalg.norm(move, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        move = np.where((size > limit)[:, None], move * (limit / size)[:, None], move)
    return vertices + move, dot(move, move), 0.5 * (alpha * dot(internal, internal) + beta * pull**2)


def update(vertices, previous, neighbors, metric, rigidity, gaps):
    """Return one whole iteration under the mean curvature constraint, vectorized as far as possible."""
    a, b, c = (vertices[neighbors[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    moment = mean_curvature(vertices, neighbors) * area
    for _ in range(rigidity):
        area = (area + area[neighbors].sum(axis=1)) / 4
        moment = (moment + moment[neighbors].sum(axis=1)) / 4
    curvature = moment / area
    phi = angle_of_curvature(curvature, vertices, neighbors)
    return step(vertices, previous, neighbors, metric, phi, gaps)[0]


def curvedness(vertices, normals, neighbors, shortest):
    """Return the root mean square over the neighbors of the change of normal per length, at least `shortest`."""
    turn = np.linalg.norm(normals[neighbors] - normals[:, None], axis=2)
    length = np.maximum(np.linalg.norm(vertices[neighbors] - vertices[:, None], axis=2), shortest)
    ratio = np.divide(turn, length, out=np.zeros_like(turn), where=length > 0)
    return np.sqrt((ratio**2).mean(axis=1))


def adapted_metric(metric, curvature, neighbors, strength, low, high):
    """Return metric parameters half way to 1/3 + strength dC_j (5.5.1), strength reduced to keep all in range."""
    size = np.abs(curvature)
    around = size[neighbors]
    contrast = (around - around.mean(axis=1, keepdims=True)) / np.maximum(size, size.mean())[:, None]
    out = np.zeros_like(metric)
    for i, c in enumerate(contrast):
        room = [(high - 1 / 3) / x if x > 0 else (low - 1 / 3) / x for x in c if x != 0]
        out[i] = (metric[i] + 1 / 3 + min([strength, *room]) * c) / 2
    return out


def rim_place(before, point, after, two_before, two_after):
    """Return the goal of a rim vertex: midway, at the height of the mean curvature vector along the rim.

    The 1-simplex formula P = (A + B) / 2 + r tan(phi / 2) m, sin(phi) = r k (sections 3.2 and 4.8), with the curvature
    vectors of the neighbors carried by the smallest rotation between the tangents.
    """

    def bend(a, p, b):
        """Return the unit tangent and the curvature vector (towards p from the chord) of the circle through a, p, b."""
        t = (b - a) / np.linalg.norm(b - a)
        u, v = a - p, b - p
        area2 = np.linalg.norm(np.cross(u, v))
        kappa = 2 * area2 / (np.linalg.norm(u) * np.linalg.norm(v) * np.linalg.norm(b - a))
        out = p - a - ((p - a) @ t) * t
        return t, kappa * out / max(np.linalg.norm(out), 1e-300)

    def carry(vector, source, goal):
        """Rotate a vector by the smallest rotation that takes one unit tangent to the other (Rodrigues)."""
        axis = np.cross(source, goal)
        return vector * (source @ goal) + np.cross(axis, vector) + axis * (axis @ vector) / (1 + source @ goal)

    tangent, own = bend(before, point, after)
    t0, k0 = bend(two_before, before, point)
    t1, k1 = bend(point, after, two_after)
    wanted = own / 2 + (carry(k0, t0, tangent) + carry(k1, t1, tangent)) / 4
    r, kappa = np.linalg.norm(after - before) / 2, np.linalg.norm(wanted)
    phi = math.asin(min(r * kappa, 1.0))
    return (before + after) / 2 + r * math.tan(phi / 2) * wanted / max(kappa, 1e-300)


def trilinear(values, index, outside):
    """Return the trilinear interpolant of a grid at (m, 3) index positions, samples beyond the grid being `outside`."""
    padded = np.pad(np.asarray(values, dtype=float), 1, constant_values=outside)
    at = np.clip(np.asarray(index) + 1, 0, np.array(padded.shape) - 1)
    low = np.minimum(np.floor(at).astype(int), np.array(padded.shape) - 2)
    u = at - low
    out = np.zeros(len(at))
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(np.array(corner), u, 1 - u).prod(axis=1)
        out += weight * padded[tuple((low + corner).T)]
    return out


def isosurface_gap(volume, level, vertex, normal, reach, *, inside="above", samples=20001):
    """Return where the normal line leaves the object, by sampling it finely on the side where it must."""
    sign = 1.0 if inside == "above" else -1.0
    outside = volume.range[0] if inside == "above" else volume.range[1]

    def value(t):
        points = vertex + np.atleast_1d(t)[:, None] * normal
        return sign * (trilinear(volume.values, volume.to_index(points), outside) - level)

    direction = 1.0 if value(0.0)[0] > 0 else -1.0
    t = direction * np.linspace(0, reach, samples)
    f = value(t)
    crossed = np.flatnonzero((f[1:] > 0) != (f[:-1] > 0))
    if not len(crossed):
        return np.nan
    k = crossed[0]
    return t[k] + (t[k + 1] - t[k]) * f[k] / (f[k] - f[k + 1])
