"""Extraction of primitives from clouds: patches, growth, bends between pipes, joint labels."""
