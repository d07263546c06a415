"""Where a motion starts: a closed mesh of the right topology within a few cells of the data."""
