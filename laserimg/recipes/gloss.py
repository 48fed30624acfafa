"""Objects of which surfaces that a beam glances off send nothing back, made from scans in which they do."""

import numpy as np
from numpy.typing import NDArray

from laserimg.evidence import Evidence, Window
from laserimg.recipes.shadows import without_returns

# A return is lost where its normal's part along the level line of sight is below a limit between these, one
# limit an object; of these returns this share.
LEAST_LIMIT, MOST_LIMIT, LOST = 0.1, 0.6, 0.9
# Paint of cars is smooth, ground is not: what is lower than this over the floor stays, in metres.
_GROUND_M = 0.25


def without_glancing(evidence: Evidence, box: NDArray, rng: np.random.Generator) -> Evidence:
    """Return a scan in which a glossy object lost returns at glancing incidence; as it is without a floor.

    Bonnets and roofs of real cars send nothing back to some scanners, and to others they do. Incidence is
    taken against the level line of sight, as beams in streets are nearly level: level surfaces go first,
    whatever the elevation they are seen at, then sides seen askew, and with them returns without a normal.

    Parameters
    ----------
    evidence : Evidence
    box : (4,) array
        ``x, y, w, h`` of the object.
    rng : numpy.random.Generator

    Returns
    -------
    Evidence
        With the images of the second stage alone.
    """
    limit = rng.uniform(LEAST_LIMIT, MOST_LIMIT)
    window = Window.of(tuple(box), evidence.scan.shape, evidence.scan.wraps)
    if evidence.floor is None:
        return evidence
    range_m = window.cut(evidence.scan.range)
    points = window.cut(evidence.scan.directions) * range_m[..., None]
    height = evidence.floor.height_of(points.reshape(-1, 3)).reshape(range_m.shape)
    along_sight = window.cut(evidence.images["normals_view"])[..., 0] / 127.5 - 1
    dark = (along_sight < limit) & (height > _GROUND_M) & (rng.uniform(size=along_sight.shape) < LOST)
    lost = np.zeros(evidence.scan.shape, np.bool_)
    lost[np.ix_(np.arange(window.rows.start, window.rows.stop), window.columns)] = dark
    return without_returns(evidence, lost)
