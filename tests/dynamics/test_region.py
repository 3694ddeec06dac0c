"""What a pose says of the switching state, against scipy's densities."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import mahalanobis
from scipy.stats import multivariate_normal

from dynamics import region
from dynamics.region import CHUNK, POSE, drawn, log_switch, pose_hints, pose_regions, regions
from tests.oracles import random_slds

# Regions are widened by a millionth of the largest variance, their smallest eigenvalue is near a tenth of it.
WIDENED = 1e-4


def travelling_model(K, order, rng):
    """Freedoms a, b, c, of which b travels; unlike means and covariances everywhere."""
    return random_slds(K, d=3, order=order, travelling=("b",), rng=rng)


def moments_without_place(slds, k):
    take = slds.layout.regard  # what is left of a state when the place must not matter
    return take @ slds.mean0[k], take @ slds.cov0[k] @ take.T


@pytest.mark.parametrize("order", [1, 2])
def test_a_pose_speaks_for_a_state_by_half_its_log_density_there(order, rng):
    slds = travelling_model(3, order, rng)
    y = rng.normal(size=(6, 3))
    stays = [0, 2]
    want = np.empty((6, 3))
    for k in range(3):
        cov = slds.cov0[k][np.ix_(stays, stays)] + slds.R[np.ix_(stays, stays)]
        want[:, k] = multivariate_normal(slds.mean0[k][stays], cov).logpdf(y[:, stays])
    # Rounding in logs near 10.
    assert_allclose(pose_hints(slds, y), 0.5 * want, atol=1e-12)
    assert_allclose(pose_hints(slds, y, 2.0), 2.0 * want, atol=1e-12)
    assert POSE == 0.5


def test_a_pose_is_compared_with_what_is_measured_of_the_region(rng):
    slds = replace(random_slds(2, d=2, order=2, rng=rng), C=rng.normal(size=(2, 4)))
    y = rng.normal(size=(5, 2))
    for k in range(2):
        seen = multivariate_normal(slds.C @ slds.mean0[k], slds.C @ slds.cov0[k] @ slds.C.T + slds.R)
        assert_allclose(pose_hints(slds, y, 1.0)[:, k], seen.logpdf(y), atol=1e-12)


def test_what_was_not_measured_does_not_speak(rng):
    slds = travelling_model(2, 2, rng)
    y = rng.normal(size=(4, 3))
    y[0, 0] = y[1, [0, 2]] = y[2] = y[3, 1] = np.nan
    got = pose_hints(slds, y, 1.0)
    for k in range(2):
        c = multivariate_normal(slds.mean0[k][2], slds.cov0[k][2, 2] + slds.R[2, 2])
        assert got[0, k] == pytest.approx(c.logpdf(y[0, 2]), abs=1e-12)
    assert_array_equal(got[1:3], 0.0)
    assert (got[3] != 0.0).all()


def test_where_all_freedoms_travel_no_pose_speaks(rng):
    slds = random_slds(2, order=2, travelling=("a", "b"), rng=rng)
    assert_array_equal(pose_hints(slds, rng.normal(size=(3, 2))), 0.0)


@pytest.mark.parametrize("order", [1, 2])
def test_moments_density_and_distance_of_a_region_are_those_without_the_place(order, rng):
    slds = travelling_model(3, order, rng)
    x = 2.0 * rng.normal(size=(7, 3, 3 * order))
    reach = regions(slds)
    log_density, distance = reach.log_density(x), reach.distance(x)
    assert log_density.shape == distance.shape == (7, 3)
    assert_array_equal(reach.cov, np.swapaxes(reach.cov, 1, 2))
    for k in range(3):
        mean, cov = moments_without_place(slds, k)
        assert_allclose(reach.mean[k], mean, atol=1e-14)
        assert_allclose(reach.cov[k], cov, atol=WIDENED)
        seen = x[:, k] @ slds.layout.regard.T
        assert_allclose(
            log_density[:, k], multivariate_normal(mean, cov).logpdf(seen), rtol=WIDENED, atol=WIDENED
        )
        want = [mahalanobis(z, mean, np.linalg.inv(cov)) ** 2 for z in seen]
        assert_allclose(distance[:, k], want, rtol=WIDENED)


def test_what_is_asked_frame_after_frame_is_worked_out_once(monkeypatch, rng):
    asked = Mock(wraps=region.inverse_root)
    monkeypatch.setattr(region, "inverse_root", asked)
    reach, x = regions(travelling_model(2, 2, rng)), rng.normal(size=(5, 1, 6))
    for _ in range(3):
        reach.log_density(x), reach.distance(x)
    assert asked.call_count == 1


@pytest.mark.parametrize("order", [1, 2])
def test_a_region_of_poses_knows_neither_place_nor_speed(order, rng):
    slds = travelling_model(2, order, rng)
    poses, stays = pose_regions(slds), [0, 2]
    x = rng.normal(size=(6, 2, 3 * order))
    for k in range(2):
        mean, cov = slds.mean0[k][stays], slds.cov0[k][np.ix_(stays, stays)]
        want = multivariate_normal(mean, cov).logpdf(x[:, k, stays])
        assert_allclose(poses.log_density(x)[:, k], want, rtol=WIDENED, atol=WIDENED)


def test_a_region_that_is_a_point_still_has_a_density(rng):
    slds = travelling_model(2, 2, rng)
    cov0 = slds.cov0.copy()
    cov0[1] = 0.0
    reach = regions(replace(slds, cov0=cov0))
    inside, outside = slds.mean0[1], slds.mean0[1] + 0.1
    assert np.isfinite(reach.log_density(outside[None])).all()
    assert reach.log_density(inside[None])[1] > reach.log_density(outside[None])[1] + 100.0
    assert reach.distance(inside[None])[1] == pytest.approx(0.0, abs=1e-12)


def test_a_long_sequence_says_of_each_frame_what_the_frame_alone_says(rng):
    slds = travelling_model(2, 2, rng)
    y = rng.normal(size=(2 * CHUNK + 3, 3))
    y[5, 0] = y[CHUNK] = np.nan
    some = [0, 5, CHUNK - 1, CHUNK, CHUNK + 1, 2 * CHUNK + 2]
    assert_allclose(pose_hints(slds, y)[some], pose_hints(slds, y[some]), atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_a_state_is_entered_where_it_leads_into_its_region(order, rng):
    slds = travelling_model(3, order, rng)
    x = 0.5 * rng.normal(size=(4, 3, 3 * order))
    got = log_switch(slds, regions(slds), x, 0.7)
    shared = log_switch(slds, regions(slds), x[:, :1], 0.7)
    for t in range(4):
        for j in range(3):
            for before, found in ((x[t, j], got[t, j]), (x[t, 0], shared[t, j])):
                led = [slds.layout.regard @ (slds.A[i] @ before + slds.b[i]) for i in range(3)]
                density = [multivariate_normal(*moments_without_place(slds, i)).pdf(led[i]) for i in range(3)]
                want = slds.Pi[j] * np.power(density, 0.7)
                assert_allclose(found, np.log(want / want.sum()), rtol=WIDENED, atol=WIDENED)


@pytest.mark.parametrize("order", [1, 2])
def test_a_step_drawn_to_its_region_has_the_density_of_both(order, rng):
    slds = travelling_model(2, order, rng)
    towards = drawn(slds, 0.4)
    for k in range(2):
        mean, cov = moments_without_place(slds, k)
        ratios = []
        x = rng.normal(size=3 * order)
        for pose in 0.3 * rng.normal(size=(5, 3)):
            after = np.concatenate([pose, x[:3]])[: 3 * order]
            own, new = (
                multivariate_normal((m.A[k] @ x + m.b[k])[:3], m.Q[k][:3, :3]).logpdf(pose)
                for m in (slds, towards)
            )
            region = multivariate_normal(mean, cov).logpdf(slds.layout.regard @ after)
            ratios.append(new - own - 0.4 * region)
        assert_allclose(ratios, ratios[0], rtol=1e-3)  # regions are widened a little
        assert_allclose((towards.A[k] @ x + towards.b[k])[3:], x[:3][: 3 * (order - 1)], atol=1e-12)
        assert_array_equal(towards.Q[k][3:], 0.0)
