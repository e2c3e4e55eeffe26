"""Numbers beside each other, as tables of Markdown."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Comparison:
    """One number: what it is, what it must be, what was found."""

    quantity: str
    wanted: float
    found: float

    @property
    def error(self) -> float:
        """Relative to what was wanted; absolute if that is zero."""
        return (self.found - self.wanted) / abs(self.wanted) if self.wanted else self.found


def comparisons(rows: Sequence[Comparison]) -> str:
    """A table of numbers with their errors."""
    return table(
        ("quantity", "must be", "found", "relative error"),
        [(row.quantity, f"{row.wanted:.10g}", f"{row.found:.10g}", f"{row.error:+.1e}")
         for row in rows])


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table of Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
