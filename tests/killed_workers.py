"""What tests of workers give them to do: at the top of a module that workers can import."""

import os
import signal
import time


def square_or_die(number: int) -> int:
    """Return the square; 13 kills the process that works on it."""
    if number == 13:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def process_number(_: int) -> int:
    """Return which process works."""
    return os.getpid()


def slow_first(number: int) -> int:
    """Return ten times the number; the first is finished last."""
    time.sleep(0.3 if number == 0 else 0.0)
    return 10 * number
