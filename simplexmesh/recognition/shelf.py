"""All models of a library in memory, and which of them a scan may be of, before any pose is known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_library
from simplexmesh.recognition.bags import PIXELS
from simplexmesh.recognition.models import Model
from simplexmesh.recognition.profile import SIZES

Array = NDArray[np.float64]

DIRECTIONS = 32
"""Images are compared in so many directions."""

TRIMMED = 0.7
"""The share of a scan's images that are looked for in a model; others may be cut by the border of what was seen."""


@dataclass
class Shelf:
    """Models in memory.

    Attributes
    ----------
    models : dict of int to Model
        By their identities in the store.
    names : dict of int to str
        In the order in which they were added.
    """

    models: dict[int, Model] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    _profiles: NDArray[np.float32] | None = None
    _octaves: dict[int, Images] = field(default_factory=dict)

    def updated(self, names: list[tuple[int, str]], data: dict[int, bytes]) -> Shelf:
        """Return a shelf with what was added and without what was removed; others may go on with this one.

        Raises
        ------
        ValueError
            Data that is not a model.
        """
        models = self.models | {number: Model.unpacked(packed) for number, packed in data.items()}
        return Shelf({number: models[number] for number, _ in names}, dict(names))

    @property
    def numbers(self) -> list[int]:
        """The identities of all models, in order."""
        return list(self.names)

    def by_profile(self, profile: Array) -> Array:
        """Return (m,) how much the profile of each model differs from that of a scan."""
        if self._profiles is None:
            self._profiles = np.array([model.profile for model in self.models.values()]).reshape(-1, SIZES)
        return np.asarray(np.linalg.norm(self._profiles - profile.astype(np.float32), axis=1), np.float64)

    def images(self, octave: int) -> Images:
        """Return the images of all models at one radius and twice that."""
        if octave not in self._octaves:
            self._octaves[octave] = Images.of(list(self.models.values()), octave)
        return self._octaves[octave]

    def by_images(self, images: NDArray[np.float32], octave: int) -> Array:
        """Return (m,) how much images of a scan differ from the likest of each model; infinite where it has none.

        The mean distance over most of them (O. Boiman, E. Shechtman, M. Irani, In defense of nearest-neighbor based
        image classification, 2008).
        """
        there = self.images(octave)
        distances = np.sqrt(np.maximum(there.nearest(images), 0.0))
        out = np.full(len(self.models), np.inf)
        kept = max(1, int(TRIMMED * len(images)))
        out[there.which] = np.sort(distances, axis=1)[:, :kept].mean(axis=1)
        return out


@dataclass(frozen=True, eq=False)
class Images:
    """The images of all models at one radius and twice that, in the few directions in which they differ most.

    Attributes
    ----------
    which : (m,) array of int
        The models that have them.
    starts : (m + 1,) array of int
        Where the rows of each begin.
    mean : (2 PIXELS,) array of float32
    basis : (2 PIXELS, DIRECTIONS) array of float32
    rows : (n, DIRECTIONS) array of float32
    squares : (n,) array of float32
        Of the rows.
    """

    which: NDArray[np.int64]
    starts: NDArray[np.int64]
    mean: NDArray[np.float32]
    basis: NDArray[np.float32]
    rows: NDArray[np.float32]
    squares: NDArray[np.float32]

    @staticmethod
    def of(models: list[Model], octave: int) -> Images:
        """Return the images of models."""
        which = [k for k, model in enumerate(models) if model.bag.has(octave)]
        parts = [models[k].bag.at(octave) for k in which]
        whole = np.vstack([np.zeros((0, 2 * PIXELS), np.float32), *parts])
        mean = whole.mean(axis=0) if parts else np.zeros(2 * PIXELS, np.float32)
        whole -= mean
        basis = np.linalg.eigh(whole.T @ whole)[1][:, ::-1][:, :DIRECTIONS]
        rows = np.ascontiguousarray(whole @ basis)
        starts = np.cumsum([0, *map(len, parts)])
        return Images(np.array(which, np.int64), starts, mean, basis, rows, np.einsum("ij,ij->i", rows, rows))

    def reduced(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return images (k, 2 PIXELS) in these directions."""
        return np.einsum("ij,jd->id", images - self.mean, self.basis)

    def nearest(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (m, k) the squared distance of each of k images to the nearest of each model."""
        asked = self.reduced(images)
        out = np.full((len(self.which), len(images)), np.inf, np.float32)
        _kernels_library.nearest(self.rows, self.squares, self.starts, np.ascontiguousarray(asked.T), out)
        return out + np.einsum("ij,ij->i", asked, asked)

    def spans(self, models: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return (k, 2) where the rows of some models begin and end; an empty span for those that have none."""
        place = np.minimum(np.searchsorted(self.which, models), max(len(self.which) - 1, 0))
        has = self.which[place] == models if len(self.which) else np.zeros(len(models), bool)
        return np.where(has[:, None], np.stack([self.starts[place], self.starts[place + has]], axis=1), 0)
