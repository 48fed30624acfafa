"""The command line: one file a verb; the only place that prints and exits."""

import sys

from laserimg.errors import LaserImgError


def main() -> None:
    """Run the command line; exit 0 done, 1 some input failed, 2 wrong usage."""
    from laserimg.cli.app import app

    try:
        app()
    except LaserImgError as error:
        print(f"laserimg: {error}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        # A rule file that is missing, a folder that cannot be written, a full disk.
        where = f"{error.filename}: " if error.filename else ""
        print(f"laserimg: {where}{error.strerror or error}", file=sys.stderr)
        sys.exit(1)
