"""Gait drawn from a stride: its processes against their covariance, a person against the population."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.periodic.synthesis import matern_paths, synthesise_stride
from tests.dynamics.periodic.strides import FPS, SIZE, M, little


class OneByOne:
    """A generator whose numbers are unknowns: what is drawn from it is a linear map of them."""

    def __init__(self, number):
        self.rest = iter(np.eye(number).reshape(-1, 2, number))

    def standard_normal(self, shape):
        return next(self.rest)


@pytest.mark.parametrize("scale", [0.1, 0.4, 4.0])
def test_paths_have_the_covariance_of_a_matern_process(scale):
    T, step = 30, 1.0 / FPS
    number = 2 * (T + 1)
    root = matern_paths(T, step, scale, number, OneByOne(number))
    r = np.sqrt(3.0) * step * np.abs(np.arange(T)[:, None] - np.arange(T)) / scale
    assert_allclose(root @ root.T, (1.0 + r) * np.exp(-r), atol=1e-9)


def test_without_noise_one_stride_of_a_person_repeats(rng):
    stride = little(rng)
    y = synthesise_stride(stride, 0, 40, FPS, np.random.default_rng(5), noise=0.0)
    z = stride.mean[0] + stride.root[0] @ np.random.default_rng(5).standard_normal(stride.mean.shape[1])
    c, (speed, travel) = z[: M * SIZE].reshape(M, SIZE), z[M * SIZE :]

    def away(start):
        phase = start + speed * np.arange(40) / FPS
        naive = [
            [c[m] @ [1, np.cos(p), np.sin(p), np.cos(2 * p), np.sin(2 * p)] for m in range(M)] for p in phase
        ]
        return np.abs(y - naive - np.outer(travel * np.arange(40) / FPS, [1, 0, 0, 0])).max()

    starts = np.linspace(0.0, 2.0 * np.pi, 2001)
    assert min(map(away, starts)) < 2e-3


def test_people_differ_as_the_population_does(rng):
    stride = little(rng, speed=6.0)
    means = []
    for _ in range(300):
        y = synthesise_stride(stride, 0, 240, FPS, rng, noise=0.0)
        means.append(y[:, 2].mean())
    spread = (stride.root[0] @ stride.root[0].T)[2 * SIZE, 2 * SIZE] ** 0.5
    assert np.std(means) == pytest.approx(spread, rel=0.15)
    assert np.mean(means) == pytest.approx(stride.mean[0][2 * SIZE], abs=0.01)


def test_noise_is_a_factor_of_what_no_stride_has(rng):
    stride = little(rng)
    seeds = range(40)

    def drawn(noise):
        return [synthesise_stride(stride, 0, 60, FPS, np.random.default_rng(s), noise) for s in seeds]

    calm, usual, wild = (np.array(drawn(noise)) for noise in (0.0, 1.0, 2.0))
    angles = slice(1, M)
    rough = [np.diff(y[..., angles], 2, axis=1).std() for y in (usual - calm, wild - calm)]
    assert rough[1] == pytest.approx(2.0 * rough[0], rel=0.1)
