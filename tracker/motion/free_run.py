"""Synthesis: a motion sampled from a model."""

from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Ints
from dynamics.motion.tasks import synthesise
from dynamics.periodic.synthesis import synthesise_stride
from dynamics.slds import SLDS
from dynamics.store import Model
from dynamics.stride import Stride
from tracker.models.centred import ANGLES
from tracker.motion.tasks import check_names, whole_pose

TURNED = float(np.radians(360.0))  # larger angles mean that the sample diverged
WILD = (
    "the model's motion leaves all that a figure can do{}; "
    "try another --seed, fewer --frames, less --noise, or a model of fewer states"
)


def free_run(
    model: Model,
    frames: int,
    fps: float,
    rng: np.random.Generator,
    label: str | None = None,
    noise: float = 1.0,
) -> tuple[Ints, list[str], Array]:
    """States (T,), labels (T) and poses (T, 8) of a sampled motion.

    A harmonic stride gives the gait of one person drawn from its population.

    Args:
        label: the motion, None to sample that too.
        noise: factor on the standard deviation of the driving noise (1999, figure 5).

    Raises:
        ValueError: a model of other freedoms, without dynamics or without this motion, or one that diverges.
    """
    if isinstance(model, Stride):
        check_names(model.names)
        k = int(rng.choice(_motions(model.labels, label)))
        y = synthesise_stride(model, k, frames, fps, rng, noise)
        return np.full(frames, k), [model.labels[k]] * frames, y
    whole = whole_pose(model, "synthesise")
    slds, own = of_motion(whole, label), _motions(whole.labels, label)
    driven = replace(slds, Q=noise**2 * slds.Q)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            states, y = synthesise(driven, frames, rng)
    except np.linalg.LinAlgError as error:
        raise ValueError(WILD.format("")) from error
    wild = np.flatnonzero(~(np.abs(y[:, ANGLES]) < TURNED).all(1))
    if len(wild):
        raise ValueError(WILD.format(f" at frame {wild[0]}"))
    return own[states], [slds.labels[s] for s in states], y


def of_motion(slds: SLDS, label: str | None) -> SLDS:
    """The model reduced to the states of one motion, None for all; ValueError if it has no such motion."""
    if label is None:
        return slds
    states = _motions(slds.labels, label)
    Pi, pi0 = slds.Pi[np.ix_(states, states)], slds.pi0[states]
    return replace(
        slds,
        pi0=pi0 / pi0.sum(),
        Pi=Pi / Pi.sum(1, keepdims=True),
        labels=(label,) * len(states),
        **{name: getattr(slds, name)[states] for name in ("A", "b", "Q", "mean0", "cov0")},
    )


def _motions(labels: tuple[str, ...], label: str | None) -> Ints:
    """Positions of the states of a motion, None for all."""
    states = np.flatnonzero([label in (own, None) for own in labels])
    if not len(states):
        known = ", ".join(dict.fromkeys(labels))
        raise ValueError(f"the model has no motion {label!r}; it has {known}")
    return states
