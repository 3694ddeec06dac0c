"""Figures read from TOML: shipped ones by name, or a user's files; docs/figures.md describes the format.

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
from kinematics.text_file import why


def load_figure(source: str | Path = "walker") -> Figure:
    """A figure that ships, by name, or one from a TOML file; ValueError: no such figure, not TOML, or as
    `figure_from`."""
    path = Path(source)
    if path.suffix != ".toml":
        content = _shipped(str(source), "give the path of a TOML file")
    elif path.is_file():
        content = path.read_bytes()
    else:
        raise ValueError(f"no figure file {path}; give a TOML file that exists")
    try:
        table = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # the parser has several ways to fail
        raise ValueError(f"{source} is no TOML file ({why(error)}); docs/figures.md shows one") from error
    try:
        figure = figure_from(table)
        if figure.outline and figure.outline != source:
            _check_outlined(figure)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"figure {source}: {error}") from error
    return figure


def _shipped(name: str, otherwise: str) -> bytes:
    folder = resources.files("kinematics") / "figures"
    if (file := folder / f"{name}.toml").is_file():
        return file.read_bytes()
    names = sorted(each.name.removesuffix(".toml") for each in folder.iterdir())
    known = f"{', '.join(names[:-1])} and {names[-1]}"
    raise ValueError(f"no figure {name!r} ships, only {known}; {otherwise}")


def _check_outlined(figure: Figure) -> None:
    """Only the walker's outline is known, and only who has all its joints has that."""
    if figure.outline != WALKER.name:
        raise ValueError(f"outline must be {WALKER.name!r} or left out; got {figure.outline!r}")
    lacking = [joint for joint in WALKER.needed if joint not in figure.marks]
    if lacking:
        raise ValueError(
            f"the outline of a {WALKER.name} needs {', '.join(lacking)} among the marks; "
            "add what is missing, or leave out the outline"
        )


def figure_from(table: Mapping[str, Any]) -> Figure:
    """A figure from a parsed TOML table; angles there are degrees. ValueError: a key is unknown, missing or
    of the wrong kind, or the links do not form a tree."""
    table = _whole(table)
    _check_keys(table, "the figure", _NEEDED, _FIGURE)
    links = _links(table["links"])
    if "extends" in table:
        links = sorted(links, key=lambda link: not link.learned)
    marks = tuple(table.get("marks", (table["base"], *(link.joint for link in links))))
    return Figure(
        name=table["name"],
        base=table["base"],
        links=tuple(links),
        leg=tuple(table.get("leg", ())),
        marks=marks,
        optional=tuple(table.get("optional", ())),
        ahead=tuple(_pair(entry) for entry in table.get("ahead", ())),
        scored=tuple(table.get("scored", marks)),
        outline=table.get("outline", ""),
        panels=tuple(map(_panel, table["panels"])) if "panels" in table else _panels(links),
        hints=table.get("hints", {}),
    )


