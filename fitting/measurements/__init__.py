"""What a fit is given: samples with their surroundings, the padded problem made of them, residuals in blocks."""
