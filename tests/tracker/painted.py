"""A figure painted from the definition alone: each link carries a cloth of its own that goes where it goes.

Cloths and background are sums of a few waves, so they have a value at every point and no pixels of their own.
"""

import numpy as np

from kinematics.figure import STRETCH
from kinematics.spm import View
from tests.kinematics.figures import WALKER, Puppet, upright
from tracker.picture.pyramid import pyramid
from tracker.registration.modes import mode_of
from tracker.settings import Settings

# Every setting, so that tuning the defaults does not move the tests.
FULL = Settings(
    mode="full",
    templates=True,
    contrast=0.5,
    spacing=0.03,
    rim=0.04,
    cover=1.0,
    blurs=(0.05, 0.025, 0.012),
    iterations=20,
    noise=8.0,
    light=40.0,
    robust=2.0,
    backdrop=True,
    tempering=0.05,
    image_weight=1.0,
    blend=0.05,
    camera=True,
    hypotheses=6,
    margin=0.3,
    inflation=8.0,
    surprise=0.01,
    scale_drift=0.003,
    breathing=0.03,
    ankle=25.0,
    mark=0.03,
    point=0.03,
    point_likelihood=0.3,
    exchange=0.1,
    one_leg=0.02,
    cv_angle=2.0,
    cv_place=0.01,
)
CLASSIC = FULL.model_copy(update={"mode": "classic"})
BARE = FULL.model_copy(update={"rim": 0.0})  # templates end at the outline

VIEW = View(origin=(90.0, 92.0), unit=80.0, facing=1)
SIZE = (180, 190)  # width and height, pixels: the whole walker with a border of 10 or more
STRIDE = upright(WALKER, torso=0.08, neck=0.1, hip_near=0.4, knee_near=0.15, hip_far=-0.3, knee_far=0.35)


def levels_of(image, settings=FULL, view=VIEW, **how):
    """The whole picture at every blur."""
    height, width = image.shape[:2]
    blurs = [blur * view.unit for blur in settings.blurs]
    return pyramid(image, (0, 0, width, height), blurs, mode_of(settings).colour, **how)


class Cloth:
    """A smooth random colour at every point of a plane, RGB grey levels."""

    def __init__(self, rng, *, wavelengths=(0.09, 0.35), waves=12, contrast=14.0):
        length = rng.uniform(*wavelengths, waves)
        turn = rng.uniform(0.0, 2.0 * np.pi, waves)
        self.number = 2.0 * np.pi / length * np.stack([np.cos(turn), np.sin(turn)])
        self.phase = rng.uniform(0.0, 2.0 * np.pi, waves)
        self.amplitude = contrast * rng.normal(size=(waves, 1)) * rng.uniform(0.6, 1.4, (waves, 3))
        self.mean = rng.uniform(95.0, 160.0) + rng.uniform(-20.0, 20.0, 3)

    def __call__(self, points):
        return self.mean + np.cos(points @ self.number + self.phase) @ self.amplitude


class Painted:
    """Pictures of a figure before a still background, drawn `fine` times finer and then averaged."""

    def __init__(self, rng, figure=WALKER, *, view=VIEW, size=SIZE, fine=3, plain=False):
        self.figure, self.view, self.size, self.fine = figure, view, size, fine
        self.cloths = [Cloth(rng) for _ in figure.links]
        behind = Cloth(rng, wavelengths=(0.2, 0.6), contrast=0.0 if plain else 8.0)
        self.points = self._places(fine)
        self.background = behind(self._places(1)).repeat(fine, axis=0).repeat(fine, axis=1)

    def _places(self, fine):
        """Body coordinates of the middles of pixels cut this finely."""
        x, y = ((np.arange(n * fine) + 0.5) / fine - 0.5 for n in self.size)
        return self.view.to_body(np.stack(np.meshgrid(x, y), axis=-1))

    def _around(self, q, i):
        """The part of the canvas that link i may cover."""
        puppet, link = Puppet(self.figure, q), self.figure.links[i]
        ends = puppet.start(link) + np.array([0.0, 1.0]) * puppet.span(link)
        at = self.view.to_pixels(np.stack([ends.real, ends.imag], axis=-1))
        reach = 0.5 * link.width * max(1.0, link.taper) * puppet.size * self.view.unit + 1.0
        low, high = at.min(0) - reach, at.max(0) + reach
        (x0, y0), (x1, y1) = (np.maximum(self.fine * np.round(end), 0).astype(int) for end in (low, high))
        return slice(y0, y1 + self.fine), slice(x0, x1 + self.fine)

    def picture(self, q, *, light=None, noise=0.0, rng=None):
        """(H, W, 3) uint8 RGB.

        Args:
            light: grey levels added to each link.
            noise: of each pixel, grey levels.
        """
        light = np.zeros(len(self.figure.links)) if light is None else light
        canvas = self.background.copy()
        for i in sorted(range(len(self.figure.links)), key=lambda i: self.figure.links[i].layer):
            around = self._around(q, i)
            place, within = outline(self.figure, q, i, self.points[around])
            canvas[around][within] = self.cloths[i](place[within]) + light[i]
        width, height = self.size
        picture = canvas.reshape(height, self.fine, width, self.fine, 3).mean(axis=(1, 3))
        if noise > 0.0:
            picture += rng.normal(scale=noise, size=picture.shape)
        return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def outline(figure, q, i, points):
    """Where points (..., 2) lie on link i, in rest leg lengths along and across, and whether within it."""
    puppet, link = Puppet(figure, q), figure.links[i]
    span = puppet.span(link)
    offset = (points[..., 0] + 1j * points[..., 1] - puppet.start(link)) * np.conj(span) / abs(span)
    along, across = offset.real / abs(span), offset.imag / puppet.size
    half = 0.5 * link.width * (1.0 + (link.taper - 1.0) * np.clip(along, 0.0, 1.0))
    within = (along > 0.0) & (along < 1.0) & (np.abs(across) < half)
    return np.stack([along * link.length, across], axis=-1), within


def covered(figure, q, points, link):
    """(P,) whether a nearer link lies over each point of its link."""
    layers = np.array([part.layer for part in figure.links])
    hidden = np.zeros(len(points), dtype=bool)
    for i, layer in enumerate(layers):
        hidden |= outline(figure, q, i, points)[1] & (layers[link] < layer)
    return hidden


def placed(figure, q, templates):
    """(P, 2) body coordinates of template points."""
    puppet = Puppet(figure, q)
    parts = zip(templates.link, templates.along, templates.across, strict=True)
    return np.array([puppet.point(figure.links[i], u, v) for i, u, v in parts])


def freedoms(figure, *names):
    """Columns of q, stretches by the name of their link."""
    at = figure.freedoms.index
    return [at(name) if name in figure.freedoms else at(STRETCH + name) for name in names]
