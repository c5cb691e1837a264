"""What may be turned at a scenario: gains, limits and masses of which a mean is differentiated."""
