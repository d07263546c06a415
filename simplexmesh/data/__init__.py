"""Chapter II, the data: volumes, point clouds, triangulated surfaces, and the files they come in."""

from simplexmesh import _cache

_cache.ensure()
