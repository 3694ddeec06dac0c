"""Figures read from TOML: those that ship, by name, and files of a user's own; docs/figures.md says how.

Angles in a file are degrees.
"""

import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from kinematics.figure import Figure, Link, Panel
from kinematics.sides import other_side, side_of


def load_figure(source: str | Path = "walker") -> Figure:
    """A figure that ships, by name, or one from a TOML file.

    Raises:
        ValueError: no such figure, not TOML, a key that is unknown, missing or of the wrong kind, or a tree
            that does not hang together.
    """
    path, folder = Path(source), resources.files("kinematics") / "figures"
    shipped = folder / f"{source}.toml"
    if path.suffix == ".toml":
        if not path.is_file():
            raise ValueError(f"no figure file {path}; give a TOML file that exists")
        content = path.read_bytes()
    elif shipped.is_file():
        content = shipped.read_bytes()
    else:
        names = sorted(each.name.removesuffix(".toml") for each in folder.iterdir())
        known = f"{', '.join(names[:-1])} and {names[-1]}"
        raise ValueError(f"no figure {str(source)!r} ships, only {known}; give the path of a TOML file")
    try:
        return figure_from(tomllib.loads(content.decode("utf-8")))
    except ValueError as error:
        raise ValueError(f"figure {source}: {error}") from error


def figure_from(table: Mapping[str, Any]) -> Figure:
    """A figure from a parsed TOML table; angles there are degrees.

    Raises:
        ValueError: a key is unknown, missing or of the wrong kind, or the tree does not hang together.
    """
    where = "the figure"
    _check_keys(
        table, where, {"name": str, "base": str, "links": list}, _LISTS | {"outline": str, "hints": dict}
    )
    for key in ("leg", "marks", "optional", "scored"):
        for part in table.get(key, ()):
            _check_kind(f"each of {key}", part, str, where)
    for hint in table.get("hints", {}).values():
        _check_kind("each of hints", hint, str, where)
    for key, kind in (("links", dict), ("panels", dict), ("ahead", list)):
        for entry in table.get(key, ()):
            _check_kind(f"each of {key}", entry, kind, where)
    links = tuple(_link_from(entry) for entry in table["links"])
    marks = tuple(table.get("marks", (table["base"], *(link.joint for link in links))))
    return Figure(
        name=table["name"],
        base=table["base"],
        links=links,
        leg=tuple(table.get("leg", ())),
        marks=marks,
        optional=tuple(table.get("optional", ())),
        ahead=tuple(_pair(entry, where) for entry in table.get("ahead", ())),
        scored=tuple(table.get("scored", marks)),
        outline=table.get("outline", ""),
        panels=tuple(_panel(entry) for entry in table["panels"]) if "panels" in table else _panels(links),
        hints=table.get("hints", {}),
    )


def _panels(links: Sequence[Link]) -> tuple[Panel, ...]:
    """A panel for each angle, twins in one."""
    names = [link.freedom for link in links if link.freedom is not None]
    found: dict[str, dict[str, str]] = {}
    for name in names:
        side, title = side_of(name)
        alone = other_side(name) not in names or not side
        found.setdefault(name if alone else title, {})[name if alone else side] = name
    return tuple(Panel(title.replace("_", " "), "", curves) for title, curves in found.items())


def _pair(entry: list[Any], where: str) -> tuple[str, str]:
    if len(entry) != 2:
        raise ValueError(f"{where}: ahead holds pairs of joints; got {entry}")
    for joint in entry:
        _check_kind("each joint of ahead", joint, str, where)
    return entry[0], entry[1]


def _panel(entry: Mapping[str, Any]) -> Panel:
    where = f"panel {entry.get('title', '?')!r}"
    _check_keys(entry, where, {"title": str, "curves": dict}, {"reading": str})
    for freedom in entry["curves"].values():
        _check_kind("each of curves", freedom, str, where)
    return Panel(entry["title"], entry.get("reading", ""), entry["curves"])


_LISTS: dict[str, type] = dict.fromkeys(("leg", "marks", "optional", "ahead", "scored", "panels"), list)
_NEEDED = {"name": str, "joint": str, "length": float, "width": float}
_OPTIONAL = {"parent": str, "freedom": str, "at": float, "rest": float, "taper": float}
_OPTIONAL |= {"sense": int, "layer": int, "breathes": bool, "limits": list}
_OPTIONAL |= {"twin": str, "learned": bool, "offset": str}
_KINDS = {str: "text", float: "a number", int: "a whole number", bool: "true or false"}
_KINDS |= {list: "a list", dict: "a table"}


def _link_from(entry: Mapping[str, Any]) -> Link:
    where = f"link {entry.get('name', '?')!r}"
    _check_keys(entry, where, _NEEDED, _OPTIONAL)
    limits = entry.get("limits", [-180.0, 180.0])
    if len(limits) != 2:
        raise ValueError(f"{where}: limits must be two angles; got {limits}")
    for limit in limits:
        _check_kind("each of limits", limit, float, where)
    return Link(
        name=entry["name"],
        joint=entry["joint"],
        parent=entry.get("parent"),
        at=float(entry.get("at", 1.0)),
        rest=float(np.radians(entry.get("rest", 0.0))),
        sense=entry.get("sense", 1),
        freedom=entry.get("freedom"),
        limits=(float(np.radians(limits[0])), float(np.radians(limits[1]))),
        length=float(entry["length"]),
        breathes=entry.get("breathes", True),
        width=float(entry["width"]),
        taper=float(entry.get("taper", 1.0)),
        layer=entry.get("layer", 0),
        twin=entry.get("twin"),
        learned=entry.get("learned", True),
        offset=entry.get("offset", ""),
    )


def _check_keys(
    table: Mapping[str, Any], where: str, needed: Mapping[str, type], optional: Mapping[str, type]
) -> None:
    known = {**needed, **optional}
    for key, value in table.items():
        if key not in known:
            raise ValueError(f"{where} has the unknown key {key!r}; known are {', '.join(known)}")
        _check_kind(key, value, known[key], where)
    for key in needed:
        if key not in table:
            raise ValueError(f"{where} lacks the key {key!r}; add it")


def _check_kind(key: str, value: object, kind: type, where: str) -> None:
    # In TOML 1 is a whole number and true is not 1.
    fits = type(value) in ((float, int) if kind is float else (kind,))
    if not fits:
        raise ValueError(f"{where}: {key} must be {_KINDS[kind]}; got {value!r}")


WALKER = load_figure("walker")
