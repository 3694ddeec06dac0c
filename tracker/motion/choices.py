"""What the user of a motion command chooses from; light, so that the command line can read it."""

from enum import StrEnum


class Inference(StrEnum):
    """How switching states are inferred."""

    VITERBI = "viterbi"
    GPB2 = "gpb2"
    VARIATIONAL = "variational"
    HMM = "hmm"


class Use(StrEnum):
    """Which columns speak for a motion."""

    ANGLES = "angles"
    ALL = "all"
