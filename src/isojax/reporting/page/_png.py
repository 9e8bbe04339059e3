"""A figure as a PNG file."""

from io import BytesIO

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

_DOTS_PER_INCH = 170


def png_bytes(figure: Figure) -> bytes:
    """Give a figure as the content of a PNG file.

    `Figure.savefig` would lay the figure out in one drawing and make the picture in a second.

    Args:
        figure: the figure.

    Returns:
        The content.
    """
    buffer = BytesIO()
    figure.set_dpi(_DOTS_PER_INCH)
    FigureCanvasAgg(figure).print_png(buffer)
    return buffer.getvalue()
