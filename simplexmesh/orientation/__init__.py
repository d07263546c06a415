"""Which side of a surface is outside: one entry point per kind of data.

- `poisson.oriented_indicator`: points of a closed surface without normals. The normals of planes are oriented by the
  `flood` of a grid from its border, then by iterated Poisson reconstruction.
- `poisson.Poisson`: points with normals, by one Poisson reconstruction.
- `propagation.propagated`: points of any surface, also open or thin: signs spread between neighbors.
- `_kernels_consistency.clashing_edges`: whether triangles agree on which side is outward.
"""
