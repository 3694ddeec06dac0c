"""A figure: a tree of links in the image plane, and the layout of its pose vector.

The 2-D scaled prismatic model of Morris and Rehg (1998), as used by Pavlović et al. (1999), section 4:
every link turns about the joint where it starts and may change its length. Lengths and widths are in leg
lengths, angles in radians, body coordinates have x forward and y up.

A pose `q` `(D,)` holds, in this order: root_x and root_y; one angle per turning link; `scale`, the log of
a size common to all links; `stretch_<link>`, the log of a breathing link's own length.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from kinematics.sides import exchanged

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Flags = NDArray[np.bool_]

ROOT = ("root_x", "root_y")
SCALE = "scale"
STRETCH = "stretch_"
# marked: a constant of each figure, left out in learning and taken from the start pose.
OFFSETS = ("", "marked")


@dataclass(frozen=True)
class Link:
    """One link of a figure.

    name    : unique within the figure
    joint   : keypoint at its tip
    length  : at rest, leg lengths
    width   : at its start, leg lengths
    rest    : direction at angle zero, radians: absolute for a base link, else relative to the parent
    limits  : smallest and largest angle, radians
    parent  : link at whose end it starts, or None for the base
    at      : share of the parent's length at which it starts
    sense   : +1 if a positive angle turns anticlockwise (x forward, y up), -1 if clockwise
    freedom : name of its angle in the pose, or None for a link that does not turn
    breathes: whether its length is a freedom of the pose
    taper   : width at the tip as a share of the width at the start
    layer   : larger is nearer to the camera
    twin    : the same link on the other side; None if it is found by exchanging `near` and `far` in the name
    learned : whether motion models include its angle
    offset  : constant of each figure that is added to its angle, one of OFFSETS
    """

    name: str
    joint: str
    length: float
    width: float
    rest: float
    limits: tuple[float, float]
    parent: str | None = None
    at: float = 1.0
    sense: int = 1
    freedom: str | None = None
    breathes: bool = True
    taper: float = 1.0
    layer: int = 0
    twin: str | None = None
    learned: bool = True
    offset: str = ""

    @property
    def half_width(self) -> float:
        """Half of its greatest width, leg lengths."""
        return 0.5 * self.width * max(1.0, self.taper)


@dataclass(frozen=True)
class Panel:
    """Angles that a report draws together.

    reading : how to read them
    curves  : name and freedom of each curve
    """

    title: str
    reading: str
    curves: Mapping[str, str]


# Compiled code takes it as a tuple: after a change of this order, delete numba's cache.
class Layout(NamedTuple):
    """The links as arrays: where a pose holds the freedoms of each of L links, and the links' constants.

    scale          : position of the common scale in `q`
    angle, stretch : (L,) position of a link's angle and of its stretch; of `scale` where it has none
    turns, breathes: (L,) whether a link has such an angle, such a stretch
    sense          : (L,) +1 or -1, 0 where it does not turn
    rest, length   : (L,) as in `Link`
    width, taper   : (L,)
    layer          : (L,)
    chain, reach   : (L, L) as in `Figure`, as numbers
    """

    scale: int
    angle: Ints
    stretch: Ints
    turns: Flags
    breathes: Flags
    sense: Array
    rest: Array
    length: Array
    width: Array
    taper: Array
    layer: Ints
    chain: Array
    reach: Array


@dataclass(frozen=True)
class Figure:
    """A tree of links, parents before children.

    name     : of the figure
    base     : keypoint where the root stands
    links    : the tree
    leg      : prefixes of the names of the links whose lengths add up to one leg
    marks    : joints that are marked, in this order
    optional : marks that a start pose may lack
    ahead    : pairs of joints of which the second lies where the figure faces
    scored   : joints that tracks are compared by
    outline  : figure whose outline and gait cycles apply to this one; "" for none
    panels   : how a report draws its angles
    hints    : what each joint is, shown to the person who marks
    """

    name: str
    base: str
    links: tuple[Link, ...]
    leg: tuple[str, ...]
    marks: tuple[str, ...]
    optional: tuple[str, ...] = ()
    ahead: tuple[tuple[str, str], ...] = ()
    scored: tuple[str, ...] = ()
    outline: str = ""
    panels: tuple[Panel, ...] = ()
    hints: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.links:
            raise ValueError(f"figure {self.name!r} has no links; give it one at least")
        self._check_tree()
        self._check_names()

    def _check_tree(self) -> None:
        names, joints = [link.name for link in self.links], list(self.joints)
        for i, link in enumerate(self.links):
            if link.name in names[:i]:
                raise ValueError(f"link {link.name!r} is listed twice; give each its own name")
            if link.joint in joints[: i + 1]:
                raise ValueError(f"link {link.name!r}: another link or the base has the joint {link.joint!r}")
            if link.parent is not None and link.parent not in names[:i]:
                fault = "comes before its parent" if link.parent in names else "hangs on an unlisted link,"
                raise ValueError(f"link {link.name!r} {fault} {link.parent!r}; list parents first")
            if link.twin is not None and link.twin not in names:
                raise ValueError(f"link {link.name!r}: its twin {link.twin!r} is no link of the figure")
            _check_link(link)

    def _check_names(self) -> None:
        names = [link.name for link in self.links]
        if len(set(self.freedoms)) != len(self.freedoms):
            raise ValueError(
                f"two freedoms of figure {self.name!r} share a name; got {', '.join(self.freedoms)}"
            )
        for i, twin in self.twins.items():
            one, other = self.links[i], self.links[twin]
            alike = (one.breathes, one.freedom is None) == (other.breathes, other.freedom is None)
            if self.twins.get(twin) != i or not alike:
                raise ValueError(
                    f"links {one.name!r} and {other.name!r} must be each other's twin, turn and breathe alike"
                )
        for part in self.leg:
            if not any(name.startswith(part) for name in names):
                raise ValueError(
                    f"leg of figure {self.name!r} names {part!r}, but no link begins so; "
                    f"the links are {', '.join(names)}"
                )
        if self.base not in self.marks:
            raise ValueError(f"marks of figure {self.name!r} lack its base {self.base!r}; add it")
        known = {"marks": self.joints, "ahead": self.joints, "optional": self.marks, "scored": self.marks}
        given = {name: getattr(self, name) for name in known} | {
            "ahead": [j for two in self.ahead for j in two]
        }
        known["hints"], given["hints"] = self.marks, list(self.hints)
        known["panels"], given["panels"] = self.freedoms, [f for p in self.panels for f in p.curves.values()]
        for key, values in given.items():
            for value in values:
                if value not in known[key]:
                    raise ValueError(
                        f"{key} of figure {self.name!r} names {value!r}; known are {', '.join(known[key])}"
                    )
        angles = [link.learned for link in self.links if link.freedom is not None]
        if sorted(angles, reverse=True) != angles:
            raise ValueError(f"list the links of figure {self.name!r} that are not learned after all others")

    @cached_property
    def freedoms(self) -> tuple[str, ...]:
        """Names of the entries of `q`, in order."""
        angles = tuple(link.freedom for link in self.links if link.freedom is not None)
        stretches = tuple(STRETCH + link.name for link in self.links if link.breathes)
        return (*ROOT, *angles, SCALE, *stretches)

    @cached_property
    def pose_freedoms(self) -> tuple[str, ...]:
        """Names of the freedoms of a pose: the root and the angles."""
        return self.freedoms[: self.freedoms.index(SCALE)]

    @cached_property
    def learned_freedoms(self) -> tuple[str, ...]:
        """The freedoms of motion models: the root, and the angles of links that are learned."""
        return (*ROOT, *(link.freedom for link in self.links if link.freedom is not None and link.learned))

    @cached_property
    def marked_offsets(self) -> list[str]:
        """The freedoms whose offset is taken from the start pose."""
        return [link.freedom for link in self.links if link.freedom is not None and link.offset == "marked"]

    @cached_property
    def personal_angles(self) -> list[str]:
        """The other learned angles: each may differ from learned motion by an unknown constant."""
        return [name for name in self.learned_freedoms if name not in (*ROOT, *self.marked_offsets)]

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """(D,) least and (D,) greatest value of every freedom; infinite where it has no limit."""
        limited = {link.freedom: link.limits for link in self.links}
        free = (-np.inf, np.inf)
        low, high = np.array([limited.get(name, free) for name in self.freedoms]).T
        return low, high

    @cached_property
    def layout(self) -> Layout:
        """The tree of links as arrays, see `Layout`."""
        links, scale = self.links, self.freedoms.index(SCALE)
        turns = [link.freedom is not None for link in links]
        stretches = [STRETCH + link.name if link.breathes else SCALE for link in links]
        alike = ("breathes", "rest", "length", "width", "taper", "layer")
        return Layout(
            scale=scale,
            angle=np.array([self.freedoms.index(link.freedom or SCALE) for link in links]),
            stretch=np.array([self.freedoms.index(name) for name in stretches]),
            turns=np.array(turns),
            sense=np.where(turns, [link.sense for link in links], 0.0),
            chain=self.chain.astype(float),
            reach=self.reach,
            **{name: np.array([getattr(link, name) for link in links]) for name in alike},
        )

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Keypoints the figure has: its base, then each link's tip."""
        return (self.base, *(link.joint for link in self.links))

    @cached_property
    def needed(self) -> tuple[str, ...]:
        """Joints that a start pose requires."""
        return tuple(name for name in self.joints if name in self.marks and name not in self.optional)

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Each link's parent as a position in `links`, -1 at the base."""
        index = {link.name: i for i, link in enumerate(self.links)}
        return tuple(-1 if link.parent is None else index[link.parent] for link in self.links)

    @cached_property
    def twins(self) -> dict[int, int]:
        """For each link that has one, its twin on the other side; positions in `links`."""
        names = [link.name for link in self.links]
        twins = exchanged(names).tolist()
        for i, link in enumerate(self.links):
            if link.twin is not None:
                twins[i], twins[names.index(link.twin)] = names.index(link.twin), i
        return {i: twin for i, twin in enumerate(twins) if twin != i}

    @cached_property
    def joint_twins(self) -> Ints:
        """(1 + L,) position in `joints` of each joint's twin on the other side, or its own."""
        order = np.arange(len(self.joints))
        for link, twin in self.twins.items():
            order[1 + link] = 1 + twin
        return order

    @cached_property
    def exchanged(self) -> Ints:
        """(D,) position in `q` of each freedom's twin on the other side; its own where there is none."""
        order, layout = np.arange(len(self.freedoms)), self.layout
        for link, twin in self.twins.items():
            order[layout.angle[link]] = layout.angle[twin]
            order[layout.stretch[link]] = layout.stretch[twin]
        return order

    @cached_property
    def depth(self) -> tuple[str, ...]:
        """(L,) far in the farthest layer, near in the nearest, trunk between or where there is but one."""
        layers = [link.layer for link in self.links]
        words = {layer: "trunk" for layer in layers}
        if len(words) > 1:
            words |= {min(layers): "far", max(layers): "near"}
        return tuple(words[layer] for layer in layers)

    @cached_property
    def legs(self) -> tuple[tuple[int, ...], ...]:
        """Positions of the links of each leg, from where it begins."""
        found: list[list[int]] = []
        for i, link in enumerate(self.links):
            if self.is_leg(link):
                own = next((leg for leg in found if leg[-1] == self.parents[i]), None)
                found.append([i]) if own is None else own.append(i)
        return tuple(map(tuple, found))

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
    def chain(self) -> Flags:
        """(L, L): whether turning link j moves link i."""
        moved = np.eye(len(self.links), dtype=bool)
        for i, parent in enumerate(self.parents):
            if parent >= 0:
                moved[i] |= moved[parent]
        return moved

    def index(self, freedom: str) -> int:
        """Position of a freedom in `q`; ValueError if the figure has none of that name."""
        if freedom not in self.freedoms:
            raise ValueError(
                f"figure {self.name!r} has no freedom {freedom!r}; it has {', '.join(self.freedoms)}"
            )
        return self.freedoms.index(freedom)

    def link_of(self, joint: str) -> int:
        """Position of the link whose tip is this keypoint; ValueError if there is none."""
        return self.joints[1:].index(joint)

    def is_leg(self, link: Link) -> bool:
        return any(link.name.startswith(part) for part in self.leg)

    def with_lengths(self, lengths: Sequence[float]) -> Self:
        """The same figure with other rest lengths (L,), leg lengths."""
        links = tuple(replace(link, length=float(x)) for link, x in zip(self.links, lengths, strict=True))
        return replace(self, links=links)


def _check_link(link: Link) -> None:
    where = f"link {link.name!r}"
    if link.sense not in (-1, 1):
        raise ValueError(f"{where}: sense must be 1 or -1; got {link.sense}")
    sizes = (link.length, link.width, link.taper)
    if not all(0.0 < size < np.inf for size in sizes):
        raise ValueError(f"{where}: length, width and taper must be positive; got {sizes}")
    if not 0.0 <= link.at <= 1.0:
        raise ValueError(f"{where}: at must be a share of the parent's length, 0 to 1; got {link.at}")
    if not np.isfinite(link.rest):
        raise ValueError(f"{where}: rest must be an angle; got {link.rest}")
    if link.offset not in OFFSETS:
        raise ValueError(f"{where}: offset must be {', '.join(map(repr, OFFSETS))}; got {link.offset!r}")
    if not -np.inf < link.limits[0] < link.limits[1] < np.inf:
        raise ValueError(f"{where}: limits must rise; got {np.degrees(link.limits).round(1).tolist()}")
