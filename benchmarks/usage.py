"""The command line of a script: its description on request, and no option that it does not know."""

import re
import sys


def explain(description: str | None) -> None:
    """End with the description of a script if it is asked for, or if an option is not in it."""
    words = sys.argv[1:]
    text = (description or "").strip()
    if "-h" in words or "--help" in words:
        print(text)
        raise SystemExit(0)
    known = set(re.findall(r"(?<![\w-])--[a-z-]+", text))
    for word in words:
        if word.startswith("-") and word not in known:
            raise SystemExit(f"{word} is no option of {sys.argv[0]}; it has "
                             f"{', '.join(sorted(known)) or 'none'}.")
