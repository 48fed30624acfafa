"""Options that only the settings can judge are wrong usage: exit 2, with the line on usage."""

from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from laserimg.settings import Settings


def settings_of(**options: Any) -> "Settings":
    """Return the settings of a run; a wrong choice ends it as wrong usage."""
    from laserimg.errors import ConfigError
    from laserimg.settings import Settings

    try:
        return Settings(**options)
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
