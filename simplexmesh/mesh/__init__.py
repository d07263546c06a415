"""Chapter I, the mesh: connectivity, geometry, duality, shapes."""

from simplexmesh import _cache

_cache.ensure()
