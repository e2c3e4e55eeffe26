"""The one of several matrices of a file that is asked for."""

from collections.abc import Collection

from fecontact.core.errors import InputError, choices, nearest


def chosen_name(
    names: Collection[str], name: str | None, likely: Collection[str] | None = None
) -> str:
    """The name that is asked for, or the only one of those that are ``likely``, by default all.

    Raises
    ------
    InputError
        For an unknown name, or no name where the file holds several matrices or none.
    """
    known = names if likely is None or name is not None else likely
    if name is None and len(known) != 1:
        raise InputError(f"Say which matrix to read by its name; the file holds: "
                         f"{choices(filter(None, known))}.")
    chosen = next(iter(known)) if name is None else name
    if chosen not in known:
        raise InputError(f"There is no matrix '{name}'{nearest(chosen, known)}; the file holds: "
                         f"{choices(filter(None, known))}.")
    return chosen
