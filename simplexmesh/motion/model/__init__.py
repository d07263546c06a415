"""The deformable model: forces, parameters, the boundary, coarse-to-fine motion, untangling."""
