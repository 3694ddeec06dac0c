"""What speed is measured against: other packages' filters, and the one-state smoother anyone would write."""

import numpy as np

from dynamics.gaussian import LOG_2PI


def one_state_loop(slds, y):
    """The Kalman filter and RTS smoother of a one-state system, as a plain loop over the frames of y (T, M).

    Returns:
        Means (T, N), covariances (T, N, N), Cov(x_{t+1}, x_t) (T-1, N, N) and log p(y): what EM needs.
    """
    A, b, Q, C, R = slds.A[0], slds.b[0], slds.Q[0], slds.C, slds.R
    (M, N), T = C.shape, len(y)
    eye = np.eye(N)
    mean, cov = np.empty((T, N)), np.empty((T, N, N))
    ahead, ahead_cov = np.empty((T, N)), np.empty((T, N, N))
    lag = np.empty((T - 1, N, N))
    x, P = slds.mean0[0], slds.cov0[0]
    log_p = -0.5 * T * M * LOG_2PI
    for t in range(T):
        if t > 0:
            x, P = A @ x + b, A @ P @ A.T + Q
        ahead[t], ahead_cov[t] = x, P
        S = C @ P @ C.T + R
        S_inv = np.linalg.inv(S)
        e = y[t] - C @ x
        gain = P @ C.T @ S_inv
        x, P = x + gain @ e, (eye - gain @ C) @ P
        mean[t], cov[t] = x, P
        log_p -= 0.5 * (e @ S_inv @ e + np.linalg.slogdet(S)[1])
    for t in range(T - 2, -1, -1):
        J = np.linalg.solve(ahead_cov[t + 1], A @ cov[t]).T
        mean[t] += J @ (mean[t + 1] - ahead[t + 1])
        cov[t] += J @ (cov[t + 1] - ahead_cov[t + 1]) @ J.T
        lag[t] = cov[t + 1] @ J.T
    return mean, cov, lag, float(log_p)


def filterpy_imm(slds, y):
    """filterpy's IMM: K Kalman filters that mix, predict and update at every frame."""
    from filterpy.kalman import IMMEstimator

    imm = IMMEstimator([_filterpy_filter(slds, k) for k in range(slds.K)], slds.pi0, slds.Pi)
    imm.update(y[0])
    for now in y[1:]:
        imm.predict(u=np.ones(1))
        imm.update(now)
    return imm


def _filterpy_filter(slds, k):
    from filterpy.kalman import KalmanFilter

    M, N = slds.C.shape
    kalman = KalmanFilter(dim_x=N, dim_z=M, dim_u=1)
    kalman.x, kalman.P = slds.mean0[k].copy(), slds.cov0[k].copy()
    kalman.F, kalman.Q, kalman.B = slds.A[k].copy(), slds.Q[k].copy(), slds.b[k][:, None].copy()
    kalman.H, kalman.R = slds.C.copy(), slds.R.copy()
    return kalman
