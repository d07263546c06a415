"""The axis of a pipe traced through a cloud from a pick, and cut into straights and bends."""
