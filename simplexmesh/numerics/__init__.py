"""What every room computes with: small matrices, local fits, rigid motions, trees, heap.

Fits that serve one purpose stay with it: the robust quadric of surfels with Tukey weights in `motion.targets.surfels`,
jets and quadrics of curvature in `surface.curvature`.
"""
