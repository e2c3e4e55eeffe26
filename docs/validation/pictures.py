"""Pictures small enough for a repository."""

import os
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image

LARGEST = 100_000  # bytes


def save(figure: Any, path: Path, dpi: int = 90) -> None:
    """Write a figure as PNG of few colours, below 100 kB."""
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi)
    shrink(drawn, path)


def shrink(drawn: BytesIO | Path, path: Path, largest: int = LARGEST,
           colours: tuple[int | None, ...] = (128, 64, 32, 16)) -> None:
    """Write a picture as PNG of fewer bytes, whole or not at all.

    It gets the first of these numbers of colours that is small enough; None keeps all of them.
    """
    for count in colours:
        small, image = BytesIO(), Image.open(drawn).convert("RGB")
        if count is not None:
            image = image.quantize(count, dither=Image.Dither.NONE)
        image.save(small, format="png", optimize=True)
        if len(small.getvalue()) < largest:
            break
    else:
        raise ValueError(f"{path.name} has {len(small.getvalue())} bytes, more than {largest}.")
    part = path.with_name(path.name + ".part")
    part.write_bytes(small.getvalue())
    os.replace(part, path)
