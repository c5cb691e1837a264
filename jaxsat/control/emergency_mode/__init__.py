"""Emergency mode."""
