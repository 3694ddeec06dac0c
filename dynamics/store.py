"""A model, switching linear, hidden Markov or harmonic stride, to and from one file.

The file is a numpy .npz archive without pickled objects: `header`, a JSON text with `format`
("figtrack-slds", "figtrack-hmm" or "figtrack-stride"), `version` (1), names, travelling (not of an HMM),
labels, fps and `origin` (what it was learned from, in words); and the float64 arrays that `slds.SLDS`,
`hmm.HMM` or `stride.Stride` documents, under their names.
"""

import dataclasses
import json
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from dynamics.hmm import HMM
from dynamics.slds import SLDS
from dynamics.stride import Stride

VERSION = 1
Model = SLDS | HMM | Stride
KINDS: dict[str, type[Model]] = {"figtrack-slds": SLDS, "figtrack-hmm": HMM, "figtrack-stride": Stride}
TEXTS = ("names", "travelling", "labels")  # what is kept in the header, besides fps


class ModelError(Exception):
    """A model file that cannot be used."""


def save(model: Model, path: str | Path, origin: str) -> None:
    """Write the model; an older file of that name is replaced only when the new one is complete."""
    target = Path(path)
    aside = target.with_name(f".{target.name}.part")
    fields = {name: getattr(model, name) for name in _kept(type(model))}
    arrays: dict[str, Any] = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    kind = next(name for name, kind in KINDS.items() if isinstance(model, kind))
    header = {"format": kind, "version": VERSION, "origin": origin}
    header |= {name: value for name, value in fields.items() if name not in arrays}
    try:
        with aside.open("wb") as file:
            np.savez_compressed(file, header=np.array(json.dumps(header)), **arrays)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def load(path: str | Path) -> Model:
    """Read a model.

    Raises:
        ModelError: no such file, not a model, of a newer format version, or damaged.
    """
    source = Path(path)
    if not source.is_file():
        raise ModelError(f"no model file {path}; learn one with 'figtrack learn' or name one that ships")
    return _read(source, str(path))


def shipped() -> dict[str, tuple[float, ...]]:
    """The models that ship and the frame rates each was learned at; their files are named NAME@FPS.npz."""
    rates: dict[str, list[float]] = {}
    for entry in (resources.files("dynamics") / "models").iterdir():
        if entry.name.endswith(".npz"):
            name, _, fps = entry.name.removesuffix(".npz").rpartition("@")
            rates.setdefault(name, []).append(float(fps))
    return {name: tuple(sorted(found)) for name, found in sorted(rates.items())}


def load_shipped(name: str, fps: float) -> Model:
    """The shipped model of this name learned nearest to a frame rate; ModelError if there is none."""
    rates = shipped()
    if name not in rates:
        known = ", ".join(rates)
        raise ModelError(
            f"no model {name!r} ships; there are {known}, to follow with also cv, "
            "or give a file that ends in .npz"
        )
    nearest = min(rates[name], key=lambda rate: abs(np.log(rate / fps)))
    return _read(resources.files("dynamics") / "models" / f"{name}@{nearest:g}.npz", name)


def _kept(kind: type[Model]) -> list[str]:
    """The fields that a file holds: those without a default."""
    return [field.name for field in dataclasses.fields(kind) if field.default is dataclasses.MISSING]


def _read(source: Path | Traversable, name: str) -> Model:
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            header = json.loads(str(archive["header"]))
            arrays = {key: archive[key] for key in archive if key != "header"}
    except Exception as error:  # damaged bytes fail in zipfile, zlib, numpy or json, each in its own ways
        raise ModelError(f"{name} is no model file or is damaged; copy or learn it again") from error
    if not isinstance(header, dict) or header.get("format") not in KINDS:
        raise ModelError(f"{name} is no model file; learn one with 'figtrack learn'")
    if header.get("version") != VERSION:
        raise ModelError(
            f"{name} has format version {header.get('version')}, this program reads {VERSION}; "
            "update figtrack or learn the model again"
        )
    kind = KINDS[header["format"]]
    fields = _kept(kind)
    try:
        values: dict[str, Any] = {key: tuple(header[key]) for key in TEXTS if key in fields}
        values |= {key: arrays[key] for key in fields if key not in (*TEXTS, "fps")}
        return kind(**values, fps=float(header["fps"]))
    except (ValueError, KeyError, TypeError) as error:
        raise ModelError(f"{name} is damaged: {error}") from error
