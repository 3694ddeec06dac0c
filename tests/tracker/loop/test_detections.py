"""Detected joints as a measurement: its mode, what is linearised there, and whose leg is whose."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import minimize
from scipy.stats import multivariate_t

from dynamics.gaussian import Gaussian, transpose
from kinematics.sides import other_side
from kinematics.spm import View, joint_jacobian, joints
from tests.kinematics.figures import ARMS, FOOTLESS, WALKER, upright
from tests.oracles import central_difference
from tests.tracker.loop.walks import NAMES, detected, pixels_of
from tests.tracker.painted import FULL, STRIDE, VIEW
from tracker.loop.detections import EXCHANGED, FARTHEST, FREEDOM, Detections, Detector
from tracker.registration.field import Likelihood

D = len(WALKER.freedoms)
NETWORK = Detector(WALKER, VIEW, FULL)


def namings(detector, found, prior):
    """What each naming says by itself."""
    told = vars(detector.namings(found, prior))
    return [Likelihood(*parts) for parts in zip(*told.values(), strict=True)]


def ways_of(found):
    """The points as each naming has them, joint by joint: as told, exchanged, on the near, on the far leg."""
    names = [WALKER.joints[j] for j in found.joint]
    ways = [
        names,
        [other_side(name) for name in names],
        [name.replace("far_", "near_") for name in names],
        [name.replace("near_", "far_") for name in names],
    ]
    return [Detections(np.array([WALKER.joints.index(n) for n in way]), found.pixels) for way in ways]


def prior_about(q, sd=0.05):
    sd = np.broadcast_to(sd, D)
    return Gaussian(q[None], np.diag(sd**2)[None])


def minus_log_points(q, found, view=VIEW, settings=FULL):
    """Of the points in a pose, as scipy has it."""
    at, shape = pixels_of(q, view), settings.point**2 * np.eye(2)
    away = (found.pixels - [at[WALKER.joints[j]] for j in found.joint]) / view.unit
    return -multivariate_t.logpdf(away, shape=shape, df=FREEDOM).sum()


def minus_log_density(q, found, prior, view=VIEW, settings=FULL):
    """Of pose and points together but for a constant."""
    away = q - prior.mean[0]
    points = minus_log_points(q, found, view, settings)
    return 0.5 * away @ np.linalg.solve(prior.cov[0], away) + points


@pytest.mark.parametrize("facing", [1, -1])
def test_each_naming_settles_where_the_density_of_pose_and_points_is_highest(facing, rng):
    view = replace(VIEW, facing=facing)
    found = detected(STRIDE, view=view)
    found = replace(found, pixels=found.pixels + rng.normal(0.0, 4.0, found.pixels.shape))
    found.pixels[3] += 40.0  # one point far off
    prior = prior_about(STRIDE + rng.normal(0.0, 0.05, D))
    ways, all_told = ways_of(found), namings(Detector(WALKER, view, FULL), found, prior)
    for way, told in zip(ways, all_told, strict=True):
        slope = central_difference(lambda q, way=way: minus_log_density(q, way, prior, view), told.q[0], 1e-5)
        # The search ends at steps of 1e-4, and the density's curvature is about 1e4 at most.
        assert np.abs(slope).max() < 1.0
        leans = np.linalg.solve(prior.cov[0], told.q[0] - prior.mean[0])
        assert_allclose(told.vector[0], told.information[0] @ told.q[0] + leans, atol=1.0)
        start = minus_log_density(prior.mean[0], way, prior, view)
        best = minimize(minus_log_density, told.q[0], (way, prior, view), tol=1e-2).fun
        reached = minus_log_density(told.q[0], way, prior, view)
        assert reached - best < 1e-3 < start - best
    costs = [minus_log_points(told.q[0], way, view) for way, told in zip(ways, all_told, strict=True)]
    want = costs - np.log([0.88, 0.1, 0.01, 0.01])  # as FULL has them
    got = np.array([told.cost[0] for told in all_told])
    assert_allclose(got - got[0], want - want[0], rtol=1e-9)


def test_doubted_points_are_those_of_a_wider_spread(rng):
    found = detected(STRIDE + rng.normal(0.0, 0.1, D))
    wide = Detector(WALKER, VIEW, FULL.model_copy(update={"point": 3.0 * FULL.point}))
    doubted = NETWORK.namings(replace(found, doubt=3.0), prior_about(STRIDE))
    for got, want in zip(
        vars(doubted).values(), vars(wide.namings(found, prior_about(STRIDE))).values(), strict=True
    ):
        assert_allclose(got, want, rtol=1e-12)


def evidence(way, prior, settings, freedoms):
    """Minus the log of the points' probability, summed over a grid of two freedoms; the others are known."""
    grid = np.linspace(-0.16, 0.16, 13)
    total = 0.0
    floor = minus_log_density(prior.mean[0], way, prior, settings=settings)
    for a in grid:
        for b in grid:
            q = prior.mean[0].copy()
            q[freedoms] += (a, b)
            total += np.exp(floor - minus_log_density(q, way, prior, settings=settings))
    return floor - np.log(total)


