"""The M-step's regression: A, b and Q of every switching state from expected second moments.

With v = [x_t's pose; x_{t-1}; 1] and V_k = sum_t E[v v' s_t(k)], everything the regression needs is linear in
v: the target Y = pose_t - E x_{t-1} and the regressors phi = [F x_{t-1}; 1]. E carries a travelling freedom's
old place over and F shows the dynamics its change only (second order) or nothing of it (first), so where the
figure stands cannot matter. The prior on B = [coefficients, offset] is centred on constant velocity.
"""

from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, symmetric, transpose


@dataclass(frozen=True)
class Form:
    """How the free coefficients enter the dynamics.

    carry   : (d, N) E, what is carried over as it is
    regard  : (N', N) F, what the dynamics regard
    steady  : (d, N' + 1) coefficients and offset of constant velocity
    order   : 1 or 2
    """

    carry: Array
    regard: Array
    steady: Array
    order: int


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


def form(names: tuple[str, ...], travelling: tuple[str, ...], order: int) -> Form:
    """The form of the dynamics of poses with these freedoms."""
    d = len(names)
    N = order * d
    moves = np.array([name in travelling for name in names])
    carry = np.zeros((d, N))
    carry[moves, np.flatnonzero(moves)] = 1.0
    now = np.eye(d, N)
    if order == 1:
        regard = now[~moves]
        steady = np.zeros((d, len(regard) + 1))
        steady[~moves, : len(regard)] = np.eye(len(regard))
        return Form(carry, regard, steady, order)
    before = np.eye(d, N, k=d)
    regard = np.vstack([now[~moves], before[~moves], (now - before)[moves]])
    rest, gone = int((~moves).sum()), int(moves.sum())
    steady = np.zeros((d, len(regard) + 1))
    steady[~moves, :rest] = 2.0 * np.eye(rest)
    steady[~moves, rest : 2 * rest] = -np.eye(rest)
    steady[moves, 2 * rest : 2 * rest + gone] = np.eye(gone)
    return Form(carry, regard, steady, order)


def maximum_likelihood(shape: Form) -> Ridge:
    """A prior that says nothing."""
    return Ridge(np.zeros(shape.steady.shape[1]), np.zeros(len(shape.steady)), 0.0)


def solve(V: Array, n: Array, shape: Form, ridge: Ridge) -> tuple[Array, Array, Array]:
    """The dynamics that maximise the expected log joint plus the log prior.

    Args:
        V: (K, d + N + 1, d + N + 1) expected second moments of v.
        n: (K,) expected number of steps into each state.

    Returns:
        A (K, N, N), b (K, N), Q (K, N, N). Q is the joint mode over coefficients and noise:
        [E + (B - M0) K0 (B - M0)' + Psi] / (n + count + number of regressors with a prior).
    """
    d, N = shape.carry.shape
    to_target = np.hstack([np.eye(d), -shape.carry, np.zeros((d, 1))])
    to_regressors = np.zeros((len(shape.regard) + 1, d + N + 1))
    to_regressors[:-1, d : d + N] = shape.regard
    to_regressors[-1, -1] = 1.0
    S_yp = to_target @ V @ to_regressors.T
    S_pp = to_regressors @ V @ to_regressors.T
    S_yy = to_target @ V @ to_target.T
    K0 = np.diag(ridge.strength)
    B = transpose(np.linalg.solve(S_pp + K0, transpose(S_yp + shape.steady @ K0)))
    cross = B @ transpose(S_yp)
    E = S_yy - cross - transpose(cross) + B @ S_pp @ transpose(B)
    apart = B - shape.steady
    scatter = E + apart @ K0 @ transpose(apart) + np.diag(ridge.noise)
    noise = symmetric(scatter) / (n + ridge.count + np.count_nonzero(ridge.strength))[:, None, None]
    return companion(shape, B, noise)


def companion(shape: Form, B: Array, noise: Array) -> tuple[Array, Array, Array]:
    """A (K, N, N), b (K, N), Q (K, N, N) of coefficients and offsets B (K, d, N' + 1), noise (K, d, d)."""
    K = len(B)
    d, N = shape.carry.shape
    A, b, Q = np.zeros((K, N, N)), np.zeros((K, N)), np.zeros((K, N, N))
    A[:, :d] = shape.carry + B[:, :, :-1] @ shape.regard
    b[:, :d] = B[:, :, -1]
    Q[:, :d, :d] = noise
    if shape.order == 2:
        A[:, d:, :d] = np.eye(d)
    return A, b, Q
