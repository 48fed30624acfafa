"""Varying images of scans as scans vary: geometry and what sensors do, nothing else."""

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError
from laserimg.images import check_image_name

Pixels = NDArray[np.uint8]

# Ranges and normals of a turned sample stay as they were: by so much a component of a normal is 0.09 off, as
# noise makes it.
MAX_TURN_DEG = 5
# The planes of normals to the left or right; seen in a mirror they point the other way.
_SIDEWAYS = ("normals.g", "normals_view.g")
# A grey of three planes does not tell the one that a mirror inverts.
_MIXED = ("normals", "normals_view")


def check_image(image: str, turn_deg: tuple[float, float, float], lit: bool, mirror: bool) -> None:
    """Refuse variations that no scan of the object could give.

    Parameters
    ----------
    image : str
        Kind of image, or one plane of it.
    turn_deg : (float, float, float)
        Turns about the axes across, up and towards the viewer.
    lit : bool
        Whether grey levels change as if by other light.
    mirror : bool

    Raises
    ------
    ConfigError
        With the reason.

    Examples
    --------
    >>> check_image("normals_view", (0, 0, 0), lit=False, mirror=True)
    Traceback (most recent call last):
    laserimg.errors.ConfigError: normals_view cannot be mirrored in grey: take a plane of it, normals_view.g
    """
    check_image_name(image)
    if lit:
        raise ConfigError(f"{image} is measured, not lit: no other contrast or brightness, no inversion")
    if max(map(abs, turn_deg)) > MAX_TURN_DEG:
        raise ConfigError(f"{image} is not what a scan shows when turned by more than {MAX_TURN_DEG} degrees")
    if mirror and image in _MIXED:
        raise ConfigError(f"{image} cannot be mirrored in grey: take a plane of it, {image}.g")


def mirrored(sample: Pixels, image: str) -> Pixels:
    """Return the image of the mirrored scan; a pixel without a return (0) stays one.

    Examples
    --------
    >>> mirrored(np.uint8([[0, 55, 200]]), "normals_view.g").tolist()
    [[55, 200, 0]]
    >>> mirrored(np.uint8([[0, 55, 200]]), "normals_view.r").tolist()
    [[200, 55, 0]]
    """
    flipped = sample[:, ::-1]
    return np.where(flipped > 0, 255 - flipped, flipped) if image in _SIDEWAYS else flipped


def with_noise(sample: Pixels, noise: NDArray[np.float64]) -> Pixels:
    """Return a sample with noise on the pixels that have a return; they keep one, at least grey level 1."""
    noisy = np.rint(sample + noise).clip(1, 255).astype(np.uint8)
    return np.where(sample > 0, noisy, sample)


def moved_with_gaps(linear: Pixels, nearest: Pixels, returns: Pixels) -> Pixels:
    """Return pixels between returns interpolated, those beside a gap taken from the nearest ray.

    Parameters
    ----------
    linear, nearest : (height, width) uint8
        The moved sample, interpolated and not.
    returns : (height, width) uint8
        What had a return as 255, what had none as 0, moved with interpolation.
    """
    return np.where(returns == 255, linear, nearest)
