"""Solids whose faces are known in closed form: profiles of lines and arcs, extruded or turned.

The distance to each smooth face is exact. Profiles that go on without a corner make one face: fillets are no creases.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import manifold3d
import numpy as np


@dataclass(frozen=True, eq=False)
class Solid:
    """A profile extruded along z, or turned about it: rows (u, v, bulge = tan(angle / 4) of the arc that follows)."""

    profile: np.ndarray
    height: float | None = None
    pose: np.ndarray = field(default_factory=lambda: np.eye(3, 4))

    @cached_property
    def chains(self):
        """The face that each segment of the profile makes: the same where it goes on without a corner."""
        start, along, bulge = self.profile[:, :2], self.ends - self.profile[:, :2], self.profile[:, 2]
        course, half = np.arctan2(along[:, 1], along[:, 0]), 2 * np.arctan(bulge)
        corner = np.abs(np.angle(np.exp(1j * (course - half - np.roll(course + half, 1))))) > 1e-6
        chains = np.cumsum(corner)
        if not corner[0]:
            chains[chains == chains[-1]] = chains[0]
        axis = (self.height is None) & (start[:, 0] == 0) & (self.ends[:, 0] == 0) & (bulge == 0)
        return np.where(axis, -1, np.unique(chains, return_inverse=True)[1])

    @property
    def ends(self):
        return np.roll(self.profile[:, :2], -1, axis=0)

    @property
    def n_faces(self):
        return self.chains.max() + 1 + 2 * (self.height is not None)

    def kind(self, face):
        """What a face is, in the words of zones."""
        segments = np.flatnonzero(self.chains == face)
        if len(segments) != 1:
            return "free form" if len(segments) else "plane"
        (*p, bulge), q = self.profile[segments[0]], self.ends[segments[0]]
        if self.height is not None:
            return "cylinder" if bulge else "plane"
        if bulge:
            return "sphere" if abs(arc(np.array(p), q, bulge)[0][0]) < 1e-9 else "torus"
        return "cylinder" if p[0] == q[0] else "plane" if p[1] == q[1] else "cone"

    def distance(self, face, points):
        """Signed distances (n,) of points to a face, extended, and their gradients (n, 3)."""
        x, flat = self.local(points)
        top = face - self.chains.max()
        if top > 0:
            away, normals = (x[:, 2] - self.height, [0, 0, 1]) if top == 2 else (-x[:, 2], [0, 0, -1])
            return away, np.broadcast_to(normals, x.shape) @ self.pose[:, :3].T
        radius = np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300)[:, None]
        out = np.concatenate([x[:, :2] / radius, 0 * radius], axis=1)
        _, away, normals = self.flat_distance(np.flatnonzero(self.chains == face), flat)
        if self.height is None:
            normals = normals[:, :1] * out + normals[:, 1:] * [0, 0, 1]
        else:
            normals = np.concatenate([normals, 0 * radius], axis=1)
        return away, normals @ self.pose[:, :3].T

    def local(self, points):
        """Points (n, 3) in the frame of the solid, and (n, 2) in the plane of the profile."""
        x = (points - self.pose[:, 3]) @ self.pose[:, :3]
        return x, x[:, :2] if self.height is not None else np.stack([np.hypot(x[:, 0], x[:, 1]), x[:, 2]], axis=1)

    def flat_distance(self, segments, points):
        """Distances to segments of the profile; signed distances and gradients of the nearest one, extended."""
        best, away, normals = (np.full(points.shape[:n], np.inf) for n in (1, 1, 2))
        for k in segments:
            (p, bulge), q = (self.profile[k, :2], self.profile[k, 2]), self.ends[k]
            if bulge == 0:
                along = (q - p) / np.linalg.norm(q - p)
                normal = np.broadcast_to([along[1], -along[0]], points.shape)
                signed = (points - p) @ normal[0]
                near = p + np.clip((points - p) @ along, 0, np.linalg.norm(q - p))[:, None] * along
            else:
                center, radius, middle = arc(p, q, bulge)
                beyond = np.linalg.norm(points - center, axis=1)
                normal = np.sign(bulge) * (points - center) / np.maximum(beyond, 1e-300)[:, None]
                signed = np.sign(bulge) * (beyond - radius)
                inside = normal @ (middle - center) * np.sign(bulge) >= radius * np.cos(2 * np.arctan(abs(bulge)))
                tip = np.where((((points - p) ** 2).sum(1) < ((points - q) ** 2).sum(1))[:, None], p, q)
                near = np.where(inside[:, None], points - signed[:, None] * normal, tip)
            gap = np.linalg.norm(points - near, axis=1)
            closer = gap < best
            best, away = np.where(closer, gap, best), np.where(closer, signed, away)
            normals = np.where(closer[:, None], normal, normals)
        return best, away, normals

    def signed(self, points):
        """Distances that change their sign at the surface, and are nowhere larger than the true ones."""
        x, flat = self.local(points)
        inside = np.zeros(len(points), bool)
        for k in np.flatnonzero(self.chains >= 0):
            (*p, bulge), q = self.profile[k], self.ends[k]
            cut = (p[1] > flat[:, 1]) != (q[1] > flat[:, 1])
            left = (q[0] - p[0]) * (flat[:, 1] - p[1]) - (q[1] - p[1]) * (flat[:, 0] - p[0])
            inside ^= cut & ((left > 0) == (q[1] > p[1]))
            if bulge:
                center, radius, _ = arc(np.array(p), q, bulge)
                inside ^= (np.linalg.norm(flat - center, axis=1) < radius) & (left * bulge < 0)
        away = self.flat_distance(np.flatnonzero(self.chains >= 0), flat)[0] * np.where(inside, -1, 1)
        return away if self.height is None else np.maximum(away, np.abs(x[:, 2] - self.height / 2) - self.height / 2)

    def outline(self, segments):
        """The profile as a polygon (m, 2) with so many segments to a full circle, and the face of each side."""
        points, face = [], []
        for (*p, bulge), q, chain in zip(self.profile, self.ends, self.chains, strict=True):
            count = max(1, round(segments * abs(4 * np.arctan(bulge)) / (2 * np.pi)))
            at = np.arange(count) / count
            if bulge == 0:
                points.append(np.array([p]))
            else:
                center, _, _ = arc(np.array(p), q, bulge)
                turn = np.exp(4j * np.arctan(bulge) * at) * complex(*(p - center))
                points.append(center + np.stack([turn.real, turn.imag], axis=1))
            face += [chain] * count
        return np.concatenate(points), np.array(face)

    def manifold(self, segments, first):
        """The solid for boolean operations, its faces numbered from `first`."""
        flat, chain = self.outline(segments)
        m, side, turned = len(flat), np.arange(len(flat)), self.height is None
        angle = 2 * np.pi * np.arange(segments if turned else 2) / segments
        place = np.arange(len(angle))[:, None] * m + side
        if turned:
            place[:, flat[:, 0] == 0] = side[flat[:, 0] == 0]
            x = *(flat[:, 0] * np.stack([np.cos(angle), np.sin(angle)])[:, :, None]), flat[:, 1] + 0 * angle[:, None]
        else:
            x = *(flat.T[:, None] + np.zeros((2, 2, 1))), np.array([[0.0], [self.height]]) + np.zeros(m)
        a = place if turned else place[:1]
        b = np.roll(place, -1, axis=0) if turned else place[1:]
        c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
        faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
        faces, ids = faces[:, ::-1] if turned else faces, np.tile(np.tile(chain, len(a)), 2)
        if not turned:
            cap = np.asarray(manifold3d.triangulate([flat]))
            faces = np.concatenate([faces, cap[:, ::-1], cap + m])
            ids = np.concatenate([ids, np.repeat([chain.max() + 1, chain.max() + 2], len(cap))])
        keep = (ids >= 0) & (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        used, faces = np.unique(faces[keep], return_inverse=True)
        vertices = np.stack(x, axis=-1).reshape(-1, 3)[used] @ self.pose[:, :3].T + self.pose[:, 3]
        mesh = manifold3d.Mesh64(
            vertices,
            faces.reshape(-1, 3).astype(np.uint64),
            run_index=np.array([0, faces.size], np.uint64),
            run_original_id=np.array([manifold3d.Manifold.reserve_ids(1)], np.uint32),
            face_id=(first + ids[keep]).astype(np.uint64),
        )
        solid = manifold3d.Manifold(mesh)
        assert solid.status() == manifold3d.Error.NoError
        assert solid.volume() > 0
        return solid


def arc(p, q, bulge):
    """The center, the radius and the middle of the arc from p to q."""
    left = np.array([p[1] - q[1], q[0] - p[0]])
    center = (p + q) / 2 + left * (1 - bulge**2) / (4 * bulge)
    return center, np.linalg.norm(p - center), (p + q) / 2 - left * bulge / 2


def pose(x=0.0, y=0.0, z=0.0, axis=(0, 0, 1)):
    """The pose that moves the origin to a point, and the z-axis into a direction."""
    w = np.array(axis, float) / np.linalg.norm(axis)
    u = np.cross([0, 1, 0] if abs(w[1]) < 0.9 else [0, 0, 1], w)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(w, u), w, [x, y, z]], axis=1)


def profile(*points, radii=()):
    """A profile of straight sides, its corners rounded: pairs (corner, radius)."""
    points, rows, radii = np.array(points, float), [], dict(radii)
    for k, at in enumerate(points):
        if k not in radii:
            rows.append([*at, 0.0])
            continue
        sides = at - points[k - 1], points[(k + 1) % len(points)] - at
        before, after = (side / np.linalg.norm(side) for side in sides)
        turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
        back = radii[k] * abs(np.tan(turn / 2))
        rows += [[*(at - back * before), np.tan(turn / 4)], [*(at + back * after), 0.0]]
    return np.array(rows)


def rod(radius, start, end, where=None):
    side = profile((0, start), (radius, start), (radius, end), (0, end))
    return Solid(side, None, pose() if where is None else where)


def ball(radius, center):
    return Solid(np.array([[0, -radius, 1], [0, radius, 0]]), None, pose(*center))


def box(low, high):
    (a, b, c), (d, e, f) = low, high
    return Solid(profile((a, b), (d, b), (d, e), (a, e)), f - c, pose(0, 0, c))
