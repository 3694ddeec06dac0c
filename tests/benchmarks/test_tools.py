"""What the figures of the documentation rest on: claims, scores, calibration, disturbances, fair rivals."""

import math
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.viterbi import viterbi
from kinematics.figure_file import load_figure
from kinematics.recover import start_pose
from kinematics.sides import exchanged as twins
from kinematics.spm import UNMOVED
from tests.benchmarks import gallery, mutations
from tests.benchmarks.evaluation.calibration import distances, inside, mark_noise, nees
from tests.benchmarks.evaluation.cases import Outcome, band_error
from tests.benchmarks.evaluation.disturbances import DISTURBANCES, Film, every_second, guessed, moved
from tests.benchmarks.evaluation.feet import FEET
from tests.benchmarks.evaluation.films import FILMS
from tests.benchmarks.evaluation.held_out import tune
from tests.benchmarks.evaluation.robustness import DROPPED, SHOTS, claims
from tests.benchmarks.evaluation.spoiled import Damage, constant_velocity, spoil
from tests.benchmarks.motion import __main__ as motion
from tests.benchmarks.motion.synthesis import spectrum, stride
from tests.benchmarks.motion.transitions import Change, compare
from tests.benchmarks.page import Claim
from tests.benchmarks.rivals.body import body_at
from tests.benchmarks.rivals.lucas_kanade import follow
from tests.benchmarks.speed import command, rivals, tracking
from tests.benchmarks.speed.command import Used
from tests.oracles import condition, random_slds, sample
from tests.tracker.tracks import random_track, standing
from tracker.foreign.points import Points
from tracker.tables.keypoints import Mark

pytestmark = pytest.mark.whole

NAMES = ("head_top", "hip", "near_knee", "near_ankle", "far_knee", "far_ankle")


@pytest.mark.parametrize("value", [0.9, 4.1, math.nan])
def test_a_claim_outside_its_bounds_or_not_measured_is_not_reached(value):
    assert Claim("", value, 4.0, 1.0).row()[-1] == "**no**"
    assert Claim("", 4.0, 4.0, 1.0).row()[-1] == Claim("", 1.0, 4.0, 1.0).row()[-1] == "yes"


def test_a_claim_tells_its_bound_in_one_word_and_its_unit_once():
    assert Claim("late", 1.0, 2.0, unit="ms").row() == ["late, ms", "≤2", "1.00", "yes"]
    assert Claim("as fast", 1.0, math.inf, 2.0).row() == ["as fast", "≥2", "1", "**no**"]


def test_a_part_of_a_page_is_written_in_its_place_without_losing_the_others(monkeypatch, tmp_path):
    def part(heading, value):
        claims = [Claim("error", value, 2.0)]
        return SimpleNamespace(
            HEADING=heading, claims=lambda _: claims, section=lambda *_: [f"{heading} in words", ""]
        )

    parts = [part(name, 1.0) for name in ("first", "second", "third")]
    monkeypatch.setattr(motion, "SECTIONS", parts)
    monkeypatch.setattr(motion, "study", lambda _: SimpleNamespace(captures=()))
    whole = motion.page(tmp_path, {}, parts)
    assert motion.page(tmp_path, {}, parts[1:2], whole) == whole
    without = motion.page(tmp_path, {}, [parts[0], parts[2]])
    assert motion.page(tmp_path, {}, parts[1:2], without) == whole
    again = motion.page(tmp_path, {}, [part("second", 3.0)], whole)
    assert again == whole.replace("1 |yes", "3 |**no**", 2).replace("3 |**no**", "1 |yes", 1)


@pytest.mark.parametrize(
    ("labels", "left", "found", "wrong", "apart"),
    [
        ("w" * 20 + "r" * 30, 20, 20, 0, 0),
        ("w" * 17 + "s" * 6 + "r" * 27, 17, 23, 0, 1),
        ("w" * 14 + "r" * 36, 14, 14, 0, 4),
        ("w" * 10 + "r" * 40, 10, 10, 3, 8),
        ("wwr" + "w" * 17 + "r" * 30, 20, 2, 1, 16),
        ("r" * 50, 0, 0, 13, 18),
        ("w" * 20 + "s" * 30, 20, 50, 23, 28),
    ],
    ids=["inside", "around", "early", "too early", "a false one", "no walk", "no run"],
)
def test_a_change_of_motion_is_held_against_the_frames_between_which_it_is(labels, left, found, wrong, apart):
    change = Change("a", "w", "r", 18, 22)
    assert compare(change, labels) == (left, found, wrong)
    assert max(change.apart(left), change.apart(found)) == apart


