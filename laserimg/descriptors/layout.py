"""How a descriptor divides an image into cells and blocks, and directions into bins."""

from dataclasses import dataclass, fields

from laserimg.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Layout:
    """Cells, blocks and bins; the defaults are those of paper 1, section 4.

    Parameters
    ----------
    cells : int
        k of N_c = k x k cells, whatever the size of the image.
    block : int
        q of S_b = q x q cells, normalised together; blocks overlap, one cell apart.
    n_alpha : int
        Bins of the direction of a gradient in the image, over 0 to 180 degrees.
    n_theta : int
        Bins of the angle between a normal and the line of sight, over 0 to 90 degrees.
    n_phi : int
        Bins of a normal's direction in the image.
    signed : bool
        `n_phi` bins over 0 to 360 degrees (atan2), else over 0 to 180, to which the quotient in
        eq. 3 of the paper folds.

    Raises
    ------
    ConfigError
        If a count is below 1, or a block has more cells than the image.

    Examples
    --------
    >>> layout = Layout()
    >>> layout.hog_length, layout.honv_length, layout.hog3d_length
    (3528, 15876, 15876)
    """

    cells: int = 8
    block: int = 2
    n_alpha: int = 18
    n_theta: int = 9
    n_phi: int = 9
    signed: bool = True

    def __post_init__(self) -> None:
        for field in fields(self)[:5]:
            if getattr(self, field.name) < 1:
                raise ConfigError(f"{field.name} must be at least 1, got {getattr(self, field.name)}")
        if self.block > self.cells:
            raise ConfigError(f"a block of {self.block} cells does not fit {self.cells} cells")

    @property
    def phi_range_deg(self) -> float:
        """Directions that the bins of phi cover."""
        return 360.0 if self.signed else 180.0

    @property
    def hog_length(self) -> int:
        """Values of a HOG."""
        return self._places * self.n_alpha

    @property
    def honv_length(self) -> int:
        """Values of a HONV."""
        return self._places * self.n_theta * self.n_phi

    @property
    def hog3d_length(self) -> int:
        """Values of a 3DHOG: its directions have as many bins as normals have."""
        return self.honv_length

    @property
    def _places(self) -> int:
        return (self.cells - self.block + 1) ** 2 * self.block**2