@pytest.mark.parametrize(("exchange", "one_leg"), [(0.1, 0.02), (0.4, 0.2)])
def test_names_are_weighed_as_the_sum_over_all_poses_weighs_them(exchange, one_leg, rng):
    # Legs so near each other that any naming may be right.
    q = upright(WALKER, hip_near=0.06, hip_far=0.0, torso=0.05)
    settings = FULL.model_copy(update={"exchange": exchange, "one_leg": one_leg, "point": 0.05})
    free = [WALKER.index("hip_near"), WALKER.index("hip_far")]
    sd = np.full(D, 1e-6)
    sd[free] = 0.04
    prior = prior_about(q, sd)
    found = detected(q, swap=True)
    found = replace(found, pixels=found.pixels + rng.normal(0.0, 1.0, found.pixels.shape))
    costs = []
    for told in namings(Detector(WALKER, VIEW, settings), found, prior):
        away = told.q[0] - q
        spread = np.linalg.slogdet(np.eye(D) + prior.cov[0] @ told.information[0])[1]
        costs.append(told.cost[0] + 0.5 * away @ (away / sd**2) + 0.5 * spread)
    rare = [exchange, one_leg / 2.0, one_leg / 2.0]
    want = [evidence(way, prior, settings, free) for way in ways_of(found)] - np.log([1.0 - sum(rare), *rare])
    # A Student t is a Gaussian only at its mode: about a tenth of a nat here.
    assert_allclose(np.subtract(costs, costs[0]), want - want[0], atol=0.15)
    assert np.ptp(want) > 0.5


def test_exchanged_names_are_seen_for_what_they_are():
    found = detected(STRIDE, swap=True)
    told, exchanged, *_ = namings(NETWORK, found, prior_about(STRIDE))
    assert exchanged.cost[0] < told.cost[0] - 10.0
    assert_allclose(exchanged.q[0], STRIDE, atol=1e-6)
    assert NETWORK.misnamed(found, STRIDE)
    assert not NETWORK.misnamed(detected(STRIDE), STRIDE)


def test_names_are_not_taken_for_exchanged_where_that_makes_no_difference():
    together = upright(WALKER, torso=0.1)
    assert not NETWORK.misnamed(detected(together), together)


@pytest.mark.parametrize("seen", ["near", "far"])
def test_one_leg_s_points_on_both_legs_leave_the_other_where_it_was_foreseen(seen):
    found = detected(STRIDE)
    at = pixels_of(STRIDE)
    for i, j in enumerate(found.joint):
        name = WALKER.joints[j]
        found.pixels[i] = at[name.replace("near", seen).replace("far", seen)]
    ways = namings(NETWORK, found, prior_about(STRIDE))
    costs = [told.cost[0] for told in ways]
    assert int(np.argmin(costs)) == {"near": 2, "far": 3}[seen]
    best = ways[int(np.argmin(costs))]
    assert_allclose(best.q[0], STRIDE, atol=1e-6)
    unseen = WALKER.index("knee_far" if seen == "near" else "knee_near")
    assert best.information[0][unseen, unseen] == 0.0
    assert min(np.delete(costs, np.argmin(costs))) > min(costs) + 5.0
    assert not NETWORK.misnamed(found, STRIDE)
    assert NETWORK.agreement(found, STRIDE) == (1.0, False)


def test_what_the_figure_has_not_and_what_is_not_there_is_left_out():
    figure = FOOTLESS
    at = pixels_of(STRIDE)
    places = np.array([[np.nan, 1.0] if name == "neck" else at[name] for name in NAMES])
    found = Detections.of(figure, NAMES, places)
    assert [figure.joints[j] for j in found.joint] == [
        name for name in NAMES if "toe" not in name and name != "neck"
    ]
    assert_allclose(found.pixels[1], at["hip"])
    nothing = Detections.of(figure, NAMES, np.full((9, 2), np.nan))
    n = len(figure.freedoms)
    anything = Gaussian(np.zeros((2, n)), np.stack([np.eye(n)] * 2))
    told, exchanged, *_ = namings(Detector(figure, VIEW, FULL), nothing, anything)
    assert_array_equal(told.information, 0.0)
    assert_allclose(exchanged.cost - told.cost, np.log(0.88 / 0.1))


