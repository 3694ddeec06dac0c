import numpy as np
import pytest

from videos.sheet import sheet

COLORS = [(200, 0, 0), (0, 200, 0), (0, 0, 200), (200, 0, 200)]


def patch(color, height=60, width=80):
    return np.full((height, width, 3), color, np.uint8)


def box(image, color):
    """Rows and columns, inclusive, that a flat colour covers; fails if it is not one full rectangle."""
    rows, columns = np.nonzero((image == color).all(2))
    top, bottom, left, right = rows.min(), rows.max(), columns.min(), columns.max()
    assert len(rows) == (bottom - top + 1) * (right - left + 1)
    return top, bottom, left, right


def test_labels_stand_above_their_own_image():
    image = patch(COLORS[0], width=120)
    plain = sheet([[image, patch(COLORS[1], width=120)]], [""], ["one", ""])
    top, _, left, right = box(plain, COLORS[0])
    ink = np.nonzero((plain[:top] < 128).all(2))[1]
    assert left <= ink.min()
    assert ink.max() <= right


def test_a_label_wider_than_its_image_is_written_smaller():
    out = sheet([[patch(COLORS[0]), patch(COLORS[1])]], [""], ["a label of many, many, many words", ""])
    top, _, _, right = box(out, COLORS[0])
    assert np.nonzero((out[:top] < 128).all(2))[1].max() <= right + 2


def test_a_sheet_puts_rows_below_each_other_and_columns_beside():
    rows = [[patch(COLORS[0]), patch(COLORS[1])], [patch(COLORS[2]), patch(COLORS[3])]]
    out = sheet(rows, ["walk-run", "cv"], ["frame 1", "frame 2"])
    a, b, c, d = (box(out, color) for color in COLORS)
    assert a[:2] == b[:2]
    assert c[:2] == d[:2]
    assert a[2:] == c[2:]
    assert b[2:] == d[2:]
    assert c[0] > a[1]
    assert (out[a[0] : a[1], : a[2]] < 128).any()  # the row's label, left of it
    assert (out[: a[0], b[2] : b[3]] < 128).any()  # the column's label, on top


def test_smaller_images_are_centred_and_short_rows_leave_white():
    out = sheet([[patch(COLORS[0]), patch(COLORS[1])], [patch(COLORS[2], 60, 40)]], ["", ""], ["", ""])
    a, b, c = (box(out, color) for color in COLORS[:3])
    assert (c[2] + c[3]) == (a[2] + a[3])
    assert (out[c[0] :, b[2] :] == 255).all()


def test_without_labels_only_margins_are_added():
    out = sheet([[patch(COLORS[0])]], [""], [""])
    top, bottom, left, right = box(out, COLORS[0])
    assert top == left == out.shape[0] - 1 - bottom == out.shape[1] - 1 - right
    assert top > 0


def test_a_row_label_may_have_two_lines():
    one = sheet([[patch(COLORS[0])]], ["lost at 57"], [""])
    two = sheet([[patch(COLORS[0])]], ["cv\nlost at 57"], [""])
    assert one.shape == two.shape
    assert (two < 128).all(2).sum() > (one < 128).all(2).sum()


def test_images_stay_as_they_are():
    image = patch(COLORS[0])
    image.setflags(write=False)
    sheet([[image]], ["a"], ["b"])
    assert (image == COLORS[0]).all()


def test_numbers_of_labels_must_match():
    with pytest.raises(ValueError, match="2 columns needs as many column labels; 1 came"):
        sheet([[patch(COLORS[0])] * 2], [""], ["one"])
    with pytest.raises(ValueError, match="1 rows needs as many row labels; 2 came"):
        sheet([[patch(COLORS[0])]], ["a", "b"], [""])


@pytest.mark.parametrize("rows", [[], [[]]])
def test_a_sheet_of_nothing_is_an_error(rows):
    with pytest.raises(ValueError, match="at least one image"):
        sheet(rows, [""] * len(rows), [])
