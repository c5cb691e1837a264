"""Synthetic sessions: telemetry made by the simulator, with its truth (the program `Orfs`)."""
