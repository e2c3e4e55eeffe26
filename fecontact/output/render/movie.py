"""Movies of a run as MP4 or numbered PNG files, and stills."""

import glob
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.sampling import between_outputs
from fecontact.core.checks import as_path, require_frame_rate
from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import beside, put, replaced, unwritable
from fecontact.core.progress import counting_bar, held_back_interrupt, shown
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.wear import WearLaw
from fecontact.output.files.frames import frame_indices, require_drawable, require_field
from fecontact.output.render.encoder import encoder
from fecontact.output.render.frames_data import Colour, Motion, View
from fecontact.output.render.offscreen import require_rendering
from fecontact.output.render.overlay import Image, Overlay
from fecontact.output.render.run_overlay import RunOverlay
from fecontact.output.render.scene import Shown
from fecontact.output.render.scenes import scene_of

Progress = Callable[[int, int], None]

_SMALLEST = (320, 180)
MOVING, _STILL = 2, 4  # pixels rendered for each of a movie and of a still, in both directions
# Header text that marks a picture as one of this package.
_SOFTWARE = ("Software", "fecontact")
_OURS = "\0".join(_SOFTWARE).encode()
_STILL_FRAMES = 200  # frames that set the range of colours and motion of a still


def render(
    trajectory: Trajectory,
    path: str | Path,
    *,
    frames: int = 200,
    fps: float = 25,
    size: tuple[int, int] = (960, 540),
    colour: Colour = "displacement",
    scale: float | None = None,
    title: str | None = None,
    t_start: float | None = None,
    t_end: float | None = None,
    view: View = "above",
    wear: WearLaw | None = None,
    progress: bool | Progress | None = None,
) -> Path:
    """Draw a run as a movie or as numbered pictures, whole or not at all.

    It shows the deformed body over its undeformed outline, the ground, the contact nodes coloured
    by state, contact forces as arrows, and above flat bodies the total forces over time. Beside
    solids are maps of their contact faces and the forces; see docs/analysis.md.

    Parameters
    ----------
    trajectory : Trajectory
        The run; its modal basis must hold mode shapes of the body.
    path : str or Path
        ``NAME.mp4`` for a movie, ``NAME.png`` for ``NAME_0000.png`` and so on, or a folder for
        ``frame_0000.png`` and so on. Earlier files of these names are replaced, and further
        pictures of an earlier series removed.
    frames, fps : int, float
        Number of even frames, between outputs where these are too sparse; frames per second.
    size : (int, int)
        Width and height in pixels, even, at least 320 x 180.
    colour : "displacement" or "von_mises"
        Magnitude of the displacement [m], or von Mises stress [Pa].
    scale : float, optional
        Factor of the displacements; by default a round one that makes the largest visible.
    title : str, optional
        Shown at the top.
    t_start, t_end : float, optional
        Part of the run to draw [s].
    view, wear : "above" or "below"; EnergyWear or ArchardWear, optional
        View of solids; law of wear, which adds maps of the depth worn since the start.
    progress : bool or callable, optional
        True for a progress bar; a function is called as ``progress(done, total)`` after each frame.

    Returns
    -------
    Path
        The movie, the folder, or the first picture.

    Raises
    ------
    InputError
        For values outside these ranges, a basis without shapes, or a path that cannot be written.
    MissingLibraryError
        If this computer cannot render pictures or encode movies; the message says what to install.
    """
    path, movie = target(path, fps, size)
    require_field(trajectory)
    if wear is None:  # whose depth counts from the start of the run
        trajectory, indices = frames_of(trajectory, frames, t_start, t_end)
    else:
        indices = frame_indices(trajectory.time, frames, t_start, t_end)
    if not len(indices):
        raise InputError("frames = 0 makes no movie; give at least 1.")
    require_drawable(trajectory, indices)
    motion = Motion(trajectory, indices, colour, scale, view, wear)
    lasting = float(motion.times[-1] - motion.times[0])
    slowness = (len(indices) - 1) / fps / lasting if movie and lasting > 0.0 else None
    require_rendering(size, MOVING)
    images = images_of(motion, RunOverlay(motion, *size, title, slowness), range(len(indices)))
    return write_images(images, len(indices), path, fps, size, progress)


def frames_of(
    trajectory: Trajectory, frames: int, t_start: float | None = None, t_end: float | None = None
) -> tuple[Trajectory, NDArray[np.intp]]:
    """The run whose times are drawn, and the indices of these times.

    The run itself, unless its outputs are fewer than the frames and too far apart for the motion:
    then its part from ``t_start`` to ``t_end`` with times between the outputs.
    """
    indices = frame_indices(trajectory.time, frames, t_start, t_end)
    if not 1 < len(indices) < frames:
        return trajectory, indices
    part = trajectory.between(float(trajectory.time[indices[0]]),
                              float(trajectory.time[indices[-1]]))
    finer = between_outputs(part, frames)
    return (trajectory, indices) if finer is part else (finer, frame_indices(finer.time, frames))


