"""What a fit of any satellite leaves behind: its document, a table and a picture of each channel, its page."""
