"""Temperatures at nodes of Abaqus and CalculiX decks: initial ones, and those of the last step."""

from collections.abc import Sequence

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.types import Array
from fecontact.fem.mesh_files.abaqus_constraints import Block, Names, number_of, words_of
from fecontact.fem.mesh_files.abaqus_keywords import Options

# Options of *TEMPERATURE that take values from results or vary them in time.
_REFUSED = ("FILE", "AMPLITUDE", "USER", "BSTEP", "FIELD")


def is_temperature(keyword: str, options: Options) -> bool:
    """True for *TEMPERATURE, and *INITIAL CONDITIONS of temperatures."""
    return keyword == "TEMPERATURE" or (
        keyword == "INITIAL CONDITIONS" and options.get("TYPE", "").upper() == "TEMPERATURE")


def temperature_of(blocks: Sequence[Block], names: Names) -> tuple[Array | None, str]:
    """Change of temperature (N,) of all nodes of a deck, and what is not read.

    From the initial temperatures, zero where they are not given, to those that the steps leave, by
    default the initial ones. Values of a step stay unless ``OP=NEW`` removes them.

    Raises
    ------
    MeshError
        For unknown nodes and sets, and data that are no numbers.
    """
    if not blocks:
        return None, ""
    first, last = np.zeros(len(names.places)), np.full(len(names.places), np.nan)
    for keyword, options, lines in blocks:
        if given := [option for option in _REFUSED if option in options]:
            return None, f"*{keyword} with {given[0]}"
        if keyword == "TEMPERATURE" and options.get("OP", "").upper() == "NEW":
            last[:] = np.nan
        values = last if keyword == "TEMPERATURE" else first
        for line in lines:
            words, where = words_of(line), f"*{keyword}"
            if len(words) < 2:
                raise MeshError(f"{where} has the line '{line}'; give a node or set and its "
                                f"temperature.")
            values[names.of(words[0], where)] = number_of(words[1], where)
    return np.where(np.isnan(last), 0.0, last - first), ""
