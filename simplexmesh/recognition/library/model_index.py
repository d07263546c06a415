"""Index of the models of a library in memory: comparison with a scan by descriptors, without poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.recognition.library import _kernels_descriptors
from simplexmesh.recognition.library.global_descriptor import DESCRIPTOR_SIZE
from simplexmesh.recognition.library.models import Model
from simplexmesh.recognition.library.spin_images import PIXELS

COMPONENTS = 32
"""Number of principal components in which images are compared: more take longer, and tell them hardly better apart."""

KEPT_FRACTION = 0.7
"""Fraction of a scan's images that must be found in a model; others may be cut by the border of the scan."""


@dataclass
class ModelIndex:
    """Models in memory, and their names, by identity in the store and in the order in which they were added."""

    models: dict[int, Model] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    _descriptors: NDArray[np.float32] | None = None
    _image_indices: dict[int, ImageIndex] = field(default_factory=dict)

    def updated(self, names: list[tuple[int, str]], data: dict[int, bytes]) -> ModelIndex:
        """Return an index of all `names` by identity, with the packed models that are new; this one stays valid."""
        models = self.models | {identity: Model.unpacked(packed) for identity, packed in data.items()}
        return ModelIndex({identity: models[identity] for identity, _ in names}, dict(names))

    def descriptor_distances(self, descriptor: Array) -> Array:
        """Return the distances (m,) between the global descriptors of a scan and of each model."""
        if self._descriptors is None:
            rows = [model.descriptor for model in self.models.values()]
            self._descriptors = np.array(rows).reshape(-1, DESCRIPTOR_SIZE)
        return np.asarray(np.linalg.norm(self._descriptors - descriptor.astype(np.float32), axis=1), np.float64)

    def image_index(self, octave: int) -> ImageIndex:
        """Return the index of all models' images at the radius ``2**octave`` and at twice that; cached."""
        if octave not in self._image_indices:
            self._image_indices[octave] = ImageIndex.of(list(self.models.values()), octave)
        return self._image_indices[octave]

    def image_distances(self, images: NDArray[np.float32], octave: int) -> Array:
        """Return mean distances (m,) of most of a scan's images to the nearest of each model (Boiman et al. 2008)."""
        index = self.image_index(octave)
        distances = np.sqrt(np.maximum(index.nearest(images), 0.0))
        out = np.full(len(self.models), np.inf)
        kept = max(1, int(KEPT_FRACTION * len(images)))
        out[index.which] = np.sort(distances, axis=1)[:, :kept].mean(axis=1)
        return out


@dataclass(frozen=True, eq=False)
class ImageIndex:
    """The images of all models at a radius and at twice that, in their principal components."""

    which: Indices  # (m,) the models that have such images
    starts: Indices  # (m + 1,) offsets of their rows
    mean: NDArray[np.float32]  # (2 PIXELS,)
    basis: NDArray[np.float32]  # (2 PIXELS, COMPONENTS)
    rows: NDArray[np.float32]  # (n, COMPONENTS)
    squares: NDArray[np.float32]  # (n,) squared norms of the rows

    @staticmethod
    def of(models: list[Model], octave: int) -> ImageIndex:
        """Return the index of the images of models at an octave."""
        which = [k for k, model in enumerate(models) if model.spin_images.has(octave)]
        parts = [models[k].spin_images.at(octave) for k in which]
        pixels = np.vstack([np.zeros((0, 2 * PIXELS), np.float32), *parts])
        mean = pixels.mean(axis=0) if parts else np.zeros(2 * PIXELS, np.float32)
        pixels -= mean
        basis = np.linalg.eigh(pixels.T @ pixels)[1][:, ::-1][:, :COMPONENTS]
        rows = np.ascontiguousarray(pixels @ basis)
        starts = np.cumsum([0, *map(len, parts)])
        return ImageIndex(np.array(which, np.int64), starts, mean, basis, rows, np.einsum("ij,ij->i", rows, rows))

    def reduced(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the principal components (k, COMPONENTS) of images (k, 2 PIXELS)."""
        return np.einsum("ij,jd->id", images - self.mean, self.basis)

    def nearest(self, images: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the squared distances (m, k) of images (k, 2 PIXELS) to the nearest of each model."""
        queries = self.reduced(images)
        out = np.full((len(self.which), len(images)), np.inf, np.float32)
        _kernels_descriptors.nearest(
            len(self.starts) - 1, self.rows, self.squares, self.starts, np.ascontiguousarray(queries.T), out
        )
        return out + np.einsum("ij,ij->i", queries, queries)

    def spans(self, models: Indices) -> Indices:
        """Return the row ranges (k, 2) of some models; empty for those without images."""
        position = np.minimum(np.searchsorted(self.which, models), max(len(self.which) - 1, 0))
        has = self.which[position] == models if len(self.which) else np.zeros(len(models), bool)
        return np.where(has[:, None], np.stack([self.starts[position], self.starts[position + has]], axis=1), 0)
