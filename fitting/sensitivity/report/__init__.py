"""What a sensitivity is written as: JSON, tables, pictures, a page."""
