"""What the JSON files of a fit hold, for whoever reads them back."""
