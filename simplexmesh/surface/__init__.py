"""Chapter V, the surface: normals, curvature, saliency, regions and landmarks, measured on unprocessed scans."""

from __future__ import annotations

import os

from simplexmesh import _cache

_cache.ensure()
os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # waiting threads sleep: see `_kernels_both`
