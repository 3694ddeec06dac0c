"""The marking page of the rendered walk, open in a browser."""

import numpy as np
import pytest

from tests.tracker.annotate.pages import session_page


@pytest.fixture
def table(tmp_path):
    return tmp_path / "k.csv"


@pytest.fixture
def page(browser, clip, table):
    """The page of a session on the rendered walk."""
    with session_page(browser, clip.video, table) as page:
        yield page


@pytest.fixture
def truth(clip):
    """The joints of frame 0, hundredths of pixels."""
    return {name: tuple(np.round(places[0], 2).tolist()) for name, places in clip.joints.items()}
