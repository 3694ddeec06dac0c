"""A track's tables: the columns others read, a row for every frame, numbers that come back."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import FOOTLESS, WALKER, Puppet
from tests.oracles import central_difference
from tests.tracker.clips import read_csv
from tests.tracker.tracks import random_track
from tracker.run.write import write_tables
from tracker.tables.keypoints import KEYPOINTS, read_keypoints

FIRST, T, CLIP, FPS = 2, 5, 9, 25.0


@pytest.fixture(params=[1, -1], ids=["right", "left"])
def track(request, rng):
    return random_track(rng, T, first=FIRST, facing=request.param)


@pytest.fixture
def folder(track, tmp_path):
    write_tables(track, tmp_path, CLIP, FPS)
    return tmp_path


def header_of(path):
    return path.read_text(encoding="utf-8").splitlines()[0]


def tip(track, q, joint, t):
    """Where a joint lies in a picture that the camera moved as in row t, pixels, by the definition."""
    x, y = Puppet(WALKER, q).joints()[joint]
    right, down, zoom = track.moved[t]
    unit = zoom * track.view.unit
    left, top = track.view.origin
    return np.array([left + right + track.view.facing * unit * x, top + down - unit * y])


def test_tables_have_the_columns_that_others_read(folder):
    assert header_of(folder / "keypoints.csv") == "frame,keypoint,x,y,visible,time_s,sxx,sxy,syy"
    assert header_of(folder / "pose.csv") == (
        "seq,frame,root_x,root_y,torso,neck,hip_near,knee_near,hip_far,knee_far,time_s,state,label,outcome,"
        "ankle_near,ankle_far"
    )


def test_every_keypoint_of_every_frame_has_its_row(folder):
    rows = read_csv(folder / "keypoints.csv")
    assert [(int(row["frame"]), row["keypoint"]) for row in rows] == [
        (t, name) for t in range(CLIP) for name in KEYPOINTS
    ]
    assert [int(row["frame"]) for row in read_csv(folder / "pose.csv")] == list(range(CLIP))


@pytest.mark.parametrize("figure", [WALKER, FOOTLESS], ids=["feet", "none"])
def test_cells_are_empty_outside_the_track_and_for_joints_the_figure_has_not(figure, rng, tmp_path):
    write_tables(random_track(rng, T, first=FIRST, figure=figure), tmp_path, CLIP, FPS)
    for row in read_csv(tmp_path / "keypoints.csv"):
        tracked = FIRST <= int(row["frame"]) < FIRST + T and row["keypoint"] in figure.joints
        for column in ("x", "y", "visible", "sxx", "sxy", "syy"):
            assert (row[column] != "") == tracked
    for row in read_csv(tmp_path / "pose.csv"):
        tracked = FIRST <= int(row["frame"]) < FIRST + T
        for column in row.keys() - {"seq", "frame", "time_s"}:
            has = figure is WALKER or not column.startswith("ankle")
            assert (row[column] != "") == (tracked and has)


def test_joints_come_back_to_a_thousandth_of_a_pixel(folder, track):
    found = read_keypoints(folder / "keypoints.csv")
    assert sorted(found) == list(range(FIRST, FIRST + T))
    for t, of_frame in found.items():
        assert set(of_frame) == set(WALKER.joints)
        for name, mark in of_frame.items():
            place = tip(track, track.q[t - FIRST], name, t - FIRST)
            assert_allclose((mark.x, mark.y), place, atol=0.5e-3 + 1e-9)


def test_covariances_are_the_poses_carried_through_the_differenced_joints_and_the_mark_s(folder, track):
    for row in read_csv(folder / "keypoints.csv"):
        if row["x"] == "":
            continue
        t = int(row["frame"]) - FIRST
        told = partial(tip, track, joint=row["keypoint"], t=t)
        J = central_difference(told, track.q[t], step=1e-6)
        S = J @ track.cov[t] @ J.T + (0.02 * 70.0 * track.moved[t, 2]) ** 2 * np.eye(2)
        got = [float(row[column]) for column in ("sxx", "sxy", "syy")]
        # Four decimals are written; differencing coordinates of 200 px by 1e-6 leaves 1e-7 of J.
        assert_allclose(got, [S[0, 0], S[0, 1], S[1, 1]], atol=0.5e-4 + 1e-5)


def test_poses_come_back_in_degrees_and_leg_lengths(folder, track):
    rows = [row for row in read_csv(folder / "pose.csv") if row["root_x"] != ""]
    told = zip(rows, track.q, track.s, track.motions, track.outcome, strict=True)
    for row, q, s, motion, outcome in told:
        assert row["seq"] == "0"
        for i, name in enumerate(("root_x", "root_y")):
            assert float(row[name]) == pytest.approx(q[i], abs=0.5e-5 + 1e-12)
        for name in ("torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far"):
            assert float(row[name]) == pytest.approx(np.degrees(q[WALKER.index(name)]), abs=0.5e-4 + 1e-9)
        assert int(row["state"]) == s
        assert row["label"] == motion
        assert row["outcome"] == outcome


def test_a_joint_is_visible_unless_the_figure_is_lost_or_outside(folder, track):
    for row in read_csv(folder / "keypoints.csv"):
        if row["x"] != "":
            outcome = track.outcome[int(row["frame"]) - FIRST]
            assert row["visible"] == ("0" if outcome in ("lost", "outside") else "1")


def test_frames_outside_the_track_are_timed_at_the_frame_rate(folder):
    for name in ("pose.csv", "keypoints.csv"):
        for row in read_csv(folder / name):
            assert float(row["time_s"]) == pytest.approx(int(row["frame"]) / FPS, abs=1e-6)


def test_frames_keep_their_own_times(rng, tmp_path):
    times = [0.0, 0.01, 0.05, 0.081, 0.155, 0.255]
    track = replace(random_track(rng, 3, first=2), times=np.array(times[2:5]), before=tuple(times[:2]))
    write_tables(track, tmp_path, 6, 10.0)
    assert [float(row["time_s"]) for row in read_csv(tmp_path / "pose.csv")] == pytest.approx(times)


def test_the_archive_holds_everything_unrounded(folder, track):
    with np.load(folder / "track.npz", allow_pickle=False) as archive:
        header = json.loads(str(archive["header"]))
        for name in ("times", "q", "cov", "s", "moved"):
            assert_allclose(archive[name], getattr(track, name), rtol=0.0, atol=0.0)
        assert tuple(archive["outcome"]) == track.outcome
        assert_allclose(archive["joints"], track.joints(), atol=0.0)
        assert_allclose(archive["joint_covs"], track.joint_covs(), atol=0.0)
    assert header["format"] == "figtrack-track"
    assert header["first"] == FIRST
    assert header["model"] == track.model
    assert tuple(header["labels"]) == track.labels
    assert tuple(header["freedoms"]) == WALKER.freedoms
    assert tuple(header["joints"]) == WALKER.joints
    assert header["view"] == [*track.view.origin, track.view.unit, track.view.facing]
    assert header["lengths"] == [link.length for link in WALKER.links]


def test_which_frames_were_measured_is_worked_out_once_and_stays(track):
    assert track.measured.tolist() == [outcome.measured for outcome in track.outcome]
    assert track.measured is track.measured
    with pytest.raises(ValueError, match="read-only"):
        track.measured[0] = True


def test_joints_of_some_rows_are_those_of_all_rows(track, monkeypatch):
    whole, covs = track.joints(), track.joint_covs()
    monkeypatch.setattr("tracker.run.track.BLOCK", 2)
    some = slice(1, len(track), 2)
    assert_allclose(track.joints(some), whole[some], rtol=1e-12)
    assert_allclose(track.joint_covs(some), covs[some], rtol=1e-9)


def test_angles_spread_by_the_pose_and_by_the_error_of_marks(track, rng, monkeypatch):
    monkeypatch.setattr("tracker.run.track.BLOCK", 2)
    track, t, draws = replace(track, mark=0.01), 3, 100_000
    body = Puppet(WALKER, track.q[t]).joints()
    marked = {name: at + rng.normal(scale=track.mark, size=(draws, 2)) for name, at in body.items()}

    def heading(start, tip):
        """Complex, so that differences are not cut off."""
        x, y = (marked[tip] - marked[start]).T
        return x + 1j * y

    thigh, shank = heading("hip", "near_knee"), heading("near_knee", "near_ankle")
    drawn = {"hip_near": thigh, "knee_near": shank * thigh.conj(), "torso": heading("hip", "neck")}
    for name, turned in drawn.items():
        k = WALKER.index(name)
        apart = np.angle(turned / turned.mean())
        assert track.sigma(k)[t] == pytest.approx(np.sqrt(track.cov[t, k, k] + apart.var()), rel=0.02)


def test_joints_of_legs_that_may_be_misnamed_spread_as_draws_of_either_naming(track, rng):
    # Spread as wide as legs are apart, and differently of each leg.
    wide = np.array([60.0 if "near" in name else 20.0 for name in WALKER.freedoms])
    track = replace(track, cov=track.cov * np.outer(wide, wide))
    doubted, draws = replace(track, misnamed=0.3), 200_000
    wrong = rng.random(draws) < doubted.misnamed
    for name, other in (("knee_near", "knee_far"), ("torso", "torso")):
        k, twin = WALKER.index(name), WALKER.index(other)
        means, spreads = track.q[1, [k, twin]], [track.sigma(i)[1] for i in (k, twin)]
        apart = np.where(wrong, *rng.normal(means[::-1], spreads[::-1], (draws, 2)).T) - means[0]
        assert doubted.sigma(k)[1] == pytest.approx(np.sqrt((apart**2).mean()), rel=0.01)
    for name, other in (("near_ankle", "far_ankle"), ("hip", "hip")):
        j, twin = WALKER.joints.index(name), WALKER.joints.index(other)
        (places,), (covs,) = track.joints(slice(1, 2)), track.joint_covs(slice(1, 2))
        right, mistaken = (rng.multivariate_normal(places[i], covs[i], draws) for i in (j, twin))
        apart = np.where(wrong[:, None], mistaken, right) - places[j]
        found = doubted.joint_covs(slice(1, 2))[0, j]
        assert_allclose(found, apart.T @ apart / draws, atol=0.01 * np.trace(found))
