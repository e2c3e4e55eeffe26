"""How threads wait for each other: functions of the operating system, by their addresses."""

import ctypes
import sys
from functools import cache

# Shortest useful sleep [us]; Windows counts milliseconds.
_PAUSE = 50


@cache
def how_to_wait() -> tuple[int, int, int]:
    """Addresses of what lets other threads go first and of what sleeps, and how long to sleep.

    In microseconds; on Windows in milliseconds.
    """
    if sys.platform == "win32":
        system = ctypes.WinDLL("kernel32")
        return _address(system.SwitchToThread), _address(system.Sleep), 1
    system = ctypes.CDLL(None)
    return _address(system.sched_yield), _address(system.usleep), _PAUSE


def _address(function: object) -> int:
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)  # type: ignore[arg-type]
