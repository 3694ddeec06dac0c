"""The stride's type: what it holds, its file, and what is refused when it is made or read."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.store import ModelError, load, load_shipped, save
from dynamics.stride import Stride
from tests.dynamics.periodic.strides import SIZE, two_strides


@pytest.fixture
def stride(rng):
    return two_strides(rng)


def test_motions_are_joined_one_after_the_other(stride):
    assert stride.labels == ("walk", "run")
    assert stride.mean[:, -2].tolist() == [6.0, 10.0]
    assert stride.basis == SIZE
    assert stride.travels.tolist() == [True, False, False, False]


@pytest.mark.parametrize(
    ("name", "index", "value", "words"),
    [
        ("mean", (0, 3), np.nan, "mean must be finite"),
        ("root", (0, 0, 1), 0.1, "root must be lower triangular"),
        ("root", (1, 2, 2), -0.1, "root must be lower triangular with a positive diagonal"),
        ("quick", (0, 0, 1), 0.1, "quick must be symmetric"),
        ("slow", (1, 0, 0), -1.0, "slow must be positive definite"),
        ("R", (0, 0, 0), np.inf, "R must be finite"),
        ("bend", 0, 0.0, "bend must be positive"),
        ("drift", 1, -0.1, "drift must be positive"),
    ],
)
def test_numbers_that_cannot_be_are_refused_in_a_file(stride, tmp_path, name, index, value, words):
    save(stride, tmp_path / "s.npz", "a test")
    with np.load(tmp_path / "s.npz") as archive:
        parts = {key: archive[key] for key in archive.files}
    parts[name][index] = value
    np.savez_compressed(tmp_path / "s.npz", **parts)
    with pytest.raises(ModelError, match=f"is damaged: {words}"):
        load(tmp_path / "s.npz")


def test_shapes_that_do_not_fit_are_refused(stride):
    with pytest.raises(ValueError, match=r"quick must have shape \(2, 4, 4\); got \(1, 4, 4\)"):
        replace(stride, quick=stride.quick[:1])
    with pytest.raises(ValueError, match="mean has 21 numbers a motion, which 4 freedoms have not"):
        replace(stride, mean=stride.mean[:, :-1], root=stride.root[:, :-1, :-1])
    with pytest.raises(ValueError, match="travelling must be among root_x, torso, hip_near, hip_far"):
        replace(stride, travelling=("root_y",))
    with pytest.raises(ValueError, match="fps must be positive; got 0"):
        replace(stride, fps=0.0)


def test_one_small_file_serves_every_frame_rate():
    at = [load_shipped("stride", fps) for fps in (24.0, 60.0)]
    assert all(isinstance(model, Stride) for model in at)
    assert_array_equal(at[0].mean, at[1].mean)
    assert set(at[0].labels) == {"walk", "run"}
