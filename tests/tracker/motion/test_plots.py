"""What the pictures show: which stretch, which colours, what is beside what. The clip: what moves in it."""

import cv2
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from dynamics.motion.tasks import Labelling
from tests.tracker.clips import QUIET
from tests.tracker.gaits import blanked, both, gait, sequence
from tracker.motion import label_plot
from tracker.motion import plots as motion_plots
from tracker.motion.sticks import GROUND, MARK, SIZE, UNIT, write_clip
from tracker.tables.poses import ROOT_COLUMNS
from videos.frames import Video


@pytest.fixture
def figures(monkeypatch):
    """The figures that would have been saved."""
    kept = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path: kept.append(figure))
    return kept


def labelling(labels):
    prob = np.array([[label == "walk", label == "run"] for label in labels], dtype=float)
    return Labelling(tuple(labels), np.zeros(len(labels), dtype=int), ("walk", "run"), prob)


def spans(axes, colour):
    """(start, stop) in frames of every bar of one colour."""
    found = []
    for bars in axes.collections:
        wanted = np.allclose(bars.get_facecolor()[:, :3], to_rgb(colour))
        if wanted and bars.get_alpha() is None:
            found += [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in bars.get_paths()]
    return sorted(found)


def test_bars_stand_where_the_motions_are(figures, rng):
    y, labels = both(rng, frames=20)
    shown = sequence(y, "a", first=100, labels=labels)
    label_plot.draw_labels([shown], [labelling(["run"] * 5 + ["walk"] * 35)], None, "title", shares=True)
    walk, run, *_ = label_plot.MOTIONS
    (axes,) = figures[0].axes
    assert spans(axes, run) == [(99.5, 104.5), (119.5, 139.5)]  # found, and the table's own
    assert spans(axes, walk) == [(99.5, 119.5), (104.5, 139.5)]
    assert [text.get_text() for text in figures[0].legends[0].get_texts()] == ["walk", "run"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["a"]


def test_a_picture_of_many_sequences_shows_the_first_and_says_so(figures, rng):
    many = [sequence(gait("walk", 3, rng), str(i)) for i in range(50)]
    label_plot.draw_labels(many, [labelling(["walk"] * 3)] * 50, None, "title", shares=False)
    (axes,) = figures[0].axes
    assert len(axes.get_yticks()) == label_plot.MOST_ROWS
    assert "first 40 of 50 sequences" in axes.get_title(loc="left")


@pytest.mark.parametrize(
    ("gaps", "longest"),
    [([], (0, 0)), ([(3, 5), (10, 20)], (10, 20)), ([(0, 4)], (0, 4)), ([(35, 40)], (35, 40))],
)
def test_the_longest_gap_is_that_of_the_angles(rng, gaps, longest):
    y = blanked(gait("walk", 40, rng), slice(21, 40), slice(0, ROOT_COLUMNS))
    for start, stop in gaps:
        y[start:stop, 4] = np.nan
    assert motion_plots.longest_gap(sequence(y)) == longest


def lines(axes):
    """Measured and found curves."""
    return [np.array(line.get_ydata(), dtype=float) for line in axes.lines[:2]]


def test_what_was_filled_is_drawn_within_the_gap_and_what_was_measured_outside(figures, rng):
    y = gait("walk", 60, rng)
    given = blanked(y, slice(20, 30))
    sd = np.where(np.isnan(given), 0.1, np.nan)
    motion_plots.draw_filled(sequence(given, first=7), y, sd, 30.0, None, "title")
    sticks_row, *panels = figures[0].subfigs[0].axes + figures[0].subfigs[1].axes
    assert len(panels) == 8
    torso = next(axes for axes in panels if axes.get_ylabel() == "torso, degrees")
    measured, filled = lines(torso)
    assert np.flatnonzero(np.isnan(measured)).tolist() == list(range(20, 30))
    assert np.flatnonzero(~np.isnan(filled)).tolist() == list(range(19, 31))  # tied to its neighbours
    assert torso.lines[0].get_xdata()[0] == 7
    np.testing.assert_allclose(filled[19:31], np.degrees(y[19:31, 2]))
    assert {axes.get_ylabel().rsplit(", ")[1] for axes in panels} == {"degrees", "leg lengths"}
    assert len(sticks_row.texts) == motion_plots.FIGURES
    motion_plots.draw_filled(sequence(y), y, np.full(y.shape, np.nan), 30.0, None, "title")  # no gap
    frames = [text.get_text() for text in figures[1].subfigs[0].axes[0].texts]
    assert (frames[0], frames[-1]) == ("0", "59")


def test_a_long_table_is_shown_around_its_gap_and_a_forecast_at_its_end(figures, rng):
    y = gait("walk", 1000, rng)
    given = blanked(y, slice(500, 510))
    motion_plots.draw_filled(sequence(given), y, np.zeros(y.shape), 30.0, None, "title")
    left, right = figures[0].subfigs[1].axes[0].get_xlim()
    assert left < 500 < 510 < right < left + motion_plots.MOST_FRAMES + 1
    motion_plots.draw_forecast(sequence(y[:990]), y, np.zeros(y.shape), None, "title")
    axes = figures[1].axes[0]
    assert axes.get_xlim()[1] == 999.5
    assert axes.lines[2].get_xdata()[0] == 989.5  # where the table ends
    measured, found = lines(axes)
    assert np.isnan(measured[-10:]).all()
    assert np.isfinite(found).all()


def test_a_root_that_was_not_measured_has_no_panels(figures, rng):
    y = blanked(gait("walk", 30, rng), slice(None), slice(0, ROOT_COLUMNS))
    motion_plots.draw_forecast(sequence(y), y, np.zeros(y.shape), None, "title")
    assert all("degrees" in axes.get_ylabel() for axes in figures[0].axes)
    assert len(figures[0].axes) == 6


@pytest.mark.parametrize("frames", [1, 5, 300])
def test_a_synthesis_shows_its_start_middle_and_end(figures, rng, frames):
    y, states = gait("walk", frames, rng), np.arange(frames) % 3
    y[:, 1] += np.linspace(0.0, 4.0, frames)
    motion_plots.draw_synthesis(states, ("walk", "walk", "run"), y, 30.0, None, "title")
    top, below = figures[0].subfigs
    numbers = [[int(text.get_text()) for text in axes.texts] for axes in top.axes]
    assert numbers[0][0] == 0
    assert max(map(max, numbers)) >= frames - 3
    for axes in top.axes:  # nobody loses a head
        assert max(np.max(line.get_ydata()) for line in axes.lines) < axes.get_ylim()[1]
    named = [text.get_text() for text in below.legends[0].get_texts()]
    assert named == ["walk 0", "walk 1", "run 2"][: min(frames, 3)]


def test_the_ground_passes_below_a_walker_who_stays_in_the_middle(tmp_path, rng):
    y = gait("walk", 12, rng)
    y[:, 0] = 0.1 * np.arange(12)
    write_clip(y, [f"frame {t}" for t in range(12)], 30.0, tmp_path / "c.mp4", QUIET)
    images = [frame.image for frame in Video(tmp_path / "c.mp4")]
    assert len(images) == 12
    assert images[0].shape == (SIZE[1], SIZE[0], 3)
    orange = [np.argwhere((im[..., 0] > 200) & (im[..., 2] < 60))[:, 1].mean() for im in images]
    assert np.abs(np.array(orange) - SIZE[0] / 2).max() < 60
    below = slice(GROUND + 6, GROUND + 16)
    marks = [(cv2.cvtColor(im[below], cv2.COLOR_RGB2GRAY) < np.mean(MARK) + 30).any(0) for im in images]
    shift = round(0.1 * UNIT)
    apart = [np.mean(marks[0][k:] != marks[1][: len(marks[1]) - k]) for k in range(2 * shift)]
    assert abs(int(np.argmin(apart)) - shift) <= 2
