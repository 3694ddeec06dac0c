"""Models of motions to test with: a walk and a run, and one whose region is where it comes to rest."""

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

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
    """A one-state model whose region is where its own dynamics come to rest."""
    mean = np.linalg.solve(np.eye(slds.A.shape[-1]) - slds.A[0], slds.b[0])
    return replace(slds, mean0=mean[None], cov0=solve_discrete_lyapunov(slds.A[0], slds.Q[0])[None])
