"""What may be wrong, a kind a file: each is a function of the bench that answers trials."""
