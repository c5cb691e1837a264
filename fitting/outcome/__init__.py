"""What comes of a fit: result, uncertainty, diagnostics, profiles, posterior draws."""
