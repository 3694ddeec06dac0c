"""An SLDS to and from one file.

The file is a numpy .npz archive without pickled objects: `header`, a JSON text with `format`
("figtrack-slds"), `version` (1), names, travelling, labels, fps and `origin` (what it was learned from, in
words); and the float64 arrays pi0, Pi, A, b, Q, C, R, mean0, cov0 with the shapes that `slds.SLDS` documents.
"""

import json
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from dynamics.slds import SLDS

FORMAT = "figtrack-slds"
VERSION = 1
ARRAYS = ("pi0", "Pi", "A", "b", "Q", "C", "R", "mean0", "cov0")


class ModelError(Exception):
    """A model file that cannot be used."""


def save(slds: SLDS, path: str | Path, origin: str) -> None:
    """Write the model; an older file of that name is replaced only when the new one is complete."""
    target = Path(path)
    aside = target.with_name(f".{target.name}.part")
    header = {
        "format": FORMAT,
        "version": VERSION,
        "names": slds.names,
        "travelling": slds.travelling,
        "labels": slds.labels,
        "fps": slds.fps,
        "origin": origin,
    }
    try:
        with aside.open("wb") as file:
            np.savez_compressed(
                file, header=np.array(json.dumps(header)), **{name: getattr(slds, name) for name in ARRAYS}
            )
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def load(path: str | Path) -> SLDS:
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


def load_shipped(name: str, fps: float) -> SLDS:
    """The shipped model of this name learned nearest to a frame rate; ModelError if there is none."""
    rates = shipped()
    if name not in rates:
        known = ", ".join(rates)
        raise ModelError(f"no model {name!r} ships; there are {known}, or give a file that ends in .npz")
    nearest = min(rates[name], key=lambda rate: abs(np.log(rate / fps)))
    return _read(resources.files("dynamics") / "models" / f"{name}@{nearest:g}.npz", name)


def _read(source: Path | Traversable, name: str) -> SLDS:
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            header = json.loads(str(archive["header"]))
            arrays = {key: archive[key] for key in ARRAYS if key in archive}
    except Exception as error:  # damaged bytes fail in zipfile, zlib, numpy or json, each in its own ways
        raise ModelError(f"{name} is no model file or is damaged; copy or learn it again") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ModelError(f"{name} is no model file; learn one with 'figtrack learn'")
    if header.get("version") != VERSION:
        raise ModelError(
            f"{name} has format version {header.get('version')}, this program reads {VERSION}; "
            "update figtrack or learn the model again"
        )
    try:
        return SLDS(
            **arrays,
            names=tuple(header["names"]),
            travelling=tuple(header["travelling"]),
            labels=tuple(header["labels"]),
            fps=float(header["fps"]),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise ModelError(f"{name} is damaged: {error}") from error
