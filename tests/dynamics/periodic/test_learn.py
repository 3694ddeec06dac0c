"""Learning strides: EM against the dense evidence, people alike, mirror images, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.periodic.fit import Stretch
from dynamics.periodic.learn import PEOPLE, Piece, _manner, _sinusoid, learn, maximise, mirror_matrix, moments
from tests.dynamics.periodic.strides import FPS, NAMES, TWINS, Z, drawn, little, noisy

LEARNT = {"names": NAMES, "travelling": ("root_x",), "twins": TWINS, "fps": FPS, "label": "walk"}


@pytest.fixture
def people(rng):
    """A stride, and pieces of four people with their fits."""
    stride = little(rng)
    pieces, fits = [], []
    for person in "abcd":
        t, y, phase = drawn(stride, 24, rng)
        pieces.append(Piece(person, t, noisy(stride, y, rng), 0.25))
        fits.append(Stretch(stride, 0, t, pieces[-1].y).fit(float(np.interp(0.0, t, phase)), 6.0))
    return stride, pieces, fits


def linear_evidence(stride, fit):
    """Log density of a piece under a stride, linearised where the old one's fit ended, cell by cell."""
    stretch, old = fit.stretch, fit.stretch.stride
    cells = stretch.cells
    f, J, _ = stretch.value(fit.z, fit.start, cells)
    J = J.copy()
    J[:, Z + 2] *= stride.bend[0] / old.bend[0]
    J[:, Z + 3 :] *= stride.drift[0] / old.drift[0]
    z = fit.z.copy()
    z[Z + 2] /= stride.bend[0] / old.bend[0]
    z[Z + 3 :] /= stride.drift[0] / old.drift[0]
    m = np.append(stride.mean[0], np.zeros(len(z) - Z))
    P = np.eye(len(z))
    P[:Z, :Z] = stride.root[0] @ stride.root[0].T
    P[Z, Z], P[Z + 1, Z + 1] = 100.0**2, 3.0**2
    C = J @ P @ J.T
    t = stretch.t
    for scale, S in ((0.1, stride.quick[0]), (0.4, stride.slow[0])):
        r = np.sqrt(3.0) * np.abs(t[:, None] - t) / scale
        C += np.kron((1.0 + r) * np.exp(-r), S)
    C += np.kron(np.eye(len(t)), stride.R[0])
    away = stretch.y[cells] - f - J @ (m - z)
    return -0.5 * (np.linalg.slogdet(2.0 * np.pi * C)[1] + away @ np.linalg.solve(C, away))


def objective(stride, fits):
    """What a round must not lower: the evidence of a piece a person, and the prior of the covariance."""
    cov = stride.root[0] @ stride.root[0].T
    prior = np.linalg.slogdet(cov)[1] + np.trace(np.linalg.solve(cov, _manner(stride)))
    return sum(linear_evidence(stride, fit) for fit in fits) - 0.5 * PEOPLE * prior


def test_a_round_never_lowers_the_evidence(people):
    stride, pieces, fits = people
    found = [moments(fit) for fit in fits]
    before = objective(stride, fits)
    after = objective(maximise(stride, pieces, found, TWINS), fits)
    assert after > before + 1.0
    # Each part by itself does not lower it either.
    whole = maximise(stride, pieces, found, TWINS)
    for names in (("mean", "root"), ("quick",), ("slow",), ("R",), ("bend",), ("drift",)):
        part = replace(stride, **{name: getattr(whole, name) for name in names})
        assert objective(part, fits) > before - 1e-6, names


def test_the_mirror_image_of_a_piece_teaches_the_same(people):
    stride, pieces, fits = people
    found = [moments(fit) for fit in fits]
    mirrored = []
    for piece, fit in zip(pieces, fits, strict=True):
        stretch = Stretch(stride, 0, piece.t, piece.y[:, TWINS])
        mirrored.append(moments(stretch.fit(fit.start + fit.z[Z + 1] + np.pi, fit.z[Z - 2])))
    one = maximise(stride, pieces, found, TWINS)
    other = maximise(stride, pieces, mirrored, TWINS)
    assert_allclose(other.mean, one.mean, atol=2e-3)
    assert_allclose(other.quick, one.quick, atol=1e-5)
    F = mirror_matrix(stride, TWINS)
    assert_allclose(one.mean[0], F @ one.mean[0], atol=1e-12)
    cov = one.root[0] @ one.root[0].T
    assert_allclose(cov, F @ cov @ F.T, atol=1e-10)


def test_people_count_alike_however_much_there_is_of_them(rng):
    stride = little(rng)
    ys = [noisy(stride, drawn(stride, 40, rng)[1], rng) for _ in range(3)]
    once = learn([*zip("abc", ys, strict=True)], rounds=2, **LEARNT)
    often = learn([*zip("abcaa", [*ys, ys[0], ys[0]], strict=True)], rounds=2, **LEARNT)
    assert_allclose(often.mean, once.mean, atol=1e-9)
    assert_allclose(often.slow, once.slow, atol=1e-9)


def test_what_people_have_in_common_is_learned(rng):
    stride = little(rng, drift=0.05)
    ys = [noisy(stride, drawn(stride, 70, rng)[1], rng) for _ in range(8)]
    ticks = []
    got = learn([*zip("abcdefgh", ys, strict=True)], rounds=4, tick=lambda: ticks.append(1), **LEARNT)
    assert len(ticks) == 4
    assert (got.labels, got.names, got.fps) == (("walk",), NAMES, FPS)
    assert got.mean[0, -2] == pytest.approx(6.0, abs=0.5)
    assert got.mean[0, -1] == pytest.approx(1.4, abs=0.2)
    size = got.basis
    swing = np.hypot(got.mean[0, 2 * size + 1], got.mean[0, 2 * size + 2])
    assert swing == pytest.approx(0.4, abs=0.06)


def test_the_first_phase_is_that_of_the_best_sinusoid(rng):
    t = np.arange(-30, 30) / FPS
    phase, speed = _sinusoid(t, 0.2 + np.cos(0.7 + 6.3 * t) + 0.1 * rng.normal(size=60))
    assert speed == pytest.approx(6.3, abs=0.2)
    assert phase == pytest.approx(0.7, abs=0.1)


def test_sequences_too_short_for_a_stride_and_figures_without_two_sides_are_refused():
    with pytest.raises(ValueError, match=r"no sequence of 'walk' lasts 0\.6 seconds"):
        learn([("a", np.zeros((10, 4)))], rounds=1, **LEARNT)
    with pytest.raises(ValueError, match="a stride needs angles of two sides"):
        learn([("a", np.zeros((90, 4)))], rounds=1, **(LEARNT | {"twins": np.arange(4)}))
