"""Sigmas over many starts that are drawn."""
