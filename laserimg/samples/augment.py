"""More positives from those there are: turned, mirrored, lit otherwise, on other grounds."""

from dataclasses import dataclass
from math import inf

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError
from laserimg.samples.laser import check_image, mirrored, moved_with_gaps, with_noise

Pixels = NDArray[np.uint8]
# The eye that sees a turned sample in perspective, in widths of the window, as in opencv_createsamples.
_DISTANCE = 4.0


@dataclass(frozen=True)
class Variation:
    """How much samples may change; each value is drawn evenly up to its limit.

    Attributes
    ----------
    turn_deg : (float, float, float)
        About the axes across, up and towards the viewer.
    shift, scale : float
        As shares of the window.
    contrast, brightness : float
        Contrast as a share, brightness in grey levels.
    noise : float
        Standard deviation in grey levels.
    dropped : float
        Share of pixels set to 0, as where a laser gets no return.
    mirror, invert : bool
        Half of the samples, by chance.
    image : str
        The image of a scan that samples are, or one plane of it: they vary only as scans do, and pixels
        without a return (0) stay without. "" is a photograph.
    """

    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shift: float = 0.0
    scale: float = 0.0
    contrast: float = 0.0
    brightness: float = 0.0
    noise: float = 0.0
    dropped: float = 0.0
    mirror: bool = False
    invert: bool = False
    image: str = ""

    def __post_init__(self) -> None:
        if not max(map(abs, self.turn_deg)) < 80:
            raise ConfigError("turns must be less than 80 degrees")
        if not (0 <= self.shift < 0.5 and 0 <= self.scale < 0.5 and 0 <= self.contrast < 1):
            raise ConfigError("shift and scale must be 0 to 0.5, contrast 0 to 1")
        if not (0 <= self.brightness < inf and 0 <= self.noise < inf and 0 <= self.dropped < 1):
            raise ConfigError("brightness and noise must be 0 or more, dropped 0 to 1")
        if self.image:
            lit = bool(self.contrast or self.brightness or self.invert)
            check_image(self.image, self.turn_deg, lit, self.mirror)


def vary(samples: Pixels, count: int, variation: Variation, rng: np.random.Generator) -> Pixels:
    """Return `count` varied samples; each sample is used as often as the others, give or take one.

    Parameters
    ----------
    samples : (n, height, width) uint8
    count : int
    variation : Variation
    rng : numpy.random.Generator

    Examples
    --------
    >>> ramp = np.arange(256, dtype=np.uint8).reshape(1, 16, 16)
    >>> vary(ramp, 3, Variation(noise=2), np.random.default_rng(0)).shape
    (3, 16, 16)
    """
    source = rng.permutation(np.arange(count) % len(samples))
    return np.stack([_varied(samples[i], variation, rng) for i in source])


def paste(
    samples: Pixels, grounds: Pixels, transparent: int, tolerance: int, rng: np.random.Generator
) -> Pixels:
    """Return samples whose pixels of one grey level show a background instead.

    Parameters
    ----------
    samples : (n, height, width) uint8
    grounds : (m, height, width) uint8
        Windows of backgrounds, drawn from by chance.
    transparent, tolerance : int
        The grey level, and how far a pixel may be from it.
    rng : numpy.random.Generator
    """
    chosen = grounds[rng.integers(len(grounds), size=len(samples))]
    see_through = np.abs(samples.astype(np.int16) - transparent) <= tolerance
    return np.where(see_through, chosen, samples)


def _varied(sample: Pixels, variation: Variation, rng: np.random.Generator) -> Pixels:
    out = _moved(sample, variation, rng)
    if variation.mirror and rng.random() < 0.5:
        out = mirrored(out, variation.image)
    noise = rng.normal(0, 1, out.shape) * variation.noise
    varied = with_noise(out, noise) if variation.image else _lit(out, noise, variation, rng)
    return np.where(rng.random(out.shape) < variation.dropped, np.uint8(0), varied)


def _lit(sample: Pixels, noise: NDArray, variation: Variation, rng: np.random.Generator) -> Pixels:
    out = 255 - sample if variation.invert and rng.random() < 0.5 else sample
    gain = 1 + rng.uniform(-1, 1) * variation.contrast
    lit = (out - out.mean()) * gain + out.mean() + rng.uniform(-1, 1) * variation.brightness
    return np.rint(lit + noise).clip(0, 255).astype(np.uint8)


def _moved(sample: Pixels, variation: Variation, rng: np.random.Generator) -> Pixels:
    height, width = sample.shape
    turns = np.deg2rad(rng.uniform(-1, 1, 3) * variation.turn_deg)
    shift = rng.uniform(-1, 1, 2) * variation.shift * (width, height)
    scale = 1 + rng.uniform(-1, 1) * variation.scale
    view = _view(turns, scale, shift, width, height)
    if np.allclose(view, np.eye(3)):
        return sample
    linear = _warped(sample, view, cv2.INTER_LINEAR)
    if not variation.image:
        return linear
    returns = _warped(np.where(sample > 0, np.uint8(255), np.uint8(0)), view, cv2.INTER_LINEAR)
    return moved_with_gaps(linear, _warped(sample, view, cv2.INTER_NEAREST), returns)


def _warped(sample: Pixels, view: NDArray, interpolation: int) -> Pixels:
    size = sample.shape[::-1]
    moved = cv2.warpPerspective(sample, view, size, flags=interpolation, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.uint8)


def _view(turns: NDArray, scale: float, shift: NDArray, width: int, height: int) -> NDArray[np.float64]:
    # The sample is a card round the origin, turned, and seen by an eye before it.
    across, up, towards = (
        cv2.Rodrigues(axis * angle)[0] for axis, angle in zip(np.eye(3), turns, strict=True)
    )
    turned = towards @ up @ across
    distance = _DISTANCE * width
    centre = np.array([[1, 0, -(width - 1) / 2], [0, 1, -(height - 1) / 2], [0, 0, 1]])
    card = turned[:, :2] @ centre[:2] + np.array([[0, 0, 0], [0, 0, 0], [0, 0, distance]])
    focal = distance * scale
    middle = np.array([(width - 1) / 2, (height - 1) / 2]) + shift
    camera = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
    view = camera @ card
    return view / view[2, 2]
