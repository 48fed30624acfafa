"""Models of scanners: the grid of beams, their width, and how ranges and powers come out of them."""

from collections.abc import Mapping
from types import MappingProxyType

from laserimg.simulate.scanner.model import Scanner
from laserimg.simulate.scanner.sick import lms151_turn, lms200_tilt

__all__ = ["SCANNERS", "Scanner"]

SCANNERS: Mapping[str, Scanner] = MappingProxyType({s.name: s for s in (lms200_tilt(), lms151_turn())})