def target(path: str | Path, fps: float, size: tuple[int, int]) -> tuple[Path, bool]:
    """Path to draw to, and a flag: True for a movie.

    Raises
    ------
    InputError
        For another ending, and for a frame rate or a size out of range.
    """
    path = as_path(path, "a movie")
    if path.suffix.lower() not in (".mp4", ".png", "") and not path.is_dir():
        raise InputError(f"{path} must end in .mp4 for a movie or .png for pictures, or be a "
                         f"folder.")
    if path.name.lower() in (".mp4", ".png"):
        raise InputError(f"{path} has no name before its ending; give one, such as run{path.name}.")
    require_frame_rate("A movie", fps)
    _require_size(size)
    return path, path.suffix.lower() == ".mp4"


def write_images(
    images: Iterable[Image], count: int, path: Path, fps: float, size: tuple[int, int],
    progress: bool | Progress | None,
) -> Path:
    """Write pictures as a movie or as numbered files, whole or not at all; the first path."""
    movie = path.suffix.lower() == ".mp4"
    with (held_back_interrupt() as check,
          shown(progress, lambda: counting_bar("Drawing")) as tell,
          _movie_file(path, size, fps) if movie else _numbered_files(path) as take):
        for done, image in enumerate(images, start=1):
            check()
            take(image)
            if tell is not None:
                tell(done, count)
    if movie or path.suffix.lower() != ".png" or path.is_dir():
        return path
    return path.with_name(f"{path.stem}_0000.png")


def picture(
    trajectory: Trajectory,
    path: str | Path,
    *,
    time: float | None = None,
    size: tuple[int, int] = (960, 540),
    colour: Colour = "displacement",
    scale: float | None = None,
    title: str | None = None,
    view: View = "above",
    wear: WearLaw | None = None,
) -> Path:
    """Draw a run at one time, as a frame of :func:`render` over the whole run.

    Parameters
    ----------
    trajectory : Trajectory
        Run whose modal basis holds shapes over the body.
    path : str or Path
        ``NAME.png``.
    time : float, optional
        The nearest output time is drawn; the last by default [s].
    size, colour, scale, title, view, wear
        See :func:`render`.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    InputError, MissingLibraryError
        See :func:`render`.
    """
    path = as_path(path, "a picture")
    if path.suffix.lower() != ".png":
        raise InputError(f"{path} must end in .png.")
    _require_folder(path)
    _require_size(size)
    require_field(trajectory)
    at = len(trajectory.time) - 1 if time is None else int(np.argmin(np.abs(trajectory.time
                                                                            - time)))
    chosen = frame_indices(trajectory.time, _STILL_FRAMES)
    chosen = np.union1d(chosen, [at])
    require_drawable(trajectory, chosen)
    motion = Motion(trajectory, chosen, colour, scale, view, wear)
    require_rendering(size, _STILL)
    frame = int(np.searchsorted(chosen, at))
    (image,) = images_of(motion, RunOverlay(motion, *size, title), [frame], _STILL)
    with replaced(path) as part:
        _save(part, image)
    return path


def images_of(
    motion: Shown, overlay: Overlay, frames: Iterable[int], fineness: int = MOVING
) -> Iterator[Image]:
    """Pictures (height, width, 3) of some frames of a motion."""
    with scene_of(motion, overlay.scene_width, overlay.scene_height,
                  line=1.2 * overlay.size, fineness=fineness) as scene:
        for frame in frames:
            yield overlay.around(scene.image(frame), frame)


@contextmanager
def _movie_file(path: Path, size: tuple[int, int], fps: float) -> Iterator[Callable[[Image], Any]]:
    """A function that adds a frame to a movie; the file is written unless the block fails."""
    _require_folder(path)
    with replaced(path) as part, encoder(part, size, fps) as take:
        yield take


@contextmanager
def _numbered_files(path: Path) -> Iterator[Callable[[Image], Any]]:
    """A function that adds a numbered picture; all appear when the block ends well.

    Pictures of an earlier movie that had more of them are removed, others of such names are not.
    """
    folder, stem = (path, "frame") if path.is_dir() or not path.suffix else (path.parent, path.stem)
    names: list[str] = []

    try:
        with beside(path / stem if path.is_dir() else path) as part:
            def take(image: Image) -> None:
                names.append(f"{stem}_{len(names):04d}.png")
                _save(part / names[-1], image)

            yield take
            folder.mkdir(exist_ok=True)
            for name in names:
                put(part / name, folder / name)
        for old in folder.glob(f"{glob.escape(stem)}_*.png"):
            if re.fullmatch(re.escape(stem) + r"_\d{4,}\.png", old.name) and (
                    old.name not in names and _is_ours(old)):
                old.unlink()
    except OSError as error:
        raise InputError(unwritable(folder, error)) from None


def _is_ours(picture: Path) -> bool:
    """True if a picture was drawn by this package."""
    with picture.open("rb") as file:
        return _OURS in file.read(1000)


def _save(path: Path, image: Image) -> None:
    from matplotlib.image import imsave

    imsave(path, image, format="png", metadata=dict([_SOFTWARE]))


def _require_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: folder {path.parent} does not exist.")


def _require_size(size: tuple[int, int]) -> None:
    if len(size) != 2 or any(not isinstance(side, int) or side % 2 or side < least
                             for side, least in zip(size, _SMALLEST, strict=False)):
        raise InputError(f"size = {size!r} must be an even width and height in pixels, at least "
                         f"{_SMALLEST[0]} x {_SMALLEST[1]}.")
