"""What formats call the reflectance and the beam of a point."""

from collections.abc import Iterable

_INTENSITY = ("reflectance", "reflectivity", "intensity", "remission", "intensities", "i")
_RING = ("ring", "channel", "laser_id", "line")


def intensity_field(names: Iterable[str]) -> str | None:
    """Return the name of the field with the reflectance, or None.

    Examples
    --------
    >>> intensity_field(["x", "y", "z", "Intensity"])
    'Intensity'
    """
    return _first_of(_INTENSITY, names)


def ring_field(names: Iterable[str]) -> str | None:
    """Return the name of the field with the number of the beam, or None."""
    return _first_of(_RING, names)


def _first_of(known: tuple[str, ...], names: Iterable[str]) -> str | None:
    by_lower = {name.lower(): name for name in names}
    return next((by_lower[name] for name in known if name in by_lower), None)
