"""The errors laserimg raises: low levels state the fact, the top adds file and step."""


class LaserImgError(Exception):
    """Anything wrong with what laserimg was given; the message says what to do next."""


class ScanError(LaserImgError):
    """The data cannot be a scan, or a file cannot be read as one."""


class ModelError(LaserImgError):
    """A cascade, a HOG model or a card cannot be used."""


class ConfigError(LaserImgError):
    """A rule file, a settings file or an option is wrong."""


class LabelError(LaserImgError):
    """A file of labels, candidates or detections is wrong."""


class MissingExtraError(LaserImgError):
    """An optional dependency is not installed.

    Examples
    --------
    >>> raise MissingExtraError("E57 files", "io")
    Traceback (most recent call last):
    laserimg.errors.MissingExtraError: E57 files need an extra: pip install "laserimg[io]"
    """

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(what, extra)  # as given: workers send errors home as their arguments

    def __str__(self) -> str:
        what, extra = self.args
        return f'{what} need an extra: pip install "laserimg[{extra}]"'
