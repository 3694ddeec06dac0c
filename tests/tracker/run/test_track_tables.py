"""A track as a table and as a dataset: its own numbers under the names and in the units that are promised."""

import builtins

import numpy as np
import pytest

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll


def test_a_table_has_a_row_a_frame_in_degrees_leg_lengths_and_pixels():
    track = stroll(1.0)
    table = track.to_dataframe()
    assert (table.index.name, list(table.index)) == ("frame", list(range(30)))
    assert table["time_s"].to_numpy() == pytest.approx(track.times)
    hip = np.degrees(track.q[:, WALKER.index("hip_near")])
    assert table["hip_near"].to_numpy() == pytest.approx(hip)
    assert table["root_x"].to_numpy() == pytest.approx(track.q[:, 0])
    knee = table[["far_knee_x", "far_knee_y"]].to_numpy()
    assert knee == pytest.approx(track.joints()[:, WALKER.joints.index("far_knee")])
    assert set(table["motion"]) == {"walk"}
    assert set(table["outcome"]) == {"ok"}
    assert not any(name.startswith("scale") for name in table)


def test_a_dataset_has_the_dimensions_of_movement():
    track = stroll(1.0)
    data = track.to_xarray()
    assert data["position"].dims == ("time", "space", "keypoints", "individuals")
    assert data["confidence"].dims == ("time", "keypoints", "individuals")
    near = data["position"].sel(keypoints="near_ankle", individuals="walker", space="y").to_numpy()
    assert near == pytest.approx(track.joints()[:, WALKER.joints.index("near_ankle"), 1])
    assert data["time"].to_numpy() == pytest.approx(track.times)
    assert data.attrs["fps"] == pytest.approx(30.0)
    assert (data.attrs["ds_type"], data.attrs["time_unit"]) == ("poses", "seconds")


@pytest.mark.parametrize(("method", "library"), [("to_dataframe", "pandas"), ("to_xarray", "xarray")])
def test_without_the_library_it_says_what_to_install(monkeypatch, method, library):
    usual = builtins.__import__

    def without(name, *more):
        if name == library:
            raise ImportError(name)
        return usual(name, *more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=rf"install \"\.\[data\]\" in the clone, or {library}"):
        getattr(stroll(0.5), method)()


def test_a_track_is_printed_in_a_line():
    assert repr(stroll(1.0)) == "<Track with made-up: frames 0 to 29, 30 ok>"
