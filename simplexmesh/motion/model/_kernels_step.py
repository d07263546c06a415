"""Kernels of one iteration of a deformable simplex mesh: local frames, simplex angles and position updates."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array, Indices32

FREE, ORIENTATION, ANGLE, MEAN_CURVATURE, SHAPE, CURVATURE = range(6)


class Frames(NamedTuple):
    """Local frames of the vertices, from the circumcircle of their neighbors (thesis, section 3)."""

    normals: Array  # (n, 3) unit normals; zero where the neighbors are collinear
    inverse_radius: Array  # (n,) 1 / circumradius
    curvature: Array  # (n,) H
    area: Array  # (n,) of the neighbors' triangle
    obtuse: NDArray[np.int8]  # (n,) sign of the simplex angle where it is beyond pi/2, which H does not tell; else 0


class Moving(NamedTuple):
    """A mesh in motion."""

    vertices: Array  # (n, 3)
    previous: Array  # (n, 3) positions before the last step
    neighbors: Indices32  # (n, 3)
    metric: Array  # (n, 3) reference metric parameters


class Forces(NamedTuple):
    """The weights of the law of motion, and the distances to the data."""

    alpha: Array  # (n,) weight of the internal force
    beta: Array  # (n,) weight of the data force
    damping: Array  # (n,)
    gaps: Array  # (n,) distance to the data along the normal, NaN where there is none within reach


class Wanted(NamedTuple):
    """What the constraints want, and displacements by other forces."""

    curvature: Array  # (n,)
    angle: Array  # (n,)
    extra: Array  # (n, 3) displacements


class Step(NamedTuple):
    """The results of one iteration."""

    positions: Array  # (n, 3)
    moves: Array  # (n,) squared displacements
    energy: Array  # (n,)


@by_rows(fastmath=FAST)
def frames(begin, end, vertices, neighbors, normals, inverse_radius, curvature, area, obtuse):
    """Fill the arrays of `Frames`."""
    for i in range(begin, end):
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
        vx, vy, vz = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
        px, py, pz = vertices[i, 0] - ax, vertices[i, 1] - ay, vertices[i, 2] - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
        nn = nx * nx + ny * ny + nz * nz
        if nn <= 1e-24 * uu * vv or nn == 0.0:  # collinear neighbors define no normal: such a vertex counts as flat
            normals[i, 0] = normals[i, 1] = normals[i, 2] = 0.0
            inverse_radius[i] = 0.0
            curvature[i] = 0.0
            area[i] = 0.0
            obtuse[i] = 0
            continue
        double = math.sqrt(nn)
        area[i] = 0.5 * double
        inverse = 1.0 / double
        nx *= inverse
        ny *= inverse
        nz *= inverse
        # the circumcenter, from A, is s u + t v
        s, t = 0.5 * vv * (uu - uv) / nn, 0.5 * uu * (vv - uv) / nn
        h = px * nx + py * ny + pz * nz
        dx, dy, dz = s * ux + t * vx, s * uy + t * vy, s * uz + t * vz
        rr = dx * dx + dy * dy + dz * dz
        power = px * px + py * py + pz * pz - 2.0 * (px * dx + py * dy + pz * dz)  # d^2 + h^2 - r^2
        normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz
        inverse_radius[i] = 1.0 / math.sqrt(rr)
        size = math.sqrt(4.0 * h * h * rr + power * power)
        curvature[i] = 2.0 * h / size if size > 0.0 else 0.0  # a vertex on its neighbors' circle: coincident points
        obtuse[i] = 0 if power <= 0.0 else 1 if h > 0.0 else -1


@by_rows(fastmath=FAST)
def angles(begin, end, vertices, neighbors, normals, inverse_radius, out):
    """Fill the simplex angle of each vertex, in (-pi, pi], given its frame from `frames`."""
    for i in range(begin, end):
        if inverse_radius[i] == 0.0:
            out[i] = 0.0
            continue
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        p2 = h = 0.0
        uu = vv = uv = pu = pv = 0.0
        for k in range(3):
            p, u, v = (
                vertices[i, k] - vertices[a, k],
                vertices[b, k] - vertices[a, k],
                vertices[c, k] - vertices[a, k],
            )
            p2 += p * p
            h += p * normals[i, k]
            uu += u * u
            vv += v * v
            uv += u * v
            pu += p * u
            pv += p * v
        nn = uu * vv - uv * uv
        power = p2 - (vv * (uu - uv) * pu + uu * (vv - uv) * pv) / nn
        out[i] = math.atan2(2.0 * h / inverse_radius[i], -power)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def advance(i, moving, normals, force, push, reach, forces, out):
    """Fill `Step` row i from the internal `force`, inertia, the data force and `push`, limited to half of `reach`."""
    vertices, previous, neighbors = moving.vertices, moving.previous, moving.neighbors
    alpha, beta, gap = forces.alpha[i], forces.beta[i], forces.gaps[i]
    fx, fy, fz = force
    energy_i = fx * fx + fy * fy + fz * fz
    fx *= alpha
    fy *= alpha
    fz *= alpha
    nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
    a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
    agreement = (
        nx * (normals[a, 0] + normals[b, 0] + normals[c, 0])
        + ny * (normals[a, 1] + normals[b, 1] + normals[c, 1])
        + nz * (normals[a, 2] + normals[b, 2] + normals[c, 2])
    )
    energy_i *= alpha
    if gap == gap and agreement > 0.0:  # NaN: no data within reach; a folded vertex gets no data force
        energy_i += beta * gap * gap
        fx += beta * gap * nx
        fy += beta * gap * ny
        fz += beta * gap * nz
    keep = 1.0 - forces.damping[i]
    sx = keep * (vertices[i, 0] - previous[i, 0]) + fx + push[0]
    sy = keep * (vertices[i, 1] - previous[i, 1]) + fy + push[1]
    sz = keep * (vertices[i, 2] - previous[i, 2]) + fz + push[2]
    step2 = sx * sx + sy * sy + sz * sz
    limit = 0.5 * reach
    if limit * limit < step2 < math.inf:  # an infinite step stays infinite, so that the caller detects divergence
        shrink = limit / math.sqrt(step2)
        sx *= shrink
        sy *= shrink
        sz *= shrink
        step2 = limit * limit
    out.positions[i, 0] = vertices[i, 0] + sx
    out.positions[i, 1] = vertices[i, 1] + sy
    out.positions[i, 2] = vertices[i, 2] + sz
    out.moves[i] = step2
    out.energy[i] = 0.5 * energy_i


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _obtuse_neighborhood(obtuse, i, a, b, c, wanted):
    """Return whether a vertex and its neighbors all have angles beyond pi/2 of the sign of the wanted curvature."""
    return obtuse[a] == obtuse[i] and obtuse[b] == obtuse[i] and obtuse[c] == obtuse[i] and wanted * obtuse[i] > 0.0


@by_rows(fastmath=FAST)
def curvature_step(begin, end, wanted_curvature, moving, frames, forces, out):
    """Fill a `Step` in which every vertex has a wanted mean curvature: the common case."""
    vertices, neighbors, metric = moving.vertices, moving.neighbors, moving.metric
    normals, inverse_radius, obtuse = frames.normals, frames.inverse_radius, frames.obtuse
    for i in range(begin, end):
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        e2, e3 = metric[i, 1], metric[i, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
        vx, vy, vz = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
        px, py, pz = vertices[i, 0] - ax, vertices[i, 1] - ay, vertices[i, 2] - az
        uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
        # r^2 - d*^2, minus the power of the reference point in the circumcircle, from its metric parameters
        inside = metric[i, 0] * (e2 * uu + e3 * vv) + e2 * e3 * (uu + vv - 2.0 * uv)
        inside = max(inside, 0.0)
        wanted = wanted_curvature[i]
        limit = inverse_radius[i]
        wanted = min(max(wanted, -limit), limit)
        sine = wanted / limit if limit > 0.0 else 0.0
        cosine2 = max(1.0 - sine * sine, 0.0)
        divisor = math.sqrt(cosine2) + math.sqrt(cosine2 + inside * wanted * wanted)
        height = inside * wanted / divisor if divisor > 0.0 else 0.0
        if obtuse[i] != 0 and _obtuse_neighborhood(obtuse, i, a, b, c, wanted):
            height = divisor / wanted
        reach = math.sqrt((3.0 * (px * px + py * py + pz * pz) + uu + vv
                           - 2.0 * (px * (ux + vx) + py * (uy + vy) + pz * (uz + vz))) / 3.0)  # fmt: skip
        height = min(max(height, -reach), reach)
        force = (
            e2 * ux + e3 * vx + height * normals[i, 0] - px,
            e2 * uy + e3 * vy + height * normals[i, 1] - py,
            e2 * uz + e3 * vz + height * normals[i, 2] - pz,
        )
        advance(i, moving, normals, force, (0.0, 0.0, 0.0), reach, forces, out)


@by_rows(fastmath=FAST)
def constrained_step(begin, end, constraint, moving, frames, wanted, forces, out):
    """Fill a `Step`, each vertex under its own constraint (n,) and displaced by other forces."""
    vertices, neighbors, metric = moving.vertices, moving.neighbors, moving.metric
    normals, inverse_radius, obtuse = frames.normals, frames.inverse_radius, frames.obtuse
    wanted_curvature, wanted_angle, extra = wanted.curvature, wanted.angle, wanted.extra
    for i in range(begin, end):
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        e1, e2, e3 = metric[i, 0], metric[i, 1], metric[i, 2]
        uu = vv = uv = pp = pu = pv = h = 0.0
        for k in range(3):
            u, v, p = (
                vertices[b, k] - vertices[a, k],
                vertices[c, k] - vertices[a, k],
                vertices[i, k] - vertices[a, k],
            )
            uu += u * u
            vv += v * v
            uv += u * v
            pp += p * p
            pu += p * u
            pv += p * v
            h += p * normals[i, k]
        inside = e1 * (e2 * uu + e3 * vv) + e2 * e3 * (uu + vv - 2.0 * uv)
        reach = math.sqrt((3.0 * pp + uu + vv - 2.0 * (pu + pv)) / 3.0)
        kind = constraint[i]
        height = 0.0
        if inverse_radius[i] > 0.0 and kind != ORIENTATION:
            r = 1.0 / inverse_radius[i]
            if kind == FREE:
                power = pp - (vv * (uu - uv) * pu + uu * (vv - uv) * pv) / (uu * vv - uv * uv)
                size = math.sqrt(4.0 * h * h * r * r + power * power)
                sine, cosine = (2.0 * h * r / size, -power / size) if size > 0.0 else (0.0, 1.0)
            elif kind in (ANGLE, SHAPE):
                sine, cosine = math.sin(wanted_angle[i]), math.cos(wanted_angle[i])
            else:
                sine = min(max(r * wanted_curvature[i], -1.0), 1.0)
                cosine = math.sqrt(max(1.0 - sine * sine, 0.0))
                if obtuse[i] != 0 and _obtuse_neighborhood(obtuse, i, a, b, c, wanted_curvature[i]):
                    cosine = -cosine
            if cosine >= 0.0:  # no height exists below pi/2 for a reference point outside the circle
                inside = max(inside, 0.0)
            q = math.sqrt(max(r * r * cosine * cosine + inside * sine * sine, 0.0))
            if cosine >= 0.0:
                divisor = r * cosine + q
                height = inside * sine / divisor if divisor > 0.0 else 0.0
            else:
                height = (q - r * cosine) / sine if sine != 0.0 else reach
        height = min(max(height, -reach), reach)
        force = (
            e1 * vertices[a, 0] + e2 * vertices[b, 0] + e3 * vertices[c, 0] + height * normals[i, 0] - vertices[i, 0],
            e1 * vertices[a, 1] + e2 * vertices[b, 1] + e3 * vertices[c, 1] + height * normals[i, 1] - vertices[i, 1],
            e1 * vertices[a, 2] + e2 * vertices[b, 2] + e3 * vertices[c, 2] + height * normals[i, 2] - vertices[i, 2],
        )
        push = (extra[i, 0], extra[i, 1], extra[i, 2])
        advance(i, moving, normals, force, push, reach, forces, out)
