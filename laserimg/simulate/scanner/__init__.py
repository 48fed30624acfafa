"""Models of scanners: the grid of beams, their width, and how ranges and powers come out of them."""

from collections.abc import Mapping
from types import MappingProxyType

from laserimg.simulate.scanner.model import Scanner
from laserimg.simulate.scanner.sick import lms151_turn, lms200_swing, lms200_tilt, lms200_tilt_cm, lms200_turn
from laserimg.simulate.scanner.spinning import spinning32, spinning40, spinning64, spinning128
from laserimg.simulate.scanner.terrestrial import terrestrial

__all__ = ["SCANNERS", "Scanner"]

_SICK = (lms200_tilt(), lms200_tilt_cm(), lms200_swing(), lms200_turn(), lms151_turn())
_ALL = (*_SICK, spinning32(), spinning40(), spinning64(), spinning128(), terrestrial())
SCANNERS: Mapping[str, Scanner] = MappingProxyType({scanner.name: scanner for scanner in _ALL})
