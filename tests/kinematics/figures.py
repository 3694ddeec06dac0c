"""Figures to test with, and where a pose puts their joints, written from the definition alone."""

import cmath
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinematics.figure import SCALE, STRETCH
from kinematics.figure_file import load_figure

# Another figure as a TOML and no code.
HORSE_FILE = Path(__file__).with_name("horse.toml")

WALKER = load_figure("walker")
HORSE = load_figure(HORSE_FILE)
ARMS = load_figure("walker-arms")
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
