"""A model, switching linear, hidden Markov or harmonic stride, to and from one file.

The file is a numpy .npz archive without pickled objects: `header`, a JSON text with `format`
("figtrack-slds", "figtrack-hmm" or "figtrack-stride"), `version` (1), names, travelling (not of an HMM),
labels, fps and `origin` (what it was learned from, in words); and the float64 arrays that `slds.SLDS`,
`hmm.HMM` or `stride.Stride` documents, under their names.
"""

import dataclasses
import json
import math
from collections.abc import Mapping
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from dynamics.hmm import HMM
from dynamics.slds import SLDS
from dynamics.stride import Stride

VERSION = 1
Model = SLDS | HMM | Stride
KINDS: dict[str, type[Model]] = {"figtrack-slds": SLDS, "figtrack-hmm": HMM, "figtrack-stride": Stride}
MOST_BYTES = 2**26  # largest unpacked size; 64 states of 24 entries take a megabyte
LEADING = {"b": 2, "mean": 2}  # dimensions of the arrays that determine the sizes of all others
TEXTS = ("names", "travelling", "labels")  # fields kept in the header, besides fps


class ModelError(Exception):
    """A model file that cannot be used."""


def kind_of(model: Model) -> str:
    """The kind of a model, in words."""
    if isinstance(model, SLDS):
        return "a switching linear dynamic system"
    return "a hidden Markov model" if isinstance(model, HMM) else "a harmonic stride"


def save(model: Model, path: str | Path, origin: str) -> None:
    """Write the model; an older file of that name is replaced only when the new one is complete.

    ValueError: freedoms that drift, which a file does not hold; a name or label that `load` would refuse.
    """
    if isinstance(model, SLDS) and model.drifts:
        raise ValueError(f"a model file holds no freedoms that drift; got {', '.join(model.drifts)}")
    target = Path(path)
    aside = target.with_name(f".{target.name}.part")
    fields = {name: getattr(model, name) for name in _kept(type(model))}
    try:
        for name in [name for name in TEXTS if name in fields]:
            _texts(name, list(fields[name]))
    except ValueError as error:
        raise ValueError(f"the model cannot be saved: {error}; rename them") from error
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
    """Read a model. ModelError: no such file, not a model, of a newer format version, or damaged."""
    source = Path(path)
    if not source.is_file():
        raise ModelError(f"no model file {path}; learn one with 'figtrack learn' or name one that ships")
    return _read(source, str(path))


@cache
def shipped() -> Mapping[str, tuple[float, ...]]:
    """The shipped models and the frame rates at which each was learned; the files are named NAME@FPS.npz."""
    rates: dict[str, list[float]] = {}
    for entry in (resources.files("dynamics") / "models").iterdir():
        if entry.name.endswith(".npz"):
            name, _, fps = entry.name.removesuffix(".npz").rpartition("@")
            rates.setdefault(name, []).append(float(fps))
    return MappingProxyType({name: tuple(sorted(found)) for name, found in sorted(rates.items())})


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
    return _of_package(name, nearest)


@cache  # measuring a clip's playback speed loads models for a dozen rates, few of them different
def _of_package(name: str, fps: float) -> Model:
    return _read(resources.files("dynamics") / "models" / f"{name}@{fps:g}.npz", name)


def _kept(kind: type[Model]) -> list[str]:
    """Names of the fields that a model file holds: those without a default."""
    return [field.name for field in dataclasses.fields(kind) if field.default is dataclasses.MISSING]


def _read(source: Path | Traversable, name: str) -> Model:
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            if sum(entry.file_size for entry in archive.zip.infolist()) > MOST_BYTES:
                raise ModelError(f"{name} unpacks to more than any model holds; learn it again")
            header = json.loads(str(archive["header"]))
            arrays = {key: archive[key] for key in archive if key != "header"}
    except ModelError:
        raise
    except Exception as error:  # zipfile, zlib, numpy and json raise many kinds for damaged bytes
        raise ModelError(f"{name} is no model file or is damaged; copy or learn it again") from error
    if not isinstance(header, dict) or str(header.get("format")) not in KINDS:
        raise ModelError(f"{name} is no model file; learn one with 'figtrack learn'")
    if header.get("version") != VERSION:
        raise ModelError(
            f"{name} has format version {header.get('version')}, this program reads {VERSION}; "
            "update figtrack or learn the model again"
        )
    kind = KINDS[header["format"]]
    fields = _kept(kind)
    try:
        values: dict[str, Any] = {key: _texts(key, header[key]) for key in TEXTS if key in fields}
        values |= {key: _reals(key, arrays[key]) for key in fields if key not in (*TEXTS, "fps")}
        model = kind(**values, fps=_rate(header["fps"]))
        for key, covs in _covariances(model).items():
            _check_positive(key, covs)
    except (ValueError, KeyError, OverflowError) as error:
        raise ModelError(f"{name} is damaged: {error}; copy or learn it again") from error
    return model


def _texts(key: str, stored: Any) -> tuple[str, ...]:
    good = isinstance(stored, list) and all(isinstance(text, str) and text.isprintable() for text in stored)
    if not good or "" in stored:
        raise ValueError(f"{key} must be a list of printable texts")
    if key != "labels" and len(set(stored)) < len(stored):
        raise ValueError(f"{key} must differ from one another")
    if key == "names" and not stored:
        raise ValueError("names must name a freedom at least")
    return tuple(stored)


def _reals(key: str, stored: NDArray[Any]) -> Array:
    if stored.dtype.kind not in "fiu":  # a complex number would lose its imaginary part silently
        raise ValueError(f"{key} must hold real numbers, not {stored.dtype}")
    if stored.ndim != LEADING.get(key, stored.ndim):
        raise ValueError(f"{key} must have {LEADING[key]} dimensions, not {stored.ndim}")
    return stored.astype(np.float64)


def _rate(stored: Any) -> float:
    if isinstance(stored, bool) or not isinstance(stored, int | float) or not math.isfinite(stored):
        raise ValueError(f"fps must be a number of frames a second; got {stored!r}")
    return float(stored)


def _covariances(model: Model) -> dict[str, Array]:
    """The matrices that must be positive definite; of Q the pose's block, as nothing else is noisy."""
    if isinstance(model, Stride):
        return {"quick": model.quick, "slow": model.slow, "R": model.R}
    if isinstance(model, HMM):
        return {"cov": model.cov}
    d, N = model.layout.d, model.layout.N
    if model.Q[:, d:].any() or model.Q[:, :, d:].any():
        raise ValueError("Q must be zero but for the pose")
    if (model.A[:, d:] != np.eye(N)[: N - d]).any() or model.b[:, d:].any():
        raise ValueError("A and b must carry the last pose over as it is")
    if (model.layout.pose != model.C).any():
        raise ValueError("C must measure the pose")
    return {"Q": model.Q[:, :d, :d], "R": model.R[None], "cov0": model.cov0}


def _check_positive(key: str, covs: Array) -> None:
    for k, cov in enumerate(covs):
        # Sums in another order differ in the last bits, which never makes a variance negative.
        if not np.allclose(cov, cov.T, rtol=1e-9, atol=1e-9 * np.abs(cov).max()):
            raise ValueError(f"{key} must be symmetric; of state {k} it is not")
        if not np.linalg.eigvalsh(cov)[0] > 0.0:
            raise ValueError(f"{key} must be positive definite; of state {k} it is not")
