"""What scenarios of any satellite have in common: the flight that their options say, and cases drawn by its file."""
