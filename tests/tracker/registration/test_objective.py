"""The one function that registration lowers: against a slow twin, and the differences of that."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.gaussian import Gaussian
from kinematics.spm import covering, skeleton
from tests.kinematics.figures import WALKER, upright
from tests.oracles import central_difference
from tests.tracker.painted import CLASSIC, FULL, SIZE, VIEW, placed
from tracker.picture.backdrop import NOISE, UNKNOWN, Scenery
from tracker.picture.pyramid import Level, sample
from tracker.registration.align import BETTER, align
from tracker.registration.field import Field
from tracker.registration.modes import mode_of
from tracker.registration.objective import IN_SIGHT, OUT_OF_SIGHT, Objective
from tracker.registration.templates import cut, hiding

D = len(WALKER.freedoms)
WEAK = np.diag(np.full(D, 0.1**2))
# The far leg half behind the near one, its knee past its limit.
CROSSED = upright(WALKER, torso=0.08, hip_near=0.2, knee_near=0.15, hip_far=0.05, knee_far=-0.3, scale=0.02)


def bilinear_level(rng, sigma):
    """A level whose values are a + b x + c y + d x y per channel: read without error between pixels."""
    x, y = np.meshgrid(*(np.arange(side)[..., None] / 100.0 for side in SIZE))
    x, y = x.reshape(*SIZE[::-1], 1), y.reshape(*SIZE[::-1], 1)
    a, b, c, d = rng.normal(scale=60.0, size=(4, 3))
    return Level((128.0 + a + b * x + c * y + d * x * y).astype(np.float32), np.zeros(2), 1, sigma)


def crossed(settings, rng):
    """Two levels, templates that fit them from well to badly by link, and a scene known here and there."""
    levels = [bilinear_level(rng, sigma) for sigma in (4.0, 1.0)]
    settings = settings.model_copy(update={"blurs": (0.05, 0.0125), "covered": 0.1, "noise": 6.0})
    apart = upright(WALKER, hip_near=0.9, hip_far=-0.9)
    known = cut(WALKER, VIEW, apart, levels, settings).known
    templates = cut(WALKER, VIEW, CROSSED, levels, settings)
    spread = np.linspace(4.0, 30.0, len(WALKER.links))[templates.link][:, None]
    colours = (templates.colours + spread * rng.normal(size=templates.colours.shape)).astype(np.float32)
    templates = replace(templates, colours=colours, known=known, light=np.array([2.0, -3.0, 1.0]))
    differs = np.kron(rng.uniform(0.0, 2.0, (4, 4)), np.ones((10, 10))).astype(np.float32)
    return Field(templates, levels, WALKER, VIEW, settings, Scenery(differs, 5))


def laid(field, number):
    """The objective, and the templates laid on one level at the crossed legs."""
    objective = Objective(field, number)
    return objective, objective.compare(CROSSED[None])


class Twin:
    """E with what is held fixed in its derivative as it is at one pose: visible points, scene and offsets."""

    def __init__(self, field, number, q, offset):
        self.field, self.mode, self.offset = field, mode_of(field.settings), offset
        self.level, templates = field.levels[number], field.templates
        self.every = 1 if number == len(field.levels) - 1 else self.mode.coarse
        self.colours = templates.colours[number].astype(float)
        points = placed(WALKER, q, templates)
        pixels = VIEW.to_pixels(points)
        margin = hiding(self.level, VIEW, field.settings)
        hidden = covering(WALKER, skeleton(WALKER, q), points, templates.link, margin)
        kept = np.arange(len(points)) % self.every == 0
        self.visible = templates.known & kept & ~(hidden & self.mode.layered)
        assert ((pixels > 1) & (pixels < np.array(SIZE) - 2)).all()
        column, row = np.floor(pixels + 0.5).astype(int).T // field.scenery.step
        inner = templates.weight == 1.0
        ratio = np.log(NOISE / field.settings.noise)
        self.behind = ratio + np.where(inner, field.scenery.differs[row, column], UNKNOWN)
        around = field.scenery.around[row, column]
        self.mixed = inner & (around < UNKNOWN) & (self.mode.covered > 0.0)
        self.around = ratio + around
        # What a point of weight 1 counts.
        self.tau = field.settings.tempering * len(points) / kept.sum()

    def residual(self, q):
        """(P, 3)"""
        templates = self.field.templates
        values = sample(self.level, VIEW.to_pixels(placed(WALKER, q, templates)))[0]
        return values - self.colours - self.offset[templates.link]

    def losses(self, residual):
        """(P,) of residuals (P, 3): of the figure, or of the figure mixed with the scene."""
        square = (residual**2).sum(axis=1) / (3.0 * self.field.settings.noise**2)
        s = self.mode.robust
        loss = 0.5 * square if np.isinf(s) else 0.5 * s * np.log1p(square / s)
        c = self.mode.covered
        mixture = -np.log((np.exp(-3.0 * loss) + c * np.exp(-3.0 * self.around)) / (1.0 + c)) / 3.0
        return np.where(self.mixed, mixture, loss)

    def links(self, q):
        """Of each link: which of its points are visible, and their mean loss."""
        templates, losses = self.field.templates, self.losses(self.residual(q))
        for i in range(len(WALKER.links)):
            own = self.visible & (templates.link == i)
            if own.any():
                yield own, np.average(losses[own], weights=templates.weight[own])

    def fade(self, loss):
        """What a link of this mean loss costs."""
        if not self.mode.layered:
            return loss
        a, b = (-0.5 * self.mode.robust * np.log(m) for m in (IN_SIGHT, OUT_OF_SIGHT))
        x = np.clip(loss, a, b) - a
        return min(loss, a) + x - 0.5 * x**2 / (b - a)

    def share(self, loss):
        """Of a link in sight: the derivative of what it costs."""
        return (self.fade(loss + 1e-6) - self.fade(loss - 1e-6)) / 2e-6

    def __call__(self, q):
        w, total = self.field.templates.weight, 0.0
        for own, loss in self.links(q):
            total += w[own].sum() * self.fade(loss) - w[own] @ self.behind[own]
        low, high = WALKER.limits
        beyond = q - np.clip(q, low, high)
        return self.tau * total + 0.5 * self.mode.stiffness * beyond @ beyond


@pytest.fixture(params=[(FULL, 0), (FULL, 1), (CLASSIC, 1)], ids=["coarse", "fine", "classic"])
def case(request, rng):
    """An objective and its twin at the crossed legs."""
    settings, number = request.param
    field = crossed(settings, rng)
    objective, fit = laid(field, number)
    return objective, fit, Twin(field, number, CROSSED, fit.laid.offset[0])


def test_the_crossed_legs_have_all_that_the_function_speaks_of(rng):
    field = crossed(FULL, rng)
    _, fit = laid(field, 1)
    twin = Twin(field, 1, CROSSED, fit.laid.offset[0])
    templates = field.templates
    far = np.isin(templates.link, [WALKER.link_of("far_knee"), WALKER.link_of("far_ankle")])
    assert 0.2 < twin.visible[far & templates.known].mean() < 0.8
    assert (templates.weight < 1.0)[twin.visible].sum() > 100
    assert 0.1 < twin.mixed[twin.visible].mean() < 0.9
    assert (WALKER.limits[0] > CROSSED).any()
    assert np.abs(fit.laid.offset - templates.light).max() < FULL.light
    shares = np.array([twin.share(loss) for _, loss in twin.links(CROSSED)])
    assert ((shares > 0.1) & (shares < 0.9)).any()


def test_the_evidence_is_the_function(case):
    objective, fit, twin = case
    # Residuals in float32, 1e-5 of grey levels of which about 6 weigh.
    assert objective.linearised(fit)[0][0] == pytest.approx(twin(CROSSED), rel=1e-5)


def test_the_slope_is_the_derivative_of_the_function(case):
    objective, fit, twin = case
    _, _, (gradient,) = objective.linearised(fit)
    want = central_difference(twin, CROSSED, step=1e-5)
    assert np.abs(want).max() > 5.0
    assert_allclose(gradient, want, rtol=1e-3, atol=1e-4 * np.abs(want).max())


def test_the_information_is_the_gauss_newton_matrix_of_the_function(case):
    objective, fit, twin = case
    _, (information,), _ = objective.linearised(fit)
    J = central_difference(twin.residual, CROSSED, step=1e-4)  # (P, 3, D)
    # The derivative of the function by half the square of each point's residual.
    residual = twin.residual(CROSSED)
    up, down = (twin.losses(residual * np.sqrt(1.0 + step)) for step in (1e-4, -1e-4))
    by_loss = np.zeros(len(residual))
    for own, loss in twin.links(CROSSED):
        by_loss[own] = twin.tau * twin.share(loss) * twin.field.templates.weight[own]
    by_square = by_loss * (up - down) / (2e-4 * 0.5 * (residual**2).sum(axis=1))
    low, high = WALKER.limits
    limits = np.diag(twin.mode.stiffness * (np.clip(CROSSED, low, high) != CROSSED))
    want = np.einsum("pcd,p,pce->de", J, by_square, J) + limits
    assert_allclose(information, want, atol=1e-3 * np.abs(want).max())


def test_what_is_handed_on_is_the_function_at_the_mode_and_the_climb_has_lowered_it_and_the_prior(rng):
    field = crossed(FULL.model_copy(update={"image_weight": 0.4}), rng)
    priors = Gaussian(CROSSED + 0.03 * rng.normal(size=(6, D)), np.repeat(WEAK[None], 6, axis=0))
    alone = replace(field, templates=replace(field.templates, colours=field.templates.colours[1:]))
    alone = replace(alone, levels=field.levels[1:])
    objective = Objective(alone, 0)
    before, _, _ = objective.linearised(objective.compare(priors.mean))
    found = align(alone, priors)
    fit = objective.compare(np.stack([r.q for r in found]))
    cost, *whole = objective.linearised(fit)
    seen = np.clip(1.0 - fit.laid.bare / BETTER, 0.0, 1.0)  # of links that the scene explains better
    assert (seen < 1.0).any()
    assert (seen > 0.0).any()
    moments, pull = np.einsum("hl,hlij->hlij", seen, fit.laid.moments), seen[..., None] * fit.laid.pull
    some = replace(fit, laid=fit.laid._replace(moments=moments, pull=pull))
    _, information, gradient = objective.linearised(some)
    assert not np.allclose(information, whole[0])
    assert_allclose([r.cost for r in found], 0.4 * cost, rtol=1e-9)
    assert_allclose([r.misfit for r in found], fit.laid.mean, rtol=1e-9)
    assert_allclose([r.shown for r in found], fit.laid.shown, rtol=1e-9)
    assert_allclose([r.information for r in found], information, rtol=1e-9, atol=1e-9)
    away = fit.q - priors.mean
    leaning = 0.5 * np.einsum("hd,de,he->h", away, np.linalg.inv(WEAK), away)
    assert (cost + leaning < before).all()
    for r, H, g in zip(found, information, gradient, strict=True):
        assert_allclose(r.vector, H @ r.q - g, atol=1e-8 * np.abs(r.vector).max())
