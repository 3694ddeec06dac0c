"""The small picture of a film is from its middle, from early on in a long one, and never missing."""

import cv2
import numpy as np
import pytest

from tests.tracker.clips import write_video
from tracker.report import thumbnail as thumbnails
from tracker.report.thumbnail import LATEST, thumbnail
from videos.frames import Video


def film(path, frames):
    """A film whose frames are as bright as their numbers."""
    write_video(path, [np.full((48, 64, 3), t, np.uint8) for t in range(frames)])
    return path


def brightness(jpeg):
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    return picture.shape, float(picture.mean())


@pytest.mark.parametrize(("frames", "shown"), [(101, 50), (150, LATEST), (1, 0)])
def test_it_shows_the_middle_or_an_early_frame(frames, shown, tmp_path):
    shape, bright = brightness(thumbnail(film(tmp_path / "a.mp4", frames), 32))
    assert shape == (24, 32, 3)
    assert bright == pytest.approx(shown, abs=3.0)


def test_it_is_never_enlarged(tmp_path):
    assert brightness(thumbnail(film(tmp_path / "a.mp4", 3), 500))[0] == (48, 64, 3)


def test_a_film_that_ends_early_shows_its_first_frame(tmp_path, monkeypatch):
    class Short(Video):
        def __init__(self, path):
            super().__init__(path)
            self.count_hint = 1000

    monkeypatch.setattr(thumbnails, "Video", Short)
    assert brightness(thumbnail(film(tmp_path / "a.mp4", 21), 64))[1] == pytest.approx(0.0, abs=3.0)