def made_up(mean, lost=None):
    """One clip's outcome."""
    return Outcome(SimpleNamespace(mean_error_leg=mean, first_failure_frame=lost), None, None)


def test_a_clip_that_alone_makes_a_value_the_best_does_not_get_it():
    errors = {(1,): [0.9, 0.2, 0.2], (2,): [0.1, 0.3, 0.3]}
    tuned = tune({values: [made_up(error) for error in row] for values, row in errors.items()})
    assert tuned.best == (2,)
    assert tuned.chosen == [(1,), (2,), (2,)]
    assert tuned.ratio == pytest.approx((0.9 + 0.3 + 0.3) / (0.1 + 0.3 + 0.3))


def test_lost_runs_are_a_share_of_all_draws_and_a_refusal_is_one(tmp_path):
    good, bad = made_up(0.1).score, made_up(0.3, lost=5).score
    clips = [tmp_path / f"{name}.mp4" for name in ("a_walk", "b_run", "c_walk", "d_run")]
    pictures = {name: [good] * 4 for name in SHOTS} | {DROPPED: [bad, bad, good, good]}
    pictures["JPEG quality 30"] = [good, bad, None, good]
    found = {c.text: c for c in claims(clips, pictures, {"a": [good] * 3, "b": [good, None, bad]})}
    assert found["share of runs lost from disturbed start marks"].value == pytest.approx(2 / 6)
    assert found["walks lost, JPEG quality 30"].value == 1
    assert not found[f"clips followed, {DROPPED}"].reached


def test_the_band_need_not_lie_on_the_joint_but_its_path_must_be_the_same(rng):
    errors = rng.normal(size=(4000, 2)) * (2.0, 1.0)
    found = {t: {"near_knee": (x + 3.0, y - 7.0)} for t, (x, y) in enumerate(errors)}
    # sqrt(2^2 + 1^2), to a standard error of about one per cent.
    assert band_error(found, dict.fromkeys(found, (0.0, 0.0))) == pytest.approx(np.sqrt(5.0), rel=0.04)


def marks_about(track, rng, spread):
    """Marks about the tracked joints with errors of their covariance and the marks', spread by a factor."""
    places = dict(zip(track.figure.joints, track.joints()[0], strict=True))
    limbs = {"hip": "near_knee", "near_knee": "near_knee", "far_knee": "far_knee"}
    marks = {t: {} for t in range(len(track))}
    for (name, place), cov in zip(places.items(), track.joint_covs()[0], strict=True):
        limb = [places["hip"], places[limbs[name]]] if name in limbs else []
        errors = rng.multivariate_normal(np.zeros(2), spread**2 * (cov + mark_noise(limb)), size=len(track))
        for t, error in enumerate(errors):
            marks[t][name] = Mark(*(place + track.moved[t, :2] - track.moved[0, :2] + error))
    return marks


@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_errors_of_the_right_size_give_two_and_86_5_per_cent_and_others_do_not(spread, rng):
    track = random_track(rng, 2000)
    unzoomed = track.moved * (1.0, 1.0, 0.0) + UNMOVED
    track = replace(track, cov=np.broadcast_to(track.cov[0], track.cov.shape), moved=unzoomed)
    track = standing(track, track.q[0])
    found = distances(track, marks_about(track, rng, spread), 0).reshape(1999, -1)
    # Of 1999 draws a joint's mean has the standard error 2 / sqrt(1999) = 0.045, its share 0.011.
    for of_joint in found.T:
        assert nees(of_joint) == pytest.approx(2.0 * spread**2, rel=0.1)
        assert inside(of_joint) == pytest.approx(1.0 - np.exp(-2.0 / spread**2), abs=0.045)


def test_a_mark_slides_four_pixels_along_its_limb_and_one_and_a_half_across():
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    R = mark_noise([np.zeros(2), 30.0 * along])
    assert_allclose([along @ R @ along, across @ R @ across], [4.0**2, 1.5**2])
    assert along @ R @ across == pytest.approx(0.0, abs=1e-9)


@pytest.fixture
def film():
    """A bright spot with its mark that goes right by two pixels a frame, on grey."""
    rows, columns = np.mgrid[:60, :120]
    spots = [120.0 * np.exp(-((columns - 20 - 2 * t) ** 2 + (rows - 30) ** 2) / 60.0) for t in range(31)]
    images = [np.repeat(np.rint(60.0 + spot)[..., None], 3, axis=-1).astype(np.uint8) for spot in spots]
    return Film(images, 25.0, {t: {"hip": Mark(20.0 + 2.0 * t, 30.0)} for t in (0, 10, 15, 30)})


