"""What a fit may change: names, nominal values, transforms, priors, gauge, null space."""
