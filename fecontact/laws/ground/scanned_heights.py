"""Grids of heights from the files of profilometers and microscopes."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import require_regular_file
from fecontact.core.errors import InputError, ModelWarning
from fecontact.core.extras import optional
from fecontact.core.types import Array

# Bytes that tell a file of an instrument from a table of numbers: zeros, or the heads of SDF files
# and of texts of Wyko profilometers (NT series).
_HEAD, _TITLES = 4096, (b"aISO-", b"bISO-", b"Wyko ASCII Data File")
_MOST_MISSING = 0.5  # of the points

Grid = tuple[Array, float, float]  # heights (N, M) over x and y, NaN if missing, and distances [m]


def is_scan(file: str | Path) -> bool:
    """Whether a file holds binary data, or begins as SDF or Wyko files, not columns of numbers."""
    try:
        with Path(file).open("rb") as stream:
            head = stream.read(_HEAD)
    except (OSError, ValueError):
        return False
    return b"\0" in head or head.startswith(_TITLES)


def read_scan(owner: str, file: str | Path) -> Grid:
    """Heights (N, M) of a scan over x and y, and the distances of its points [m].

    Points that were not measured are filled: the discrete Laplace equation holds there, between the
    measured heights about them. A ModelWarning says how many.

    Raises
    ------
    InputError, MissingLibraryError
        For a file that is of no known format, a profile, a grid without a unit of length or with
        more missing points than measured ones, and without SurfaceTopography or x3pio
        (``pip install 'fecontact[topography]'``).
    """
    path = Path(file)
    where = f"{owner}: file = '{file}'"
    require_regular_file(path, "a scan", f"{owner}: ")
    try:
        heights, dx, dy = (_x3p if path.suffix.lower() == ".x3p" else _any_format)(path)
    except InputError as error:
        raise InputError(f"{where} {error}") from None
    known = np.isfinite(heights)
    missing = 1.0 - known.mean()
    if missing > _MOST_MISSING:
        raise InputError(f"{where} lacks {100.0 * missing:.3g} % of its {heights.size} heights; "
                         f"take a part of the scan, or fill them first.")
    if missing:
        warnings.warn(f"{where} lacks {int((~known).sum())} of {heights.size} heights, which are "
                      f"interpolated from those about them.", ModelWarning, stacklevel=2)
        heights = _filled(heights, known)
    return heights, dx, dy


def _x3p(path: Path) -> Grid:
    """A regular grid of ISO 25178-72."""
    x3pio = optional("x3pio", f"Reading {path.name}")
    try:
        found = x3pio.read(path)
    except Exception as error:
        raise InputError(f"is no X3P file that can be read: {_first_line(error)}.") from None
    if not isinstance(found, x3pio.Surface):
        raise InputError(f"is a {type(found).__name__.lower()}, not a grid of heights.")
    steps = [getattr(found.header, axis).increment for axis in "xy"]
    if not all(isinstance(step, float) and step > 0.0 for step in steps):
        raise InputError("has points at uneven distances; give an even grid.")
    return np.asarray(found.layers[0].z, dtype=float).T, *steps


def _any_format(path: Path) -> Grid:
    """The default channel of a file that SurfaceTopography knows."""
    with warnings.catch_warnings():
        # It says that it runs without MPI, and what headers of files lack.
        warnings.simplefilter("ignore")
        reading = optional("SurfaceTopography", f"Reading {path.name}")
        try:
            found = reading.read_topography(str(path))
        except Exception as error:
            kind = type(error).__name__
            raise InputError("is of no format that SurfaceTopography knows; give a table of x, y "
                             "and height, or export SDF or X3P." if "Detect" in kind else
                             f"cannot be read: {kind}: {_first_line(error)}.") from None
        if found.dim != 2:
            raise InputError("is a profile, not a grid of heights.")
        try:
            found = found.to_unit("m")
            heights: Array = np.ma.filled(np.ma.asarray(found.heights(), dtype=float), np.nan)
        except Exception as error:
            raise InputError(f"has no known unit of length ({_first_line(error)}); export it with "
                             f"one.") from None
        dx, dy = (float(one) for one in found.pixel_size)
    return heights, dx, dy


def _first_line(error: Any) -> str:
    return str(error).strip().partition("\n")[0].rstrip(".")[:200]


def _filled(heights: Array, known: Any) -> Array:
    """Heights in which missing ones are the means of their neighbours in the grid."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve

    n, m = heights.shape
    chains = [sp.diags_array([np.ones(k - 1), np.ones(k - 1)], offsets=[-1, 1]) for k in (n, m)]
    graph = sp.csr_array(sp.kron(chains[0], sp.eye_array(m)) + sp.kron(sp.eye_array(n), chains[1]))
    laplace = sp.csr_array(sp.diags_array(graph.sum(axis=1)) - graph)
    lost = np.flatnonzero(~known.ravel())
    given = np.where(known, heights, 0.0).ravel()
    found = given.copy()
    found[lost] = spsolve(sp.csc_array(laplace[lost][:, lost]), -(laplace[lost] @ given))
    return found.reshape(n, m)
