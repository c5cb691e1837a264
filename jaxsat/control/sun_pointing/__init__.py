"""Sun pointing."""
