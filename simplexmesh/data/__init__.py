"""Chapter II, the data: volumes, point clouds, triangle meshes, and the conversions to them."""
