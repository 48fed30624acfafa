"""The command line, called as the installed script calls it, without a new process."""

import contextlib
import io
import sys
from pathlib import Path
from typing import NamedTuple
from unittest import mock

from laserimg.cli import main


class Done(NamedTuple):
    code: int
    out: str
    err: str


def laserimg(*arguments: str | Path, folder: Path | None = None) -> Done:
    """Run one command in a folder; its exit code and what it printed."""
    out, err = io.StringIO(), io.StringIO()
    argv = ["laserimg", *map(str, arguments)]
    code = 0
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        contextlib.chdir(folder or Path.cwd()),
        mock.patch.object(sys, "argv", argv),
    ):
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return Done(code, out.getvalue(), err.getvalue())