def test_exchanging_names_twice_leaves_them_and_the_trunk_keeps_its_own():
    found = detected(STRIDE)
    once = replace(found, joint=found.ways(WALKER)[EXCHANGED])
    assert_array_equal(once.ways(WALKER)[EXCHANGED], found.joint)
    changed = {NAMES[i]: WALKER.joints[j] for i, j in enumerate(once.joint)}
    assert changed["near_ankle"] == "far_ankle"
    assert changed["far_toe"] == "near_toe"
    assert changed["hip"] == "hip"


def test_agreement_is_one_where_points_meet_joints_and_little_far_off():
    assert NETWORK.agreement(detected(STRIDE), STRIDE) == (1.0, True)
    assert NETWORK.agreement(detected(STRIDE, swap=True), STRIDE) == (1.0, True)
    part, whole = NETWORK.agreement(detected(STRIDE, without=("neck",)), STRIDE)
    assert (part, whole) == (1.0, False)
    off = detected(STRIDE)
    off.pixels[0] += 0.3 * VIEW.unit
    part, whole = NETWORK.agreement(off, STRIDE)
    assert 8 / 9 < part < 9 / 9
    assert not whole
    far = View((VIEW.origin[0] + VIEW.unit, VIEW.origin[1]), VIEW.unit, 1)
    assert Detector(WALKER, far, FULL).agreement(detected(STRIDE), STRIDE)[0] < 0.02


def test_the_way_to_the_points_is_the_most_likely_step_where_steps_are_small():
    found = detected(STRIDE + upright(WALKER, knee_near=0.004, hip_far=-0.002), without=("neck", "far_toe"))
    names, spread = [WALKER.joints[j] for j in found.joint], FULL.point * VIEW.unit

    def cost(step):
        at = pixels_of(STRIDE + step)
        away = np.array([at[name] for name in names]) - found.pixels
        return (away**2).sum() / spread**2 + (step**2).sum() / FARTHEST**2

    step = minimize(cost, np.zeros(D), method="BFGS", tol=1e-12).x
    wrong = 1.0 - NETWORK.agreement(found, STRIDE)[0]
    assert_allclose(
        NETWORK.elsewhere(found, STRIDE), wrong * np.outer(step, step), atol=0.005 * wrong * step @ step
    )


def test_a_covariance_stays_where_points_agree_or_are_none():
    assert_allclose(NETWORK.elsewhere(detected(STRIDE), STRIDE), 0.0, atol=1e-12)
    assert_allclose(NETWORK.elsewhere(detected(STRIDE, names=()), STRIDE), 0.0)


def test_a_covariance_reaches_the_other_leg_where_points_name_the_legs_otherwise():
    wider = NETWORK.elsewhere(detected(STRIDE, swap=True), STRIDE)
    J = joint_jacobian(WALKER, STRIDE)
    covs = J @ wider @ transpose(J)
    apart = joints(WALKER, STRIDE)[WALKER.joint_twins] - joints(WALKER, STRIDE)
    for name in ("near_knee", "near_ankle", "far_knee", "far_ankle"):
        joint = WALKER.joints.index(name)
        cov = covs[joint] + FULL.mark**2 * np.eye(2)
        assert apart[joint] @ np.linalg.solve(cov, apart[joint]) < 4.0


def test_points_of_one_figure_are_those_of_another_by_their_names():
    places = np.arange(6.0).reshape(3, 2)
    found = Detections.of(WALKER, ("near_toe", "hip", "far_knee"), places)
    other = found.named(WALKER, ARMS)
    assert {ARMS.joints[j]: tuple(at) for j, at in zip(other.joint, other.pixels, strict=True)} == {
        "near_toe": (0.0, 1.0),
        "hip": (2.0, 3.0),
        "far_knee": (4.0, 5.0),
    }
    less = found.named(WALKER, FOOTLESS)
    assert [FOOTLESS.joints[j] for j in less.joint] == ["hip", "far_knee"]
    assert_allclose(less.pixels, places[[1, 2]])