@pytest.mark.parametrize("name", [name for name in SHOTS if name != "noise of 10 grey levels"])
def test_marks_stay_on_their_pictures_whatever_is_done_to_them(name, film):
    made = SHOTS[name](film)
    assert made.fps == film.fps / (2 if name == DROPPED else 1)
    for frame, row in made.marks.items():
        y, x = np.unravel_index(made.images[frame][..., 0].argmax(), made.images[frame].shape[:2])
        assert_allclose((x, y), (row["hip"].x, row["hip"].y), atol=2)


def test_disturbances_are_as_large_as_their_names_say(film):
    before = np.stack(film.images).astype(float)
    dark = np.stack(DISTURBANCES["brightness halved over 20 frames"](film).images)
    shares = dark.mean((1, 2, 3)) / before.mean((1, 2, 3))
    assert_allclose(shares, np.maximum(1.0 - np.arange(31) / 40.0, 0.5), atol=0.01)
    added = np.stack(DISTURBANCES["noise of 10 grey levels"](film).images) - before
    assert added.std() == pytest.approx(10.0, rel=0.02)
    assert abs(np.corrcoef(added[0].ravel(), added[1].ravel())[0, 1]) < 0.05
    hazy = np.stack(FILMS["in haze"](film).images)
    assert hazy.std() == pytest.approx(0.25 * before.std(), rel=0.05)
    assert_array_equal(every_second(film).images, film.images[::2])
    assert len(FILMS["half speed"](film).images) == 61


def test_marks_are_moved_by_three_pixels_and_guessed_to_four(rng):
    row = {str(i): Mark(50.0, 80.0) for i in range(4000)}
    for after, pixels in ((moved(row, rng), 3.0), (guessed(row, list(row), rng), 4.0)):
        x, y = np.array([(mark.x - 50.0, mark.y - 80.0) for mark in after.values()]).T
        assert_allclose([x.std(), y.std()], pixels, rtol=0.04)
        assert {mark.visible for mark in after.values()} == {pixels == 3.0}


@pytest.mark.parametrize(("name", "feet"), FEET.items())
def test_a_row_of_feet_is_what_its_name_says(name, feet):
    assert ("near_toe" in feet.unmarked) == ("far_toe" in feet.unmarked) == ("no toes" in name)
    assert ("near_ankle" in feet.unmarked) == ("no ankles" in name)
    assert ("far_ankle" in feet.unmarked) == ("no ankles" in name or "no far ankle" in name)
    assert (len(feet.guessed), feet.hedge) == (4 if "guessed" in name else 0, "hedge" in name)


@pytest.mark.parametrize(
    ("damage", "exchanged", "missing", "same"),
    [
        (Damage(0.0, exchanged=0.1), 20, 0, 0),
        (Damage(0.0, stretch=10), 10, 0, 0),
        (Damage(0.0, missing=0.1), 0, 120, 0),
        (Damage(0.0, hole=10), 0, 60, 0),
        (Damage(0.0, both=0.2), 0, 0, 40),
    ],
)
def test_points_are_spoiled_as_much_as_asked(damage, exchanged, missing, same):
    places = np.arange(6)[:, None] * [30.0, 17.0] + np.arange(200)[:, None, None] * [0.5, -0.2]
    bad = spoil(Points(NAMES, places, np.ones((200, 6))), damage, np.random.default_rng(0))
    other = (bad.points.places == places[:, twins(NAMES)]).all((1, 2))
    assert np.flatnonzero(other).tolist() == sorted(bad.exchanged)
    assert len(bad.exchanged) == exchanged
    assert np.isnan(bad.points.places).any(-1).sum() == missing
    assert (bad.points.places[:, 4] == bad.points.places[:, 2]).all(-1).sum() == same


def test_the_rival_smoother_conditions_each_path_on_all_its_points():
    rng, n, acceleration, jitter = np.random.default_rng(2), 7, 1.5, 3.0
    y = rng.normal(size=n).cumsum() * 4.0
    y[3] = np.nan
    points = Points(("hip",), np.stack([y, y], axis=1)[:, None], np.ones((n, 1)))
    found = constant_velocity(points, acceleration, jitter).places[:, 0, 0]
    # Place and speed of the first frame and every later change of speed are what all that follows comes from.
    steps = np.tril(np.ones((n, n)))
    steps[0] = 0.0
    C, seen = np.c_[np.ones(n), np.cumsum(steps, axis=0)], np.isfinite(y)
    variance = np.r_[9.0 * jitter**2, 400.0, np.full(n - 1, acceleration**2)]
    first = np.r_[y[0], np.zeros(n)]
    mean, _, _ = condition(first, np.diag(variance), C[seen], jitter**2 * np.eye(6), y[seen])
    assert_allclose(found, C @ mean, atol=1e-6)


