"""Sunlight from the Earth: mirrored, scattered, by zones, and what the Earth radiates itself."""
