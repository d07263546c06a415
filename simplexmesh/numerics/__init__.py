"""What every room computes with.

Python, on arrays:

- `kd_tree`: nearest points, for use in kernels too; scipy's tree where Python suffices
- `blending`: weighted means of rows of numbers, colors or labels
- `plane_fits`: planes through the nearest neighbors of points, their spacing and noise
- `rigid`, `rotation_vectors`: rigid motions between corresponding points, with robust weights (Geman-McClure)
- `constrained_least_squares`: linear least squares with inequality constraints

Kernels, in files named `_kernels_*`:

- `vectors`, `frames`: 3-vectors as tuples, tangents of a normal
- `matrices`: Cholesky, Jacobi eigenvectors, Givens rotations
- `local_fits`: planes, also weighted by distance, and quadrics through the neighbors of points
- `tree`, `balls`, `heap`: nearest points and points within a radius, a grid for one radius, a priority queue

Fits that serve one purpose stay with it: the robust quadric of surfels with Tukey weights in `motion.targets.surfels`,
jets and quadrics of curvature in `surface.curvature`.
"""
