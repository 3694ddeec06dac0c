"""A lost figure is sought as far as it may have gone, and no farther."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gaussian import Gaussian
from kinematics.spm import View, joints
from tests.kinematics.figures import WALKER, upright
from tests.tracker.painted import FULL, STRIDE, Painted, levels_of
from tracker.registration.align import FARTHEST, SEEN, SPREADS, STEP, align, reach, sought
from tracker.registration.field import Field
from tracker.registration.templates import cut

D = len(WALKER.freedoms)
SIZE = (220, 160)
VIEW = View(origin=(110.0, 72.0), unit=50.0, facing=1)
ANGLES = np.full(D - 2, 0.05**2)


def prior(x, y=None):
    """About the stride, its root this uncertain."""
    return Gaussian(STRIDE[None], np.diag(np.r_[x**2, (x if y is None else y) ** 2, ANGLES])[None])


@pytest.fixture(scope="module")
def painted():
    return Painted(np.random.default_rng(20), view=VIEW, size=SIZE)


def field_of(painted, q):
    """The stride's templates before a picture of another pose."""
    before, after = (levels_of(painted.picture(p), view=VIEW) for p in (STRIDE, q))
    return Field(cut(WALKER, VIEW, STRIDE, before, FULL), after, WALKER, VIEW, FULL)


def shifted(x, y=0.0):
    return STRIDE + upright(WALKER, root_x=x, root_y=y)


def away(q, want):
    """Mean distance of the joints, leg lengths."""
    return np.linalg.norm(joints(WALKER, q) - joints(WALKER, want), axis=-1).mean()


@pytest.mark.parametrize("by", [(0.8, 0.0), (-0.8, 0.0), (0.44, 0.23), (-0.3, -0.25)])
def test_a_figure_that_went_elsewhere_is_found_from_a_wide_prior(by, painted):
    field, wide, want = field_of(painted, shifted(*by)), prior(0.5), shifted(*by)
    starts = sought(field, wide, 0)
    assert_allclose(starts[0, :2], want[:2], atol=0.5 * STEP + 1e-9)
    (found,) = align(field, wide, starts)
    assert away(found.q, want) < 0.02  # a pixel
    (blind,) = align(field, wide)
    assert away(blind.q, want) > 0.1


def test_a_figure_farther_off_than_a_narrow_prior_reaches_is_not_found(painted):
    want = shifted(0.8)
    field, narrow = field_of(painted, want), prior(0.1)
    starts = sought(field, narrow, 0)
    assert np.abs(starts[0, :2] - STRIDE[:2]).max() <= SPREADS * 0.1 + 1e-9
    assert away(align(field, narrow, starts)[0].q, want) > 0.5


def test_only_the_root_is_sought_and_by_whole_steps(painted):
    field, wide = field_of(painted, shifted(0.44, 0.23)), prior(0.5)
    starts = sought(field, wide, 0)
    assert starts.shape == (1, D)
    assert_array_equal(starts[:, 2:], wide.mean[:, 2:])
    steps = (starts[0, :2] - STRIDE[:2]) / STEP
    assert_allclose(steps, np.round(steps), atol=1e-9)


def test_a_figure_that_has_not_moved_is_sought_where_it_was(painted):
    assert_array_equal(sought(field_of(painted, STRIDE), prior(0.5), 0)[0], STRIDE)


def test_all_priors_are_shifted_alike_to_where_the_best_of_them_fits(painted):
    field = field_of(painted, shifted(0.5))
    means = np.stack([shifted(-0.3), STRIDE, shifted(0.2)])
    # As the first has it, the figure may not be so far off: that would cost 0.8^2 / 2 / 0.05^2 = 128 nats.
    covs = np.stack([prior(0.05).cov[0], prior(0.5).cov[0], prior(0.3).cov[0]])
    for best, shift in ((0, 0.0), (1, 0.5), (2, 0.3)):
        starts = sought(field, Gaussian(means, covs), best)
        assert_allclose(starts[:, 0] - means[:, 0], shift, atol=0.5 * STEP + 1e-9 if best else STEP + 1e-9)
        assert_allclose(np.ptp(starts - means, axis=0), 0.0, atol=1e-12)
    assert_array_equal(means, np.stack([shifted(-0.3), STRIDE, shifted(0.2)]))


@pytest.fixture(scope="module")
def nowhere(painted):
    """The stride's templates before a picture that none of them matches anywhere."""
    blocks = np.random.default_rng(4).integers(0, 2, (SIZE[1] // 10, SIZE[0] // 10, 3)) * 255
    picture = np.kron(blocks, np.ones((10, 10, 1))).astype(np.uint8)
    return replace(field_of(painted, STRIDE), levels=levels_of(picture, view=VIEW))


@pytest.mark.parametrize("x", [1.2, 1.8, -1.4])
def test_no_pose_is_sought_of_which_most_joints_lie_out_of_the_picture(x, nowhere):
    """Where nothing of the figure shows, nothing speaks against it."""
    (start,) = sought(nowhere, Gaussian(shifted(x)[None], prior(0.7).cov), 0)
    places = VIEW.to_pixels(joints(WALKER, start))
    assert ((places >= 0) & (places <= np.array(SIZE) - 1)).all(axis=-1).mean() >= SEEN


def test_a_figure_foreseen_far_out_of_the_picture_is_not_sought(nowhere):
    gone = Gaussian(shifted(9.0)[None], prior(0.7).cov)
    assert_array_equal(sought(nowhere, gone, 0), gone.mean)


def test_the_reach_is_the_spread_of_the_widest_prior_and_has_an_end():
    covs = np.concatenate([prior(0.1, 0.12).cov, prior(0.2, 0.05).cov])
    both = Gaussian(np.stack([STRIDE, STRIDE]), covs)
    assert_allclose(reach(both), [SPREADS * 0.2, SPREADS * 0.12])
    assert_array_equal(reach(prior(9.0)), FARTHEST)


def test_a_root_that_is_surely_where_it_was_is_not_sought(painted):
    field, sure = field_of(painted, shifted(0.3)), prior(1e-4)
    assert_array_equal(sought(field, sure, 0), sure.mean)


def test_a_start_that_costs_the_prior_more_than_the_picture_gains_is_not_taken(painted):
    """As where the root leans on a correlated prior: shifts against it are dear."""
    field = field_of(painted, shifted(0.4, 0.2))
    cov = np.diag(np.r_[0.3**2, 0.3**2, ANGLES])
    cov[0, 1] = cov[1, 0] = -0.999 * 0.3**2
    tied = Gaussian(STRIDE[None], cov[None])
    dx, dy = sought(field, tied, 0)[0, :2] - STRIDE[:2]
    # Along the tie x and y go opposite ways; right and up at once is 700 nats off.
    assert dx * dy <= 0.0
