"""Sums of maps under silhouettes with the hip at every place, by Fourier transforms.

The transforms of the silhouettes are computed once for all maps of a shape.
"""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from tracker.picture.pyramid import Planes


@dataclass(frozen=True)
class Kernels:
    """Silhouettes under which maps of one shape are summed.

    spectra : (K, H, W) their Fourier transforms in OpenCV's packing, as wide as a map and a silhouette
    hip     : row and column of the hip in each
    shape   : rows and columns of a map
    """

    spectra: Planes
    hip: tuple[int, int]
    shape: tuple[int, int]

    @classmethod
    def of(cls, silhouettes: Planes, hip: tuple[int, int], shape: tuple[int, int]) -> Self:
        """Kernels of silhouettes (K, h, w), with the hip at this row and column, for maps of this shape."""
        size = tuple(cv2.getOptimalDFTSize(m + n) for m, n in zip(shape, silhouettes.shape[1:], strict=True))
        return cls(np.stack([_spectrum(each, size, (0, 0)) for each in silhouettes]), hip, shape)

    def sums(self, values: Planes) -> Planes:
        """(K, h, w) sums of a map (h, w) under each silhouette with its hip at every place."""
        h, w = self.shape
        seen = _spectrum(values, self.spectra.shape[1:], self.hip)
        products = (cv2.mulSpectrums(seen, each, 0, conjB=True) for each in self.spectra)
        return np.array([cv2.idft(each, flags=cv2.DFT_SCALE)[:h, :w] for each in products], np.float32)


def _spectrum(values: Planes, size: tuple[int, ...], corner: tuple[int, int]) -> Planes:
    """The transform of values that begin at a row and column, padded with zeros."""
    wide, (row, column), (h, w) = np.zeros(size, np.float32), corner, values.shape
    wide[row : row + h, column : column + w] = values
    return np.asarray(cv2.dft(wide, nonzeroRows=row + h), dtype=np.float32)
