"""How to learn: the settings of EM and of its start."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """How to learn.

    states     : switching states
    order      : 1 or 2
    rounds     : largest number of EM rounds
    tolerance  : stop when the penalised value rises by less than this share
    prior      : strength of all priors; 0 is maximum likelihood
    ridge      : weight of the prior towards constant velocity; 4: as much as the data of a mean state
                 if sequences weigh alike
    stickiness : Dirichlet counts added to each state's transition to itself
    seed       : random seed of the start
    """

    states: int = 4
    order: int = 2
    rounds: int = 10
    tolerance: float = 1e-5
    prior: float = 1.0
    ridge: float = 1e-2  # 1e-3 overfits runs, tested on subjects held out
    stickiness: float = 2.0
    seed: int = 0


DEFAULTS = Options()
