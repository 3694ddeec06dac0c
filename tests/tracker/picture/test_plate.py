"""The scene behind the figure in the marked frame, from painted frames in which a block walks across it."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.tracker.painted import Cloth
from tracker.picture.backdrop import NOISE, small
from tracker.picture.plate import EVERY, FEWEST, plate

UNIT, STEP = 133.0, 4  # pixels
WIDTH, HEIGHT, BORDER = 320, 240, 80
BLOCK, TOP, WALK = (40, 100), 80, 8  # pixels: width and height, a row, a frame
COLOUR = (230, 60, 40)
T, MARKED = 40, 18
STILL = np.zeros((T, 2), int)
PAN = STEP * np.stack([np.arange(T) // 3, -np.arange(T) // 5], axis=1)
SWAY = STEP * np.stack([np.abs(np.arange(T) - 20) // 2, np.zeros(T, int)], axis=1)


@pytest.fixture(scope="module")
def scene():
    """A picture of more than any frame shows."""
    rng = np.random.default_rng(20)
    across, down = np.meshgrid(np.arange(WIDTH + 2 * BORDER), np.arange(HEIGHT + 2 * BORDER))
    cloth = Cloth(rng, wavelengths=(12.0, 80.0), contrast=10.0)
    return np.clip(np.round(cloth(np.stack([across, down], axis=-1))), 40, 215).astype(np.uint8)


def bare(scene, shift):
    """A frame that shows the scene this much further right and down."""
    x, y = BORDER - shift
    return scene[y : y + HEIGHT, x : x + WIDTH].copy()


def place_of(t, walk=WALK):
    """Left side of the block, which is in the middle when it is marked."""
    return 140 + walk * (t - MARKED)


def box_at(left):
    return left - 10.0, TOP - 10.0, left + BLOCK[0] + 10.0, TOP + BLOCK[1] + 10.0


def walked(scene, shifts, walk=WALK):
    """The frames, with the block before the scene."""
    frames = [bare(scene, shift) for shift in shifts]
    for t, frame in enumerate(frames):
        left = place_of(t, walk)
        frame[TOP : TOP + BLOCK[1], max(left, 0) : max(left + BLOCK[0], 0)] = COLOUR
    return frames


def rows_and_columns(box):
    """Of the places that a box of pixels touches."""
    x0, y0, x1, y1 = (int(side) // STEP for side in box)
    return slice(y0, y1 + 1), slice(x0, x1 + 1)


def found_in(frames, frame=MARKED):
    return plate(iter(frames), frame, box_at(place_of(frame)), UNIT)


def views(shifts, frame):
    """(h, w) of the kept frames that show each place of one of them."""
    row, column = np.indices((HEIGHT // STEP, WIDTH // STEP))
    number = np.zeros(row.shape, int)
    for x, y in (shifts[::EVERY] - shifts[frame]) // STEP:
        number += (column + x >= 0) & (column + x < row.shape[1]) & (row + y >= 0) & (row + y < row.shape[0])
    return number


@pytest.mark.parametrize("frame", [16, 18, 19])
@pytest.mark.parametrize("shifts", [STILL, PAN, SWAY], ids=["still", "pans", "sways"])
def test_what_lies_behind_a_block_that_walks_across_is_known_and_is_the_scene(shifts, frame, scene):
    found = found_in(walked(scene, shifts), frame)
    want = small(bare(scene, shifts[frame]), STEP)
    number = views(shifts, frame)
    assert (number.min() >= FEWEST) == (shifts is STILL)
    # The block is before a place in at most two of the kept frames.
    assert_array_equal(found.known, number >= FEWEST)
    assert_array_equal(found.scene[found.known], want[found.known])
    assert found.known[rows_and_columns(box_at(place_of(frame)))].all()
    assert found.place == (0, 0)


def test_where_few_frames_show_a_place_the_scene_is_that_of_the_marked_frame(scene):
    frames = walked(scene, PAN)
    found = found_in(frames)
    assert not found.known.all()
    assert_array_equal(found.scene[~found.known], small(frames[MARKED], STEP)[~found.known])


@pytest.mark.parametrize("shifts", [STILL, PAN], ids=["still", "pans"])
def test_the_block_stands_out_from_the_plate_in_the_marked_frame_and_nothing_else_does(shifts, scene):
    marked = walked(scene, shifts)[MARKED]
    left, box = place_of(MARKED), box_at(place_of(MARKED))
    scenery = found_in(walked(scene, shifts)).compared(marked, box).scenery
    x, y = np.meshgrid(np.arange(box[0], box[2]), np.arange(box[1], box[3]))
    pixels = np.stack([x, y], axis=-1).reshape(-1, 2)
    on_block = (np.abs(pixels - (left + 19.5, TOP + 49.5)) < (20.0, 50.0)).all(axis=1)
    assert_array_equal(scenery.outstanding(pixels), on_block)
    assert_array_equal(scenery.plain(pixels), ~on_block)


def test_a_block_that_never_moves_is_taken_for_the_scene(scene):
    frames = walked(scene, STILL, walk=0)
    found = found_in(frames)
    assert found.known.all()
    assert_array_equal(found.scene, small(frames[MARKED], STEP))


@pytest.mark.parametrize("channel", range(3), ids=["lightness", "a", "b"])
@pytest.mark.parametrize(("by", "known"), [(0.4 * NOISE, True), (40.0, False)])
def test_where_frames_flicker_much_the_scene_is_unknown(by, known, channel, scene, rng):
    frames = walked(scene, STILL)
    for frame in frames:
        patch = np.full((32, 40, 3), 128, np.uint8)
        patch[..., channel] += np.round(by * rng.uniform(-1.0, 1.0)).astype(int).astype(np.uint8)
        frame[200:232, 40:80] = cv2.cvtColor(patch, cv2.COLOR_Lab2RGB)
    found = found_in(frames)
    flickers = np.zeros_like(found.known)
    flickers[50:58, 10:20] = True
    assert_array_equal(found.known, ~flickers | known)


@pytest.mark.parametrize("shown", range(FEWEST, 2 * FEWEST))
def test_the_scene_is_the_middle_of_the_frames_that_show_it_the_lower_of_an_even_number(shown, rng):
    greys = 100 + 2 * rng.permutation(shown)  # apart by less than the noise, no two alike
    frames = [np.full((HEIGHT, WIDTH, 3), grey, np.uint8) for grey in greys.repeat(EVERY)]
    found = found_in(frames, frame=3)
    middle = np.full((HEIGHT, WIDTH, 3), np.sort(greys)[(shown - 1) // 2], np.uint8)
    assert found.known.all()
    assert_array_equal(found.scene, small(middle, STEP))


@pytest.mark.parametrize(("T", "known"), [(EVERY * (FEWEST - 1), False), (EVERY * (FEWEST - 1) + 1, True)])
def test_fewer_frames_than_enough_tell_nothing(T, known, scene):
    frames = [bare(scene, np.zeros(2, int))] * T
    found = found_in(frames, frame=3)
    assert_array_equal(found.known, known)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_without_the_marked_frame_there_is_no_plate(count, scene):
    frames = [bare(scene, np.zeros(2, int))] * count
    assert found_in(frames, frame=count) is None
    assert count == 0 or found_in(frames, frame=count - 1) is not None
