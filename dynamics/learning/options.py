"""How to learn: the settings of EM and of its start."""

from dataclasses import dataclass

RIDGE = 1e-2  # the prior's share of a state's regressors; measured on subjects held out, 1e-3 overfits runs
STARTS = ("kmeans", "hmm", "segments")


@dataclass(frozen=True)
class Options:
    """How to learn.

    states     : switching states
    order      : 1 or 2
    rounds     : EM rounds at most
    tolerance  : stop when the penalised value rises by less than this share
    prior      : strength of all priors; 0 is maximum likelihood
    ridge      : the share of a state's regressors that its prior, constant velocity, stands for
    stickiness : Dirichlet counts added to every state's staying
    start      : first guess of the switching states, one of STARTS; see `dynamics.learning.initialise`
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
    start: str = "segments"
    restarts: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("states", "rounds", "restarts"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1; got {getattr(self, name)}")
        for name in ("prior", "stickiness"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} must be finite and not negative; got {getattr(self, name)}")
        if not 0.0 < self.ridge < float("inf"):
            raise ValueError(f"ridge must be finite and positive; got {self.ridge}; prior=0 drops all priors")
        if self.order not in (1, 2):
            raise ValueError(f"order must be 1 or 2; got {self.order}")
        if self.start not in STARTS:
            raise ValueError(f"start must be one of {', '.join(STARTS)}; got {self.start!r}")


DEFAULTS = Options()
