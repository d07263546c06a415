"""Chapter IV, the recognition: shape signatures on the sphere and how they are compared."""

from __future__ import annotations

from simplexmesh import _cache

_cache.ensure()
