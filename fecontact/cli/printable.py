"""Text that is safe to print on a terminal."""


def printable(text: str) -> str:
    """Text with control characters shown escaped; they would steer the terminal."""
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
