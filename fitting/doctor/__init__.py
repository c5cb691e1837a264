"""What may be wrong with data that no minimum explains: the usual causes, tried by short refits."""
