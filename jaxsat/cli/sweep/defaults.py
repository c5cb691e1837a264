"""What a sweep takes where neither the command line nor its directory says anything."""

CASES, SEED = 1000, 0
