"""How to learn: the settings of EM and of its start."""

from dataclasses import dataclass

RIDGE = 1e-2  # on subjects held out, 1e-3 overfits runs


@dataclass(frozen=True)
class Options:
    """How to learn.

    states     : switching states
    order      : 1 or 2
    rounds     : EM rounds at most
    tolerance  : stop when the penalised value rises by less than this share
    prior      : strength of all priors; 0 is maximum likelihood
    ridge      : four times the share of a state's regressors that its prior, constant velocity, stands for
    stickiness : Dirichlet counts added to every state's staying
    restarts   : how many starts to learn from; the best is kept
    seed       : of the starts
    """

    states: int = 4
    order: int = 2
    rounds: int = 10
    tolerance: float = 1e-5
    prior: float = 1.0
    ridge: float = RIDGE
    stickiness: float = 2.0
    restarts: int = 1
    seed: int = 0


DEFAULTS = Options()
