"""Sharp edges and zones of digitized parts."""
