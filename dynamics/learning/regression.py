"""The M-step's regression: A, b and Q of every switching state from expected second moments.

With v = [x_t's pose; x_{t-1}; 1] and V_k = sum_t E[v v' s_t(k)], everything the regression needs is linear in
v: the target Y = pose_t - E x_{t-1} and the regressors phi = [F x_{t-1}; 1]. E is the layout's `carry` and F
its `regard`, so the dynamics cannot depend on where the figure stands. The prior on B = [coefficients,
offset] is centred on constant velocity, the layout's `steady`.
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, symmetric, transpose
from dynamics.layout import Layout


@dataclass(frozen=True)
class Ridge:
    """The prior of the regression; zeros make it maximum likelihood.

    strength : (N' + 1,) precision of each regressor's coefficient about constant velocity
    noise    : (d,) scale of the inverse-Wishart prior of Q, its diagonal
    count    : its degrees of freedom less what makes it proper
    """

    strength: Array
    noise: Array
    count: float


def maximum_likelihood(layout: Layout) -> Ridge:
    """The empty prior, which adds nothing to the moments."""
    return Ridge(np.zeros(layout.steady.shape[1]), np.zeros(len(layout.steady)), 0.0)


def solve(V: Array, n: Array, layout: Layout, ridge: Ridge) -> tuple[Array, Array, Array]:
    """The dynamics that maximise the expected log joint plus the log prior.

    From expected second moments V (K, d + N + 1, d + N + 1) of v and steps n (K,) into each state: A (K, N,
    N), b (K, N), Q (K, N, N). Q is at the joint mode over coefficients and noise: [E + (B - M0) K0 (B - M0)'
    + Psi] / (n + count + number of regressors with a prior).
    """
    d = layout.d
    to_target = np.hstack([np.eye(d), -layout.carry, np.zeros((d, 1))])
    to_regressors = np.pad(layout.regard, ((0, 1), (d, 1)))
    to_regressors[-1, -1] = 1.0
    S_yp = to_target @ V @ to_regressors.T
    S_pp = to_regressors @ V @ to_regressors.T
    S_yy = to_target @ V @ to_target.T
    K0 = np.diag(ridge.strength)
    B = transpose(np.linalg.solve(S_pp + K0, transpose(S_yp + layout.steady @ K0)))
    cross = B @ transpose(S_yp)
    E = S_yy - cross - transpose(cross) + B @ S_pp @ transpose(B)
    apart = B - layout.steady
    scatter = E + apart @ K0 @ transpose(apart) + np.diag(ridge.noise)
    noise = symmetric(scatter) / (n + ridge.count + np.count_nonzero(ridge.strength))[:, None, None]
    return companion(layout, B, noise)


def companion(layout: Layout, B: Array, noise: Array) -> tuple[Array, Array, Array]:
    """A (K, N, N), b (K, N), Q (K, N, N) of coefficients and offsets B (K, d, N' + 1), noise (K, d, d)."""
    K = len(B)
    d, N = layout.d, layout.N
    A, b, Q = np.zeros((K, N, N)), np.zeros((K, N)), np.zeros((K, N, N))
    A[:, :d] = layout.carry + B[:, :, :-1] @ layout.regard
    b[:, :d] = B[:, :, -1]
    Q[:, :d, :d] = noise
    if layout.order == 2:
        A[:, d:, :d] = np.eye(d)
    return A, b, Q
