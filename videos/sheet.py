"""A sheet of frames in rows and columns, with labels."""

from collections.abc import Sequence

import numpy as np

from videos.frames import Image
from videos.overlay import Color, fitted, put_text, text_size

GROUND: Color = (255, 255, 255)
INK: Color = (30, 30, 30)


def sheet(rows: Sequence[Sequence[Image]], row_labels: Sequence[str], column_labels: Sequence[str]) -> Image:
    r"""A grid of images on white, labels on top of the columns and left of the rows.

    Each column is as wide as its widest image and each row as high as its highest; smaller images
    are centred. Labels too long for their column are written smaller. A row may be shorter than the others.

    Args:
        rows: at least one image, each (H, W, 3) uint8 RGB.
        row_labels: one for each row; "\\n" starts another line. No room is taken if all are empty.
        column_labels: one line for each column. No room is taken if all are empty.

    Raises:
        ValueError: no images, or a number of labels that does not match.
    """
    columns = max((len(row) for row in rows), default=0)
    if columns == 0:
        raise ValueError("a sheet needs at least one image")
    if len(row_labels) != len(rows):
        raise ValueError(f"a sheet of {len(rows)} rows needs as many row labels; {len(row_labels)} came")
    if len(column_labels) != columns:
        raise ValueError(
            f"a sheet of {columns} columns needs as many column labels; {len(column_labels)} came"
        )

    widths = [max(row[k].shape[1] for row in rows if k < len(row)) for k in range(columns)]
    heights = [max((image.shape[0] for image in row), default=0) for row in rows]
    size = max(9.0, max(heights) / 26)
    gap = max(4, round(0.6 * size))

    top = round(2.2 * size) if any(column_labels) else gap
    lines = [label.split("\n") for label in row_labels]
    widest = max(text_size(line, size)[0] for label in lines for line in label)
    left = widest + 2 * gap if any(row_labels) else gap

    xs = left + np.cumsum([0, *(width + gap for width in widths)])
    ys = top + np.cumsum([0, *(height + gap for height in heights)])
    canvas = np.full((ys[-1], xs[-1], 3), GROUND, np.uint8)
    # One size for all column labels: the one at which the tightest fits.
    fit = min(fitted([label], size, width) for label, width in zip(column_labels, widths, strict=True))
    for label, x in zip(column_labels, xs[:-1], strict=True):
        put_text(canvas, label, x, top - 0.6 * size, fit, INK)
    for label_lines, y, height in zip(lines, ys[:-1], heights, strict=True):
        base = y + height / 2 + size / 2 - 0.9 * size * (len(label_lines) - 1)
        for number, line in enumerate(label_lines):
            put_text(canvas, line, gap, base + 1.8 * size * number, size, INK)
    for row, y, height in zip(rows, ys[:-1], heights, strict=True):
        for image, x, width in zip(row, xs, widths, strict=False):
            h, w = image.shape[:2]
            down, right = (height - h) // 2, (width - w) // 2
            canvas[y + down : y + down + h, x + right : x + right + w] = image
    return canvas
