"""The film of a report: what was followed and nothing on it, copied where a browser plays it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.tracker.clips import QUIET, write_images
from tests.tracker.strolls import stroll
from tests.videos.clips import make_clip, noise
from tracker.report.drawing import write_film
from videos.frames import Video

COUNT, FIRST = 20, 7


@pytest.fixture
def finished(rng, tmp_path):
    """A run of the frames from FIRST on, as far as a film is made of it."""
    source = make_clip(tmp_path / "walk.mp4", noise(COUNT, rng), key_every=6)
    track = stroll(COUNT / 30.0)
    track = replace(track, first=FIRST, times=track.times[FIRST:], q=track.q[FIRST:])
    job = SimpleNamespace(video=source, model="cv")
    return SimpleNamespace(job=job, track=track, frames=COUNT, fps=30.0, size=(96, 64))


@pytest.mark.parametrize("kind", ["copied", "folder", "mended"])
def test_the_film_shows_what_was_followed_from_its_start_on(finished, tmp_path, kind):
    alike = kind == "copied"
    finished.mended = int(kind == "mended")
    if kind == "folder":
        images = [frame.image for frame in Video(finished.job.video)]
        finished.job.video = write_images(tmp_path / "images", images)
    film = write_film(finished, tmp_path / "film.mp4", QUIET)
    assert (film.path, film.size) == (tmp_path / "film.mp4", (96, 64))
    assert (film.start > 0.0) is alike
    source = list(Video(finished.job.video))[FIRST:]
    shown = [frame for frame in Video(film.path) if frame.time > film.start - 1e-3]
    for ours, theirs in zip(shown, source, strict=True):
        if alike:
            assert_array_equal(ours.image, theirs.image)
        else:
            assert np.corrcoef(ours.image.ravel(), theirs.image.ravel())[0, 1] > 0.9
    times = np.array([frame.time for frame in shown]) - film.start
    assert_allclose(times, finished.track.times - finished.track.times[0], atol=1e-4)
