"""First attitudes and rates, growing arcs, many starts at once."""
