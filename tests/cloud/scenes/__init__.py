"""Clouds of plants and pipe lines with their exact shapes, as sampled evenly or by scanners, and how finds score."""