def test_lucas_kanade_follows_a_picture_that_shifts_turns_and_grows(rng):
    x, y = [160, 160, 160, 175, 170, 190, 145, 135, 155], [30, 55, 100, 140, 180, 188, 140, 180, 188]
    figure = load_figure()
    marked = dict(zip(figure.joints, zip(map(float, x), map(float, y), strict=True), strict=True))
    body = body_at(start_pose(figure, marked, 1), {name: Mark(*place) for name, place in marked.items()})
    grain = cv2.GaussianBlur(rng.normal(size=(240, 320)), (0, 0), 2.0)
    grey = np.clip(127.0 + 40.0 * grain / grain.std(), 0, 255).astype(np.uint8)
    picture = np.repeat(grey[..., None], 3, axis=2)
    motions = [cv2.getRotationMatrix2D((160.0, 100.0), 1.0 * t, 1.01**t) for t in range(8)]
    pictures = [cv2.warpAffine(picture, m, (320, 240), borderMode=cv2.BORDER_REFLECT) for m in motions]
    carried = np.stack([cv2.transform(body.joints[None], motion)[0] for motion in motions])
    # Flow finds a point to some hundredths of a pixel a frame.
    assert np.abs(np.stack(list(follow(pictures, body))) - carried).max() < 1.0


def test_the_one_state_loop_does_what_inference_does(rng):
    slds = random_slds(1, d=3, order=2, rng=rng)
    y = sample(slds, 20, rng)[2]
    mean, cov, _, log_p = rivals.one_state_loop(slds, y)
    got = viterbi(slds, y)
    assert_allclose(got.states.mean, mean, atol=1e-9)
    assert_allclose(got.states.cov, cov, atol=1e-9)
    assert got.log_evidence == pytest.approx(log_p, rel=1e-11)


def test_every_stage_that_is_timed_is_there():
    assert all(callable(getattr(home, function, None)) for home, function in tracking.STAGES.values())


def test_a_command_is_measured_without_the_memory_of_the_process_that_starts_it(tmp_path):
    ballast = np.ones(40_000_000)  # 305 MB
    used = command._used("synthesise", "--no-clip", "--no-plot", "--out", tmp_path / "poses.csv")
    assert used.megabytes < ballast.nbytes / 2**20


def test_cost_that_grows_is_that_of_a_further_frame():
    long = tuple(Used(5.0 + 0.04 * frames, 100.0) for frames in command.LENGTHS)
    growing = command.Command({}, long, long[0])
    assert growing.milliseconds == pytest.approx(40.0)
    sizes = np.array([1.0, 2.0, 4.0, 8.0])
    assert tracking.Growth(sizes, 3.0 + 2.0 * sizes).astray < 1e-9
    assert tracking.Growth(sizes, sizes**2).astray > 0.1


def test_stride_and_spectrum_of_a_swing_are_its_period_and_its_frequency():
    y = np.zeros((300, 8))
    y[:, 4] = np.cos(2.0 * np.pi * np.arange(300) / 32.0)
    y[:, 6] = -y[:, 4]
    assert stride([y]) == pytest.approx(32.0, abs=0.05)
    # Bins of 30 / 64 Hz without the constant: 30 / 32 Hz is the second.
    assert spectrum([[y]])[:, 2].argmax() == 1


def test_every_formula_that_is_broken_to_try_the_tests_still_stands_there():
    for entry in tomllib.loads(mutations.LIST.read_text(encoding="utf-8"))["mutations"]:
        mutation = mutations.Mutation(**entry)
        mutation.made((mutations.ROOT / mutation.file).read_text(encoding="utf-8"))
        assert all((mutations.ROOT / tests).exists() for tests in mutation.tests)


@pytest.mark.parametrize("ending", [".jpg", ".png"])
def test_a_picture_of_the_gallery_is_made_small_enough_and_one_that_cannot_be_is_refused(
    ending, tmp_path, rng
):
    path = tmp_path / f"noise{ending}"
    gallery.write_small(rng.integers(0, 255, (160, 160, 3), dtype=np.uint8), path)
    assert path.stat().st_size <= gallery.MOST_BYTES
    with pytest.raises(ValueError, match="make the picture smaller"):
        gallery.write_small(rng.integers(0, 255, (1600, 1600, 3), dtype=np.uint8), path)
