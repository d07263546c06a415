"""The operators T1 to T7 on simplex meshes, one at a time or in batches, and the regularization of face sizes."""
