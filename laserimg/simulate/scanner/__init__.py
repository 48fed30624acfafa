"""Models of scanners: the grid of beams, their width, and how ranges and powers come out of them."""

from collections.abc import Mapping
from types import MappingProxyType

from laserimg.simulate.scanner.model import Scanner
from laserimg.simulate.scanner.sick import lms151_turn, lms200_swing, lms200_tilt, lms200_turn
from laserimg.simulate.scanner.spinning import spinning64, spinning128
from laserimg.simulate.scanner.terrestrial import terrestrial

__all__ = ["SCANNERS", "Scanner"]

_TURNING = (lms200_turn(), lms151_turn(), spinning64(), spinning128(), terrestrial())
_ALL = (lms200_tilt(), lms200_swing(), *_TURNING)
SCANNERS: Mapping[str, Scanner] = MappingProxyType({scanner.name: scanner for scanner in _ALL})
