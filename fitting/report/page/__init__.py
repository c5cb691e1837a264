"""The page of a fit: what it says first, its sections, the numbers that its script draws."""
