"""Estimates of memory, checked before large arrays are allocated."""

import os
import sys
from pathlib import Path

from fecontact.core.errors import InputError

_LEAST, _LEAST_STACK = 1.0e9, 1 << 20  # [bytes]
# Far less than libraries take [bytes]: not worth asking the system, some 0.1 ms.
_LITTLE = 1.0e7
_UNITS = ((1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"))


def available_memory() -> float:
    """Memory still available to this process [bytes]; infinite if unknown.

    The minimum of the free memory of the system, the limit of the container and the limit of the
    process (``ulimit -v``).
    """
    found = [_system(), _container(Path("/sys/fs/cgroup")), _own_limit()]
    return max(min(found), 0.0)


def require_memory(name: str, count: float, each: float, remedy: str = "") -> None:
    """Raise :class:`InputError` if ``count`` items do not fit into memory.

    Parameters
    ----------
    name : str
        The key, for the message.
    count : float
        Value of the count.
    each : float
        Memory per item [bytes].
    remedy : str
        Alternative to taking fewer, for the end of the message.
    """
    # Whole numbers may be larger than any other.
    count = min(count, sys.float_info.max)
    if count * each <= _LITTLE:
        return
    free = available_memory()
    if count * each <= free:
        return
    fits = int(float(f"{0.9 * free / each:.2g}"))
    raise InputError(f"{name} = {shown_count(count)} would need {shown_memory(count * each)} of "
                     f"memory, where {shown_memory(free)} are free; take at most "
                     f"{fits}{remedy}.")


def require_address_space() -> None:
    """Raise :class:`InputError` if this process may not take the memory that libraries need.

    They end it by a signal, or fail to load, where the limit of ``ulimit -v`` or that of its stack,
    ``ulimit -s``, is reached.
    """
    if (stack := _limit("RLIMIT_STACK")) < _LEAST_STACK:
        raise InputError(f"This process may have a stack of {shown_memory(stack)} only (ulimit "
                         f"-s), but libraries need {_LEAST_STACK // 1024} kB; raise the limit: "
                         f"ulimit -s {_LEAST_STACK // 1024}.")
    free = _own_limit()
    if free < _LEAST:
        raise InputError(f"This process may take {shown_memory(max(free, 0.0))} of memory only "
                         f"(ulimit -v), but libraries alone need {shown_memory(_LEAST)}; raise the "
                         f"limit.")


def shown_memory(size: float) -> str:
    """A size in bytes as text: ``1.6 GB``."""
    for unit, symbol in _UNITS:
        if size >= unit:
            return f"{size / unit:.3g} {symbol}"
    return f"{size / 1e3:.3g} kB"


def shown_count(count: float) -> str:
    """A count as text; very large ones in scientific notation."""
    return f"{count}" if abs(count) < 1e15 else f"{float(min(count, sys.float_info.max)):.3g}"


def _system() -> float:
    """Memory that the operating system can provide without swapping."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except (OSError, ValueError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")


def _container(folder: Path) -> float:
    """Memory left by the limit of control groups (version 2); file caches count as free."""
    try:
        limit = float((folder / "memory.max").read_text(encoding="ascii"))
        used = float((folder / "memory.current").read_text(encoding="ascii"))
        stat = dict(line.split() for line in
                    (folder / "memory.stat").read_text(encoding="ascii").splitlines())
        return limit - used + float(stat.get("file", 0.0))
    except (OSError, ValueError):  # "max" where there is no limit
        return float("inf")


def _own_limit() -> float:
    limit = _limit("RLIMIT_AS")
    if limit == float("inf"):
        return limit
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        return limit - pages * float(os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError):
        return float("inf")


def _limit(name: str) -> float:
    """A limit of this process [bytes]; infinite where there is none."""
    try:
        import resource
    except ImportError:
        return float("inf")
    found = resource.getrlimit(getattr(resource, name))[0]
    return float("inf") if found == resource.RLIM_INFINITY else float(found)