def _whole(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """The table, with the keys of the shipped figure that it extends, whose links come first."""
    if "extends" not in table:
        return table
    _check_keys(table, "the figure", {"name": str}, _NEEDED | _FIGURE)
    base = _whole(tomllib.loads(_shipped(table["extends"], "extend one of these").decode("utf-8")))
    links = [*base["links"], *table.get("links", ())]
    return {**base, **table, "links": links, "hints": base.get("hints", {}) | table.get("hints", {})}


def _links(entries: Sequence[Mapping[str, Any]]) -> list[Link]:
    """The links of a table; one that is like another is its copy on the other side but for its own keys."""
    links, written = [], dict[str, Mapping[str, Any]]()
    for entry in entries:
        if (like := entry.get("like")) is not None:
            _check_kind("like", like, str, "a link")
            if like not in written:
                raise ValueError(f"a link is like {like!r}, which is no link before it; list it first")
            model = written[like].items()
            twin = {key: other_side(value) if isinstance(value, str) else value for key, value in model}
            entry = twin | {key: value for key, value in entry.items() if key != "like"}
        links.append(_link_from(entry))
        written[entry["name"]] = entry
    return links


def _panels(links: Sequence[Link]) -> tuple[Panel, ...]:
    """One panel an angle, shared by twins."""
    names = [link.freedom for link in links if link.freedom is not None]
    found: dict[str, dict[str, str]] = {}
    for name in names:
        side, title = side_of(name)
        alone = other_side(name) not in names or not side
        found.setdefault(name if alone else title, {})[name if alone else side] = name
    return tuple(Panel(title.replace("_", " "), "", curves) for title, curves in found.items())


def _pair(entry: list[str]) -> tuple[str, str]:
    if len(entry) != 2:
        raise ValueError(f"the figure: ahead holds pairs of joints; got {entry}")
    return entry[0], entry[1]


def _panel(entry: Mapping[str, Any]) -> Panel:
    where = f"panel {entry.get('title', '?')!r}"
    _check_keys(entry, where, {"title": str, "curves": {"": str}}, {"reading": str})
    return Panel(entry["title"], entry.get("reading", ""), entry["curves"])


# Kinds of values: [str] is a list of texts, {"": str} a table of them.
_NEEDED: dict[str, Any] = {"name": str, "base": str, "links": [dict]}
_FIGURE: dict[str, Any] = {key: [str] for key in ("leg", "marks", "optional", "scored")}
_FIGURE |= {"ahead": [[str]], "panels": [dict], "outline": str, "hints": {"": str}, "extends": str}
_OF_LINK = {"name": str, "joint": str, "length": float, "width": float}
_OPTIONAL: dict[str, Any] = dict.fromkeys(("parent", "freedom", "twin", "offset", "like"), str)
_OPTIONAL |= dict.fromkeys(("at", "rest", "taper"), float) | dict.fromkeys(("sense", "layer"), int)
_OPTIONAL |= dict.fromkeys(("breathes", "learned"), bool) | {"limits": [float]}
_WORDS = {str: "text", float: "a number", int: "a whole number", bool: "true or false"}
_WORDS |= {list: "a list", dict: "a table"}


def _link_from(entry: Mapping[str, Any]) -> Link:
    where = f"link {entry.get('name', '?')!r}"
    _check_keys(entry, where, _OF_LINK, _OPTIONAL)
    limits = entry.get("limits", [-180.0, 180.0])
    if len(limits) != 2:
        raise ValueError(f"{where}: limits must be two angles; got {limits}")
    numbers = {key: float(value) for key, value in entry.items() if (_OF_LINK | _OPTIONAL)[key] is float}
    angles = {
        "rest": np.radians(numbers.get("rest", 0.0)).item(),
        "limits": tuple(np.radians([float(limit) for limit in limits]).tolist()),
    }
    return Link(**{**entry, **numbers, **angles})


def _check_keys(
    table: Mapping[str, Any], where: str, needed: Mapping[str, Any], optional: Mapping[str, Any]
) -> None:
    known = {**needed, **optional}
    for key, value in table.items():
        if key not in known:
            raise ValueError(f"{where} has the unknown key {key!r}; known are {', '.join(known)}")
        _check_kind(key, value, known[key], where)
    for key in needed:
        if key not in table:
            raise ValueError(f"{where} lacks the key {key!r}; add it")


def _check_kind(key: str, value: Any, kind: Any, where: str) -> None:
    outer = kind if isinstance(kind, type) else type(kind)
    # In TOML 1 is a whole number and true is not 1.
    if type(value) not in ((float, int) if outer is float else (outer,)):
        raise ValueError(f"{where}: {key} must be {_WORDS[outer]}; got {value!r}")
    if outer is not kind:
        (inner,) = kind.values() if outer is dict else kind
        for part in value.values() if outer is dict else value:
            _check_kind(f"each of {key}", part, inner, where)


WALKER = load_figure("walker")
