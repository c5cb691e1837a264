"""Sweeps in single precision: the same draws as in double precision, and what the rounding does, case by case."""
