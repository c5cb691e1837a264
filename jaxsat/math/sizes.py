"""Sizes of arrays for which programs are compiled."""


def few_sizes(count: int, least: int) -> int:
    """Returns a size not below `count`, of sizes four to an octave: what is alike then shares its programs.

    Sizes are multiples of `least`, a power of two.
    """
    step = max(least, 1 << max(count.bit_length() - 3, 0))
    return -(-count // step) * step
