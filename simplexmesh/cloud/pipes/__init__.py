"""Pipe lines: followed from a pick, or all of a plant; straights and bends tangent by construction."""
