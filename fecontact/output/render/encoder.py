"""Encoding of movies: frames go to ffmpeg, the program, through a pipe."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import MissingLibraryError
from fecontact.core.extras import optional


@cache
def ffmpeg() -> str:
    """The program: the system's if it encodes H.264, else that of imageio-ffmpeg.

    Raises
    ------
    MissingLibraryError
        If there is neither.
    """
    found = shutil.which("ffmpeg")
    if found is not None:
        listed = subprocess.run([found, "-hide_banner", "-encoders"], capture_output=True,
                                text=True, check=False, stdin=subprocess.DEVNULL)
        if "libx264" in listed.stdout:
            return found
    try:
        return str(optional("imageio_ffmpeg", "A movie").get_ffmpeg_exe())
    except RuntimeError as error:
        raise MissingLibraryError(f"There is no ffmpeg to encode movies with ({error}); reinstall "
                                  f"imageio-ffmpeg, or write .png pictures.") from None


@contextmanager
def encoder(
    path: Path, size: tuple[int, int], fps: float,
) -> Iterator[Callable[[NDArray[np.uint8]], Any]]:
    """A function that adds a frame (height, width, 3) to a movie of even width and height.

    Raises
    ------
    MissingLibraryError
        If there is no ffmpeg.
    OSError
        If the movie is not written whole.
    """
    process = subprocess.Popen(
        # ffmpeg takes names with colons for protocols, and leading hyphens for options.
        [ffmpeg(), "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
         "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:.12g}", "-i", "-", "-c:v", "libx264",
         "-crf", "15", "-pix_fmt", "yuv420p", "-movflags", "+faststart", os.path.abspath(path)],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        # Ctrl+C is for this process, which decides what becomes of the movie.
        process_group=0, creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0))
    frames = process.stdin
    assert frames is not None
    try:
        yield lambda image: frames.write(np.ascontiguousarray(image).data)
        frames.close()
        if process.wait() != 0:
            raise BrokenPipeError
    except BrokenPipeError:
        raise OSError("the encoder did not finish; the disk may be full") from None
    finally:
        process.kill()
        process.wait()
        with suppress(OSError):
            frames.close()
