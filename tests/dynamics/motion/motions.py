"""Models of motions to test with: a walk and a run, and one whose region is where it comes to rest."""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Gaussian
from dynamics.kalman import predict
from dynamics.slds import combine
from tests.oracles import random_slds


def named(slds, *labels):
    return replace(slds, labels=labels)


def two_motions(rng, *, order=2, noise=0.3):
    """A walk of two states and a run of one, whose first frames fall into their regions."""
    walk = named(random_slds(2, d=3, order=order, travelling=("b",), noise=noise, rng=rng), "walk", "walk")
    run = named(random_slds(1, d=3, order=order, travelling=("b",), noise=noise, rng=rng), "run")
    return combine([walk, replace(run, R=walk.R)], crossing=0.05)


def settled(slds):
    """The system with mean0 and cov0 of every state where its own dynamics come to rest."""
    off, start = slds.layout.from_here, slds.start
    for _ in range(2000):
        start = predict(start, slds.A, slds.b, slds.Q)
        start = Gaussian(start.mean @ off.T, off @ start.cov @ off.T)
    return replace(slds, mean0=start.mean, cov0=start.cov + 1e-9 * np.eye(len(off)))
