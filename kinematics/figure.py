"""A figure: a tree of links in the image plane, read from TOML, and the layout of its pose vector.

The 2-D scaled prismatic model of Morris and Rehg (1998), as used by Pavlović et al. (1999), section 4:
every link turns about the joint where it starts and may change its length. Lengths and widths are in leg
lengths, angles in radians, body coordinates have x forward and y up.

A pose `q` `(D,)` holds, in this order: root_x and root_y; one angle per turning link; `scale`, the log of
a size common to all links; `stretch_<link>`, the log of a breathing link's own length.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROOT = ("root_x", "root_y")
SCALE = "scale"
STRETCH = "stretch_"


@dataclass(frozen=True)
class Link:
    """One link of a figure.

    name    : unique within the figure
    joint   : keypoint at its tip
    parent  : link it hangs on, or None where it starts at the base
    at      : share of the parent's length at which it starts
    rest    : direction at angle zero, radians: absolute for a base link, else relative to the parent
    sense   : +1 if a positive angle turns anticlockwise (x forward, y up), -1 if clockwise
    freedom : name of its angle in the pose, or None for a link that does not turn
    limits  : smallest and largest angle, radians
    length  : at rest, leg lengths
    breathes: whether its length is a freedom of the pose
    width   : at its start, leg lengths
    taper   : width at the tip as a share of the width at the start
    layer   : larger is nearer to the camera
    """

    name: str
    joint: str
    parent: str | None
    at: float
    rest: float
    sense: int
    freedom: str | None
    limits: tuple[float, float]
    length: float
    breathes: bool
    width: float
    taper: float
    layer: int


@dataclass(frozen=True)
class Figure:
    """A tree of links, parents before children.

    name  : of the figure
    base  : keypoint where the root stands
    links : the tree
    leg   : beginnings of the names of those links whose lengths make one leg
    """

    name: str
    base: str
    links: tuple[Link, ...]
    leg: tuple[str, ...]

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for link in self.links:
            if link.name in seen:
                raise ValueError(f"link {link.name!r} is listed twice; give each its own name")
            if link.parent is not None and link.parent not in seen:
                raise ValueError(f"link {link.name!r} comes before its parent {link.parent!r}; list parents first")
            seen.add(link.name)
            _check_link(link)
        if len(set(self.freedoms)) != len(self.freedoms):
            raise ValueError(f"two freedoms of figure {self.name!r} share a name; got {', '.join(self.freedoms)}")

    @cached_property
    def freedoms(self) -> tuple[str, ...]:
        """Names of the entries of `q`, in order."""
        angles = tuple(link.freedom for link in self.links if link.freedom is not None)
        stretches = tuple(STRETCH + link.name for link in self.links if link.breathes)
        return (*ROOT, *angles, SCALE, *stretches)

    @cached_property
    def pose_freedoms(self) -> tuple[str, ...]:
        """The freedoms a motion model speaks of: root and angles."""
        return self.freedoms[: self.freedoms.index(SCALE)]

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Keypoints the figure has: its base, then each link's tip."""
        return (self.base, *(link.joint for link in self.links))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Each link's parent as a position in `links`, -1 at the base."""
        index = {link.name: i for i, link in enumerate(self.links)}
        return tuple(-1 if link.parent is None else index[link.parent] for link in self.links)

    @cached_property
    def reach(self) -> Array:
        """(L, L): where the path from the base to link i leaves link j, as a share of j's length; else 0."""
        share = np.zeros((len(self.links), len(self.links)))
        for i, parent in enumerate(self.parents):
            if parent >= 0:
                share[i] = share[parent]
                share[i, parent] = self.links[i].at
        return share

    @cached_property
    def chain(self) -> NDArray[np.bool_]:
        """(L, L): whether turning link j moves link i."""
        moved = np.eye(len(self.links), dtype=bool)
        for i, parent in enumerate(self.parents):
            if parent >= 0:
                moved[i] |= moved[parent]
        return moved

    def index(self, freedom: str) -> int:
        """Position of a freedom in `q`; ValueError if the figure has none of that name."""
        if freedom not in self.freedoms:
            raise ValueError(f"figure {self.name!r} has no freedom {freedom!r}; it has {', '.join(self.freedoms)}")
        return self.freedoms.index(freedom)

    def link_of(self, joint: str) -> int:
        """Position of the link whose tip is this keypoint."""
        return self.joints.index(joint) - 1

    def is_leg(self, link: Link) -> bool:
        """Whether the link is part of a leg."""
        return any(link.name.startswith(part) for part in self.leg)

    def with_lengths(self, lengths: Sequence[float]) -> Self:
        """The same figure with other rest lengths (L,), leg lengths."""
        links = tuple(replace(link, length=float(x)) for link, x in zip(self.links, lengths, strict=True))
        return replace(self, links=links)


def load_figure(source: str | Path = "walker") -> Figure:
    """A figure that ships, by name, or one from a TOML file.

    Raises:
        ValueError: no such figure, not TOML, an unknown or missing key, or a tree that does not hang together.
    """
    path = Path(source)
    shipped = resources.files("kinematics") / "figures" / f"{source}.toml"
    if path.suffix == ".toml":
        if not path.is_file():
            raise ValueError(f"no figure file {path}; give a TOML file that exists")
        text = path.read_text(encoding="utf-8")
    elif shipped.is_file():
        text = shipped.read_text(encoding="utf-8")
    else:
        raise ValueError(f"no figure {str(source)!r} ships; give the path of a TOML file")
    try:
        return figure_from(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise ValueError(f"figure {source}: {error}") from error


def figure_from(table: Mapping[str, Any]) -> Figure:
    """A figure from a parsed TOML table; angles there are degrees. ValueError on unknown or missing keys."""
    _only(table, {"name", "base", "leg", "links"}, "the figure")
    try:
        return Figure(
            name=table["name"],
            base=table["base"],
            links=tuple(_link_from(entry) for entry in table["links"]),
            leg=tuple(table.get("leg", ())),
        )
    except KeyError as error:
        raise ValueError(f"the key {error} is missing") from error


def _link_from(entry: Mapping[str, Any]) -> Link:
    name = entry.get("name", "?")
    _only(entry, set(Link.__dataclass_fields__), f"link {name!r}")
    low, high = entry.get("limits", (-180.0, 180.0))
    return Link(
        name=entry["name"],
        joint=entry["joint"],
        parent=entry.get("parent"),
        at=float(entry.get("at", 1.0)),
        rest=float(np.radians(entry.get("rest", 0.0))),
        sense=int(entry.get("sense", 1)),
        freedom=entry.get("freedom"),
        limits=(float(np.radians(low)), float(np.radians(high))),
        length=float(entry["length"]),
        breathes=bool(entry.get("breathes", True)),
        width=float(entry["width"]),
        taper=float(entry.get("taper", 1.0)),
        layer=int(entry.get("layer", 0)),
    )


def _only(table: Mapping[str, Any], known: set[str], where: str) -> None:
    unknown = sorted(set(table) - known)
    if unknown:
        raise ValueError(f"{where} has the unknown key {unknown[0]!r}; known are {', '.join(sorted(known))}")


def _check_link(link: Link) -> None:
    if link.sense not in (-1, 1):
        raise ValueError(f"link {link.name!r}: sense must be 1 or -1; got {link.sense}")
    if min(link.length, link.width, link.taper) <= 0:
        raise ValueError(f"link {link.name!r}: length, width and taper must be positive")
    if link.limits[0] >= link.limits[1]:
        raise ValueError(f"link {link.name!r}: limits must rise; got {np.degrees(link.limits).round(1).tolist()}")
