"""Comments at the end of a stored study, which say what its keys and files were."""

import json
from collections.abc import Mapping
from typing import Any

# Comments at the end of a study with every key, each followed by JSON: hashes of the files that it
# names, by names relative to its folder, and the keys that its file gives.
FILES, KEYS_GIVEN = "# Content of files: ", "# Keys given: "


def comment(text: str, begin: str, default: Mapping[str, Any]) -> Mapping[str, Any]:
    """Content of one of the comments at the end of a study; the default without a sound one."""
    found = [line for line in text.rstrip().rsplit("\n", 2)[1:] if line.startswith(begin)]
    try:
        content = json.loads(found[-1].removeprefix(begin)) if found else default
    except (ValueError, RecursionError):  # a comment that somebody edited
        return default
    return content if isinstance(content, Mapping) else default


def stored_hashes(text: str | None) -> Mapping[str, str]:
    """Hashes of the files that a stored study names, by names relative to its folder."""
    return comment(text or "", FILES, {})
