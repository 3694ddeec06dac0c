"""Figures to test with, and where a pose puts their joints, written from the definition alone."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from kinematics.figure import SCALE, STRETCH
from kinematics.figure_file import figure_from, load_figure
from kinematics.sides import SIDES, other_side

WALKER = load_figure("walker")
ARMS = load_figure("walker-arms")


def _link(name, joint, length, width, limits=None, layer=2, **more):
    """A link as a file has it; its angle, if it has limits, is called as it is unless told otherwise."""
    turns = {"freedom": name, "limits": limits} if limits else {}
    return {"name": name, "joint": joint, "length": length, "width": width, "layer": layer} | turns | more


def _far(link):
    """The link of the other side."""
    return {key: other_side(of) if isinstance(of, str) else of for key, of in link.items()} | {"layer": 0}


# A horse: links that start along their parent and at its very start, hooves that cannot turn, a tail whose
# angles lie about 180 degrees, and legs that are not the walker's.
TRUNK = [
    _link("trunk", "withers", 0.9, 0.5, [-30, 30], 1),
    _link("neck", "poll", 0.6, 0.3, [-20, 80], 1, parent="trunk", at=0.95, rest=50, sense=-1, taper=0.6),
    _link("head", "muzzle", 0.4, 0.2, [10, 130], 1, parent="neck", at=0.9, rest=180, taper=0.5),
    _link("tail", "dock", 0.5, 0.1, [110, 250], 1, parent="trunk", at=0.0, breathes=False),
]
SHANK, ARM = {"parent": "thigh_near", "sense": -1}, {"parent": "arm_near", "sense": -1}
HIND = [
    _link("thigh_near", "near_stifle", 0.5, 0.3, [-50, 60], rest=-90, freedom="hip_near"),
    _link("shank_near", "near_hock", 0.5, 0.15, [5, 120], **SHANK, freedom="hock_near"),
    _link("hoof_near", "near_hoof", 0.2, 0.1, parent="shank_near", rest=20, breathes=False),
]
FORE = [
    _link(
        "arm_near", "near_knee", 0.5, 0.2, [-50, 70], parent="trunk", at=0.85, rest=-90, freedom="elbow_near"
    ),
    _link("cannon_near", "near_fetlock", 0.4, 0.1, [-10, 120], **ARM, freedom="knee_near"),
]
HORSE = figure_from(
    {
        "name": "horse",
        "base": "croup",
        "leg": ["thigh", "shank"],
        "optional": [f"{side}_{j}" for side in SIDES for j in ("hock", "hoof", "knee", "fetlock")],
        "links": [*TRUNK, *(link for leg in (HIND, FORE) for link in (*leg, *map(_far, leg)))],
    }
)
FIGURES = [WALKER, HORSE]
every_figure = pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: figure.name)
FOOTLESS = replace(
    WALKER,
    links=WALKER.links[:6],
    marks=tuple(name for name in WALKER.marks if not name.endswith("toe")),
    optional=("near_ankle", "far_ankle"),
    ahead=(),
    panels=tuple(panel for panel in WALKER.panels if panel.title != "Ankle"),
    hints={},
)


def random_pose(figure, rng, *, size=0.3):
    """Angles within their limits; log lengths of about `size`."""
    q = rng.normal(size=len(figure.freedoms)) * size
    for link in figure.links:
        if link.freedom is not None:
            q[figure.freedoms.index(link.freedom)] = rng.uniform(*link.limits)
    return q


def upright(figure, **values):
    """The pose of zeros but for the freedoms named."""
    q = np.zeros(len(figure.freedoms))
    for name, value in values.items():
        q[figure.freedoms.index(name)] = value
    return q


class Puppet:
    """A figure in a pose in the complex plane, followed up the tree from every link anew."""

    def __init__(self, figure, q):
        self.figure = figure
        self.value = dict(zip(figure.freedoms, q, strict=True))
        self.links = {link.name: link for link in figure.links}
        self.size = math.exp(self.value[SCALE])

    def heading(self, link):
        before = 0.0 if link.parent is None else self.heading(self.links[link.parent])
        return before + link.rest + link.sense * self.value.get(link.freedom, 0.0)

    def span(self, link):
        length = link.length * self.size * math.exp(self.value.get(STRETCH + link.name, 0.0))
        return cmath.rect(length, self.heading(link))

    def start(self, link):
        if link.parent is None:
            return complex(self.value["root_x"], self.value["root_y"])
        parent = self.links[link.parent]
        return self.start(parent) + link.at * self.span(parent)

    def point(self, link, along, across):
        left = cmath.rect(self.size * across, self.heading(link) + math.pi / 2.0)
        point = self.start(link) + along * self.span(link) + left
        return np.array([point.real, point.imag])

    def joints(self):
        """Keypoint to (2,) body coordinates."""
        tips = {link.joint: self.point(link, 1.0, 0.0) for link in self.figure.links}
        return {self.figure.base: self.point(self.figure.links[0], 0.0, 0.0), **tips}


def marks_of(figure, q, *, facing=1, unit=100.0, origin=(320.0, 200.0), without=()):
    """Pixels of the joints, as one would click them."""
    body = Puppet(figure, q).joints()
    return {
        name: (origin[0] + facing * unit * x, origin[1] - unit * y)
        for name, (x, y) in body.items()
        if name not in without
    }
