"""What a fit leaves behind: its documents, tables, pictures, page, and how they are read back."""
