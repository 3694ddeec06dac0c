"""A walk that is rendered once, and the models that several modules follow it with."""

import pytest

from tests.tracker.loop.walks import FRAMES, Walk, start_of
from tests.tracker.painted import FULL
from tracker.models.find import find_model
from tracker.scene.film import render


@pytest.fixture(scope="session")
def scene():
    """A walker whom no shrub hides."""
    return render(5, frames=72, size=(480, 270), shrubs=False)


@pytest.fixture(scope="session")
def walk(scene):
    places = {name: at[:FRAMES] for name, at in scene.joints.items()}
    return Walk(scene.images[:FRAMES], places, start_of(places, scene.facing), scene.leg_px)


@pytest.fixture(scope="session")
def models():
    return {name: find_model(name, 30.0, FULL) for name in ("walk-run", "walk-run-1", "cv")}
