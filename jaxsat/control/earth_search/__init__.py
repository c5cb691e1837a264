"""Earth search."""
