"""Chapter IV, the recognition: shape signatures, registration, occlusion, libraries of models."""

from __future__ import annotations

from simplexmesh import _cache

_cache.ensure()
