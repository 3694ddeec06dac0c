"""What is compared: models, every setting switched off in turn, grids that settings are tuned on, rivals."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

from tests.benchmarks.evaluation.cases import Boxes, Flow, Ours, Way
from tests.benchmarks.rivals import correlation, lucas_kanade
from tracker.settings import Settings

Values = tuple[object, ...]
Changes = Mapping[str, object]

DEFAULT = "walk-run"
ONE_STATE = "walk-run-1"
ALONE = f"{ONE_STATE} alone"  # one state in all: none free
MANY_STATES = "gait"
CV = "cv"
CV_ALONE = f"{CV}, no outline"
FLOW = "Lucas-Kanade"
BOXES = "correlation"
RIVALS = (FLOW, BOXES)
HARD = (DEFAULT, CV, CV_ALONE)  # rows that are compared on the hard clips too
FILTERED = ", filtered"
CLASSIC: Changes = {"mode": "classic"}

# A name for the row: the model, and what is changed in its settings.
COMPARED: dict[str, tuple[str, Changes]] = {
    DEFAULT: (DEFAULT, {}),
    MANY_STATES: (MANY_STATES, {}),
    ONE_STATE: (ONE_STATE, {}),
    ALONE: (ONE_STATE, {"surprise": 0.0}),
    CV: (CV, {}),
    CV_ALONE: (CV, {"outline": False}),
    f"{DEFAULT}, classic": (DEFAULT, CLASSIC),
    f"{CV}, classic": (CV, CLASSIC),
}

# A name for the row: what is changed in the settings of the default model.
WITHOUT: dict[str, Changes] = {
    "no outline": {"outline": False},
    "no constant differences of angles": {"constant": 0.01},
    "no free state": {"surprise": 0.0},
    "camera assumed still": {"camera": False},
    "no background model": {"backdrop": False},
    "grey levels as filmed": {"contrast": 0.0},
    "no occlusion by the scene": {"covered": 0.0},
    "free brightness of links": {"light": 255.0},
    "learned noise not inflated": {"inflation": 1.0},
    "no image evidence in weights": {"image_weight": 0.0},
    "no soft rim": {"rim": 0.0},
    "no cover beyond outlines": {"cover": 0.0},
    "templates not updated": {"blend": 0.0},
    "finest blur only": {"blurs": (0.015,)},
    "no robust loss": {"robust": 1000.0},
    "no change of length": {"breathing": 1e-6, "scale_drift": 0.0},
}


@dataclass(frozen=True)
class Grid:
    """Settings that are tuned together.

    way   : that has some values of them
    tried : the values of each, the default among them
    """

    way: Callable[..., Way]
    tried: Mapping[str, Values]

    @property
    def ways(self) -> dict[Values, Way]:
        """A way for every combination of values."""
        combinations = product(*self.tried.values())
        return {values: self.way(**dict(zip(self.tried, values, strict=True))) for values in combinations}


GRIDS = {
    CV: Grid(
        lambda **values: Ours(CV, _settings(values)),
        {"cv_angle": (3.0, 4.0, 6.0, 8.0, 12.0), "cv_place": (0.005, 0.01, 0.02, 0.06)},
    ),
    DEFAULT: Grid(
        lambda **values: Ours(DEFAULT, _settings(values)),
        {"inflation": (2.0, 3.0, 5.0), "tempering": (0.02, 0.035, 0.06)},
    ),
    FLOW: Grid(
        lambda **values: Flow(lucas_kanade.Options(**values)),
        {"window": (0.1, 0.15, 0.2, 0.3), "home": (0.005, 0.01, 0.02, 0.04), "fresh": (True, False)},
    ),
    BOXES: Grid(lambda **values: Boxes(correlation.Options(**values)), {"around": (0.1, 0.15, 0.2)}),
}


def rows(cv: Changes) -> dict[str, Way]:
    """Each model smoothed over the clip, the default unsmoothed too; cv with these settings."""
    found: dict[str, Way] = {}
    for name, (model, changes) in COMPARED.items():
        settings = _settings({**cv, **changes})
        found[name] = Ours(model, settings)
        if name == DEFAULT:
            found[name + FILTERED] = Ours(model, settings, smooth=False)
    return found


def switched() -> dict[str, Way]:
    """The default model with one thing switched off."""
    return {name: Ours(DEFAULT, _settings(changes)) for name, changes in WITHOUT.items()}


def _settings(changes: Changes) -> Settings:
    """The defaults with these changes; an unknown name or a value out of range is refused."""
    return Settings.model_validate(dict(changes))
