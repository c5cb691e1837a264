"""The Sun's direction from the currents of a pyramid Sun sensor: as published, all candidates, followed, filtered."""
