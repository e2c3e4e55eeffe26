"""Pictures small enough for a repository."""

import os
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image

LARGEST = 100_000  # bytes


def save(figure: Any, path: Path, dpi: int = 90) -> None:
    """Write a figure as PNG of few colours, below 100 kB, whole or not at all."""
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi)
    for colours in (128, 64, 32, 16):
        small = BytesIO()
        Image.open(drawn).convert("RGB").quantize(colours, dither=Image.Dither.NONE).save(
            small, format="png", optimize=True)
        if len(small.getvalue()) < LARGEST:
            break
    else:
        raise ValueError(f"{path.name} has {len(small.getvalue())} bytes, more than {LARGEST}.")
    part = path.with_name(path.name + ".part")
    part.write_bytes(small.getvalue())
    os.replace(part, path)
