"""Several scans of one object: their poses, and the reconstruction from them."""
