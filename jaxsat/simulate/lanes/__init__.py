"""Motions with hysteresis rods: each in a lane with steps of its own, which end where the field along a rod turns."""
