"""Pictures of Earth, orbit and satellite in space."""
