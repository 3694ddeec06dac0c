"""All settings of the tracker, with unit, range and default."""

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from kinematics.text_file import read_text, why

# Wording of the bounds of a JSON schema.
BOUNDS = {
    "minimum": "at least",
    "exclusiveMinimum": "above",
    "maximum": "at most",
    "exclusiveMaximum": "below",
}

Model = TypeVar("Model", bound=BaseModel)
Share = Annotated[float, Field(ge=0, le=1)]
Part = Annotated[float, Field(gt=0, le=1)]  # not 0
Chance = Annotated[float, Field(ge=0, lt=1)]  # not 1
Minority = Annotated[float, Field(gt=0, lt=0.5)]


class SettingsError(ValueError):
    """A settings file that cannot be used."""


class Settings(BaseModel):
    """How the tracker registers, filters and weighs; the same for every clip."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    mode: Literal["full", "classic"] = Field("full", description="registration; classic is the papers'")
    templates: bool = Field(True, description="whether templates are used; if not, --measure is required")
    contrast: Share = Field(
        0.3, description="how far grey levels around the figure are spread, 0 for as filmed"
    )
    spacing: float = Field(
        0.022, ge=0.005, le=0.2, description="distance between template points, leg lengths"
    )
    rim: float = Field(
        0.05, ge=0, le=0.5, description="width of the template beyond a link's outline, leg lengths"
    )
    cover: float = Field(
        1.0, ge=0, le=10, description="how far beyond its outline a link hides others, blurs"
    )
    blurs: tuple[Part, ...] = Field(
        (0.05, 0.025, 0.015), min_length=1, description="blurs of the picture, coarse to fine, leg lengths"
    )
    iterations: int = Field(4, ge=1, le=100, description="largest number of steps at each blur")
    noise: float = Field(6.0, ge=0.1, le=255, description="noise of a pixel's match, grey levels")
    light: float = Field(
        20.0, gt=0, le=255, description="largest brightness offset of a link from the common one, grey levels"
    )
    robust: float = Field(2.5, gt=0, le=1000, description="Cauchy scale, multiples of the noise")
    backdrop: bool = Field(True, description="whether the background behind the figure counts in hypotheses")
    covered: Chance = Field(
        0.05, description="prior odds that something that looks like the background covers the figure"
    )
    outline: bool = Field(
        True, description="whether the outline, fitted to the whole film first, is measured in every frame"
    )
    tempering: Part = Field(
        0.035, description="independent share of the template points of a frame, at 30 a second"
    )
    image_weight: float = Field(
        1.0, ge=0, le=100, description="weight of the image in the costs of hypotheses"
    )
    blend: Share = Field(0.12, description="share of a frame, at 30 a second, in the templates")
    camera: bool = Field(True, description="whether the camera may move: the root is then that of the scene")
    hypotheses: int = Field(
        8, ge=1, le=1000, description="largest number of priors that are tried in a frame"
    )
    margin: float = Field(
        0.3, ge=0, le=10, description="margin of the picture around the predicted joints, leg lengths"
    )
    inflation: float = Field(
        3.0, gt=0, le=1000, description="factor on the learned Q, for people not learned from"
    )
    surprise: Chance = Field(
        0.01,
        description="probability of motion no state predicts, a frame at 30 a second and in the marked one",
    )
    constant: float = Field(
        10.0, gt=0, le=90, description="spread of an angle's constant difference from learned motion, degrees"
    )
    scale_drift: Share = Field(0.002, description="change of the common log scale a frame at 30 a second")
    breathing: Part = Field(0.06, description="spread of a link's log length")
    ankle: float = Field(
        25.0, gt=0, le=360, description="spread of an ankle's angle, which no model includes, degrees"
    )
    mark: Share = Field(
        0.03, description="error of a marked joint's place, which persists in tracking, leg lengths"
    )
    point: Part = Field(
        0.03, description="least spread of a point of --measure, leg lengths; more where they jitter"
    )
    point_likelihood: Share = Field(0.3, description="likelihood below which a point of --measure is ignored")
    exchange: Minority = Field(
        0.1, description="probability that --measure names the legs of a frame wrongly"
    )
    one_leg: Minority = Field(0.02, description="probability that --measure puts both legs of a frame on one")
    cv_angle: float = Field(
        6.0, gt=0, le=360, description="constant velocity: change of an angle's speed a frame, degrees"
    )
    cv_place: float = Field(
        0.06, gt=0, le=10, description="constant velocity: change of the root's speed a frame, leg lengths"
    )


def settings_toml() -> str:
    """A TOML file with every setting at its default, and with its meaning and range."""
    defaults = Settings().model_dump(mode="json")
    blocks = ["# Settings of figtrack's tracker, for --settings. What is left out keeps its default."]
    for name, schema in Settings.model_json_schema()["properties"].items():
        notes = [f"{name}: {schema['description']}", _range(schema), f"default {json.dumps(defaults[name])}"]
        # Numbers, texts and lists of numbers are written alike in JSON and TOML.
        blocks.append(f"# {'; '.join(note for note in notes if note)}\n{name} = {json.dumps(defaults[name])}")
    return "\n\n".join(blocks) + "\n"


def read_settings(path: Path) -> Settings:
    """The tracker's settings from a TOML file; raises as `read_toml`."""
    return read_toml(path, Settings, f"'figtrack settings --out {path}' writes one")


def read_toml(path: Path, kind: type[Model], advice: str) -> Model:
    """Settings of a kind from a TOML file; settings that it does not name keep their defaults.

    SettingsError: no such file, no TOML (the message ends with `advice`), or unknown keys and values out of
    range, all named at once.
    """
    try:
        table = json.dumps(tomllib.loads(read_text(path)), default=str)
        return kind.model_validate_json(table, strict=True)  # true is no number
    except FileNotFoundError as error:
        raise SettingsError(f"no settings file {path}; check its name") from error
    except ValidationError as error:
        raise SettingsError(f"{path}: {'; '.join(map(_fault, error.errors()))}") from error
    except (OSError, ValueError, RecursionError) as error:  # the parser has several ways to fail
        raise SettingsError(f"{path} is no TOML file ({why(error)}); {advice}") from error


def _range(schema: Mapping[str, Any]) -> str:
    """The range that the JSON schema of a setting allows, in words."""
    if "enum" in schema:
        return " or ".join(json.dumps(value) for value in schema["enum"])
    if schema["type"] == "boolean":
        return "true or false"
    if schema["type"] == "array":
        return f"a list of {schema['minItems']} or more, each {_range(schema['items'])}"
    bounds = [f"{word} {schema[key]:g}" for key, word in BOUNDS.items() if key in schema]
    whole = "a whole number " if schema["type"] == "integer" else ""
    return whole + " and ".join(bounds)


def _fault(details: ErrorDetails) -> str:
    name = ".".join(map(str, details["loc"]))
    if details["type"] == "extra_forbidden":
        return f"{name}: no such setting; check its spelling"
    return f"{name}: {details['msg'].lower()}, got {details['input']!r}"
