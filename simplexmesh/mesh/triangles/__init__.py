"""Triangulated surfaces: their topology, self-intersections, tunnels, and a tree of closest points."""
