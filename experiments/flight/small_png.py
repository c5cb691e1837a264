"""PNG of few colours, small enough to stand in a repository."""

import io

from matplotlib.figure import Figure
from PIL import Image

from jaxsat.plotting.style import png_bytes

COLOURS = 64


def small_png(figure: Figure) -> bytes:
    """The figure as a PNG with a palette."""
    image = Image.open(io.BytesIO(png_bytes(figure))).convert("RGB").quantize(COLOURS)
    buffer = io.BytesIO()
    image.save(buffer, format="png", optimize=True)
    return buffer.getvalue()
