"""Motion models by name."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dynamics.gaussian import Array, collapse
from dynamics.layout import among
from dynamics.motion.rate import at_rate, backwards
from dynamics.slds import SLDS, combine, constant_velocity
from dynamics.store import Model, ModelError, kind_of, load, load_shipped, shipped
from kinematics.figure import ROOT, Figure
from kinematics.figure_file import WALKER, load_figure
from tracker.often import USUAL, crowded, often
from tracker.run.track import FREE
from tracker.settings import Settings

CONSTANT_VELOCITY = "cv"
COMPARED = ("walk-run", "walk-run-1", CONSTANT_VELOCITY)
FIRST_ROOT_SPEED = (0.06, 0.02)  # prior speed along and up, a runner's, leg lengths a frame at 30 fps
FIRST_ANGLE_SPEED = float(np.radians(4.0))  # prior speed of angles, radians a frame at 30 fps
# With an outline: factor on the noise, and share of it that is independent between freedoms.
SEEN_WIDER, SEEN_OWN = 1.2, 0.4
# Noise of the free state: changes of speed a frame at 30 fps, in radians, and in leg lengths for the root.
FREE_ANGLE, FREE_PLACE = float(np.radians(3.0)), 0.02


def find_model(name: str, fps: float, settings: Settings, figure: Figure = WALKER) -> SLDS:
    """The model of a name or file, at this frame rate, as the tracker uses it.

    The noise of a learned model is inflated for people it was not learned from. At second order a free state
    of constant velocity is added for motion that the model does not predict.

    Args:
        name: "cv" for constant velocity, a shipped model's name, or a file that ends in .npz.
        fps: frames in a second of what was filmed.
        figure: whose freedoms the model must have; a shipped model for this figure has precedence.

    Raises:
        ModelError: no such model, or a file that cannot be used.
        ValueError: a frame rate that the model cannot be converted to.
    """
    if name == CONSTANT_VELOCITY:
        return _constant_velocity(figure.learned_freedoms, fps, settings)
    try:
        learned = switching_model(name, fps, figure)
    except ValueError as error:
        raise ValueError(
            f"{name} cannot be had at {fps:g} frames a second of what was filmed; give --model cv, or --rate "
            "where the clip is played faster or slower"
        ) from error
    found = replace(learned, Q=learned.Q * settings.inflation)
    if (surprise := settings.surprise) > 0.0 and learned.order > 1:
        crossing = 1.0 - (1.0 - surprise) ** (1.0 / often(found.fps))
        found = combine([found, _free(found)], crossing, [1.0 - surprise, surprise])
    return found


def for_seen(learned: SLDS) -> SLDS:
    """A model from `find_model` for a figure whose outline is measured in most frames.

    The model need not hold the pose alone, so its noise can be that of people it was not learned from:
    larger, and less correlated between freedoms, as one joint's deviation tells less about another's.
    """
    shared = np.where(np.eye(learned.Q.shape[-1], dtype=np.bool_), 1.0, 1.0 - SEEN_OWN)
    return replace(learned, Q=SEEN_WIDER * shared * learned.Q)


def seen_backwards(found: SLDS) -> SLDS:
    """A model from `find_model` with time running the other way; the free state knows no direction."""
    turned, free = backwards(found), np.array([label == FREE for label in found.labels])
    A, Q = (
        np.where(free[:, None, None], old, new) for old, new in ((found.A, turned.A), (found.Q, turned.Q))
    )
    return replace(turned, A=A, b=np.where(free[:, None], found.b, turned.b), Q=Q)


def switching_model(name: str, fps: float, figure: Figure = WALKER) -> SLDS:
    """The learned model with this name at this frame rate; raises as `find_model`."""
    model = motion_model(own_model(name, figure), fps)
    if not isinstance(model, SLDS):
        raise ModelError(
            f"{name} is {kind_of(model)}, which has no dynamics from frame to frame; learn one without it"
        )
    return at_rate(model, fps)


def own_model(name: str, figure: Figure) -> str:
    """The name of the figure's own shipped variant of a model, if there is one, else the given name."""
    own = f"{figure.name}-{name}"
    return own if own in shipped() else name


def compared(name: str) -> list[str]:
    """The models that are compared if none is named, of those that follow the figure of a name or file."""
    figure = load_figure(name)
    peoples = figure.learned_freedoms == WALKER.learned_freedoms
    return [n for n in COMPARED if peoples or n == CONSTANT_VELOCITY or own_model(n, figure) != n]


def from_a_stand(name: str) -> str:
    """The name of a model's shipped variant with starts from a stand, if there is one, else the given
    name."""
    started = f"{name}-started"
    return started if started in shipped() and not Path(name).is_file() else name


def motion_model(name: str, fps: float = USUAL) -> Model:
    """A model unchanged: from a file, or the shipped one of this name with the rate nearest to `fps`."""
    is_file = name.endswith(".npz") or Path(name).is_file()
    return load(name) if is_file else load_shipped(name, fps)


def known_models() -> tuple[str, ...]:
    """The names of all models that need no file."""
    return *shipped(), CONSTANT_VELOCITY


def _constant_velocity(names: Sequence[str], fps: float, settings: Settings) -> SLDS:
    step = USUAL / fps
    noise = by_freedom(names, settings.cv_place, np.radians(settings.cv_angle))
    speed = by_freedom(names, 0.0, FIRST_ANGLE_SPEED)
    speed[: len(ROOT)] = FIRST_ROOT_SPEED
    return constant_velocity(names, noise * _by_rate(fps), speed * step, fps)


def _by_rate(fps: float) -> float:
    """Factor on the change of speed in a frame at 30 a second: the square of a frame's duration, at higher
    rates its power 1.5, so that independent changes add up to the same in a second."""
    return (USUAL / fps) ** 2 * crowded(fps)


def _free(learned: SLDS) -> SLDS:
    """The free state of constant velocity; its prior covers the starts of all states of the learned model."""
    noise = by_freedom(learned.names, FREE_PLACE, FREE_ANGLE)
    none = np.zeros(len(noise))
    free = constant_velocity(learned.names, noise * _by_rate(learned.fps), none, learned.fps)
    start = collapse(np.full(learned.K, 1.0 / learned.K), learned.start)
    return replace(
        free,
        R=learned.R,
        mean0=start.mean[None],
        cov0=start.cov[None],
        travelling=learned.travelling,
        labels=(FREE,),
    )


def by_freedom(names: Sequence[str], place: float, angle: float) -> Array:
    """(M,) vector with one value for the freedoms of the root and another for the angles."""
    return np.where(among(names, ROOT), place, angle)
