import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from videos.overlay import FAR, NEAR, TRUNK, Ellipse, Segment, draw, put_text

GREY = 128


def ground():
    return np.full((120, 160, 3), GREY, np.uint8)


def pixels_like(image, color):
    """(n, 2) pixels x, y whose colour is near `color`."""
    rows, columns = np.nonzero(np.abs(image.astype(int) - color).sum(2) < 60)
    return np.column_stack([columns, rows])


def linear(color):
    """RGB to linear light, by the sRGB curve."""
    c = np.array(color) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def seen_by_dichromats(color):
    """(3, 2) what is left of a colour: red-green and blue-yellow axes each lost in turn, and lightness."""
    # Long, middle and short cones from linear RGB, Vienot, Brettel and Mollon (1999).
    cones = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.02996, 0.18431, 1.46709]])
    response = cones @ linear(color)
    return np.array([np.delete(response / cones.sum(1), lost) for lost in range(3)])


def test_drawing_leaves_the_frame_itself_alone():
    image = ground()
    image.setflags(write=False)
    out = draw(image, [Segment((10, 10), (100, 80), NEAR)], [Ellipse((50, 50), np.eye(2), FAR)], "frame 3")
    assert (image == GREY).all()
    assert (out != GREY).any()


def test_a_segment_lies_between_its_ends():
    out = draw(ground(), [Segment((40, 30), (40, 90), NEAR, 5)])
    center = (pixels_like(out, NEAR).min(0) + pixels_like(out, NEAR).max(0)) / 2
    # Anti-aliased borders are counted or not: half a pixel on either side.
    assert_allclose(center, (40, 60), atol=0.5)


def test_an_ellipse_reaches_two_standard_deviations():
    cov = np.array([[120.0, 60.0], [60.0, 70.0]])
    out = draw(ground(), ellipses=[Ellipse((80, 60), cov, NEAR)])
    drawn = pixels_like(out, NEAR)
    offset = drawn - (80, 60)
    distance = np.sqrt(np.einsum("ni,ij,nj->n", offset, np.linalg.inv(cov), offset))
    # The line is 2 pixels wide and the smaller standard deviation 5.6 of them.
    assert_allclose(distance, 2.0, atol=2.0 / 5.6)
    assert distance.mean() == pytest.approx(2.0, abs=0.05)
    # Along x it reaches 2 sqrt(cov_xx), give or take the line.
    assert np.abs(offset[:, 0]).max() == pytest.approx(2 * np.sqrt(120), abs=1.5)


def test_a_point_known_exactly_or_not_at_all_is_drawn():
    exact = draw(ground(), ellipses=[Ellipse((80, 60), np.zeros((2, 2)), NEAR)])
    changed = np.argwhere((exact != ground()).any(axis=-1))
    assert_allclose(changed.mean(axis=0), (60, 80), atol=1.0)
    assert len(changed) < 200  # a dot, with its outline
    unknown = draw(ground(), ellipses=[Ellipse((80, 60), 1e16 * np.eye(2), FAR)])
    assert unknown.shape == ground().shape


def test_a_figure_lost_far_outside_leaves_the_frame_as_it_is():
    far_away = [Segment((1e12, -1e12), (2e12, -1e12), NEAR), Segment((-500, 20), (-400, 90), FAR)]
    assert_array_equal(draw(ground(), far_away), ground())


def test_later_segments_cover_earlier_ones():
    down, across = Segment((80, 20), (80, 100), FAR, 7), Segment((40, 60), (120, 60), NEAR, 7)
    assert_array_equal(draw(ground(), [down, across])[60, 80], NEAR)
    assert_array_equal(draw(ground(), [across, down])[60, 80], FAR)


def test_lines_of_one_colour_join_and_lines_of_two_colours_part():
    def along(colors):
        bent = [Segment((40, 60), (80, 60), colors[0], 5), Segment((80, 60), (120, 60), colors[1], 5)]
        return draw(ground(), bent)[60, 42:118].astype(int)

    assert (along([NEAR, NEAR]) == NEAR).all()
    assert along([FAR, NEAR]).sum(1).min() < 250  # a dark rim between them


@pytest.mark.parametrize("shade", [0, 128, 255])
@pytest.mark.parametrize("color", [NEAR, FAR, TRUNK])
def test_a_line_stands_on_any_ground(shade, color):
    out = draw(np.full((120, 160, 3), shade, np.uint8), [Segment((20, 60), (140, 60), color, 5)])
    column = out[:, 80].astype(int)
    # Either the line or its dark rim differs from the ground by more than 100 grey levels in some channel.
    assert np.abs(column - shade).max() > 100


def test_near_far_and_trunk_differ_for_every_kind_of_colour_vision():
    for one, other in [(NEAR, FAR), (NEAR, TRUNK), (FAR, TRUNK)]:
        left = np.abs(seen_by_dichromats(one) - seen_by_dichromats(other)).max(1)
        assert (left > 0.15).all(), (one, other, left)


def test_a_caption_is_light_on_a_dark_strip_in_the_top_left_corner():
    out = draw(np.full((360, 640, 3), 200, np.uint8), caption="frame 57  1.90 s")
    assert out[0, 0].max() < 80
    assert out[:60, :200].max() > 240
    assert (out[60:] == 200).all()
    assert (out[:, 400:] == 200).all()


@pytest.mark.parametrize(("height", "width"), [(120, 160), (1080, 1920)])
def test_captions_grow_with_the_frame_and_never_leave_it(height, width):
    image = np.full((height, width, 3), 200, np.uint8)
    strip = (draw(image, caption="frame 57")[:, 1] < 100).all(1).sum()
    assert 0.04 * height < strip < 0.2 * height
    long = draw(image, caption="a caption of more words than any frame could hold " * 3)
    lit = np.flatnonzero((long > 200).any((0, 2)))
    assert 0.9 * width < lit[-1] < width - 3


def test_letters_that_cannot_be_drawn_are_replaced():
    image = np.full((120, 160, 3), 200, np.uint8)
    for one, other in (("Säge", "Sage"), ("走", "?")):
        assert_array_equal(draw(image, caption=one), draw(image, caption=other))


def test_text_stands_on_its_base_and_is_as_high_as_asked():
    canvas = np.zeros((60, 200, 3), np.uint8)
    put_text(canvas, "HEH", 10, 50, 30, (255, 255, 255))
    rows = np.nonzero(canvas.any((1, 2)))[0]
    # A pen of 3 pixels overhangs half its width above and below, and its smooth rim one more.
    assert_allclose([rows[0], rows[-1]], [20, 50], atol=3)
