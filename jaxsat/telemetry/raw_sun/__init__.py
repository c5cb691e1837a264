"""Raw sun."""
