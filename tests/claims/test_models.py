"""What `make models` learns is what ships, to the fourth digit after the point.

Left out are those of arms, the pooled one, and `gait-started`, which takes a minute to learn.
"""

from pathlib import Path

import numpy as np
import pytest

from dynamics.slds import SLDS
from dynamics.store import load
from tests.tracker.clips import succeeds

pytestmark = pytest.mark.claims

MODELS = Path(__file__).parents[2] / "dynamics" / "models"
LEARNED = {
    "walk-run": ("learn.toml", "--states", 1, "--noise", 0),
    "gait": ("gait.toml",),
}
FPS = 24  # of the rates that ship, the one that is learned soonest
ARRAYS = ("pi0", "Pi", "A", "b", "Q", "C", "R", "mean0", "cov0")


@pytest.mark.parametrize("name", LEARNED)
def test_make_models_gives_the_model_that_ships(name, data_dir, tmp_path):
    settings, *more = LEARNED[name]
    words = ["--trials", data_dir / "mocap" / "trials.csv", "--settings", MODELS / settings, "--fps", FPS]
    succeeds("learn", *words, *more, "--out", tmp_path / "m.npz", "--quiet")
    made, ships = load(tmp_path / "m.npz"), load(MODELS / f"{name}@{FPS}.npz")
    assert isinstance(made, SLDS)
    assert isinstance(ships, SLDS)
    assert (made.names, made.labels, made.fps) == (ships.names, ships.labels, ships.fps)
    for array in ARRAYS:
        # Rounding of another processor or BLAS, through ten rounds of learning: 1e-5 where it was seen.
        got, want = getattr(made, array), getattr(ships, array)
        np.testing.assert_allclose(got, want, atol=1e-4, err_msg=array)
