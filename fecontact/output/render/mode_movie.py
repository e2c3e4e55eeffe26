"""Movies of modes, real and complex: the body over whole periods of free vibration."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_count, require_kind, require_scale
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ComplexArray
from fecontact.output.files.frames import shapes_of
from fecontact.output.render.frames_data import body_labels
from fecontact.output.render.movie import MOVING, Progress, images_of, target, write_images
from fecontact.output.render.offscreen import require_rendering
from fecontact.output.render.overlay import Overlay
from fecontact.output.render.scene import COLOUR_MAPS
from fecontact.reduction.assembly.contact_faces import mode_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes
from fecontact.system.complex_modes import ComplexModes

_VISIBLE = 0.08  # largest motion drawn, as a part of the body's extent
# Phases at which the largest of a motion with several harmonics is looked for.
_LOOKS = 65


@dataclass(frozen=True, eq=False)
class ModeMotion:
    """Periodic motion prepared for drawing: ``Re sum_h shapes_h exp(i h phase)`` at some phases.

    Attributes
    ----------
    mode_shapes : ModeShapes
    shapes : mapping of h to (N, d) complex array
        Displacements of the nodes; their size does not matter. A mode has h = 1 alone.
    phases : (F,) array
        [rad], over whole periods.
    extent : float
        Largest motion drawn, as a part of the body's extent.
    """

    mode_shapes: ModeShapes
    shapes: Mapping[int, ComplexArray]
    phases: Array
    extent: float = _VISIBLE
    colour: str = "displacement"
    largest_colour: float = 1.0
    labels: tuple[tuple[str, int], ...] = ()

    @cached_property
    def _largest(self) -> tuple[float, Array]:
        """Largest displacement within the period, and that of each node along each axis (N, d)."""
        if set(self.shapes) == {1}:
            # The displacement of a node runs on an ellipse; this is its longer half-axis.
            shape = self.shapes[1]
            power = sum(np.abs(part) ** 2 for part in shape.T)
            longest = np.sqrt(0.5 * (power + np.abs(sum(part**2 for part in shape.T)))).max()
            return float(longest) or 1.0, np.abs(shape)
        moved = [self._moved(phase) for phase in np.linspace(0.0, 2.0 * np.pi, _LOOKS).tolist()]
        longest = max(float(np.linalg.norm(one, axis=1).max()) for one in moved)
        return longest or 1.0, np.max(np.abs(moved), axis=0)

    def _moved(self, phase: float) -> Array:
        """Displacements (N, d) at a phase [rad]."""
        total = sum(shape * np.exp(1j * h * phase) for h, shape in self.shapes.items())
        return np.asarray(np.real(total))

    @property
    def _reach(self) -> float:
        """Largest motion drawn [m]."""
        return self.extent * float(np.linalg.norm(np.ptp(self.mode_shapes.nodes, axis=0)))

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest coordinates (2, d) that the drawn body reaches [m]."""
        longest, each = self._largest
        moved = self._reach * each / longest
        return np.stack([(self.mode_shapes.nodes - moved).min(axis=0),
                         (self.mode_shapes.nodes + moved).max(axis=0)])

    def body(self, frame: int) -> tuple[Array, Array]:
        """Drawn positions (N, d) [m] and displacements (N,) relative to the largest."""
        moved = self._moved(float(self.phases[frame])) / self._largest[0]
        return self.mode_shapes.nodes + self._reach * moved, np.linalg.norm(moved, axis=1)


def render_mode(
    basis: ModalBasis,
    path: str | Path,
    mode: int = 0,
    *,
    modes: ComplexModes | None = None,
    frames: int = 50,
    periods: int = 2,
    fps: float = 25,
    size: tuple[int, int] = (960, 540),
    scale: float = 1.0,
    title: str | None = None,
    progress: bool | Progress | None = None,
) -> Path:
    """Draw a mode as a movie or as numbered pictures, whole or not at all.

    It shows ``Re(shape exp(i phase))`` over whole periods without growth or decay. Modes of the
    basis are real and stand; complex modes have points that do not move in phase, so that waves
    travel along the body.

    Parameters
    ----------
    basis : ModalBasis
        Modal basis with shapes over the body.
    path : str or Path
        See :func:`fecontact.render`.
    mode : int
        Number of the mode, from 0.
    modes : ComplexModes, optional
        The mode is one of these, such as :func:`fecontact.analysis.complex_modes` finds them or
        the ``modes`` of an equilibrium; by default one of the basis.
    frames : int
        Frames in each period, at least 2.
    periods : int
        Number of periods, at least 1.
    fps : float
        Frames per second of the movie.
    size : (int, int)
        Width and height in pixels, even, at least 320 x 180.
    scale : float
        Factor of the drawn motion; one makes the largest 8 % of the body's extent.
    title : str, optional
        Title; by default number, frequency and damping ratio of the mode.
    progress : bool or callable, optional
        See :func:`fecontact.render`.

    Returns the movie, the folder, or the first picture.

    Raises
    ------
    InputError, MissingLibraryError
        For a number out of range, a basis without shapes, and as :func:`fecontact.render`.
    """
    require_kind("render_mode", ModalBasis, basis=basis)
    require_kind("render_mode", (ComplexModes, type(None)), modes=modes)
    field, (q, words) = shapes_of(basis, "These modes"), _chosen(basis, modes, mode)
    return write_motion(ModeMotion(field, {1: field.shapes @ q}, np.zeros(0),
                                   labels=body_labels(basis)),
                        path, words if title is None else title, frames=frames, periods=periods,
                        fps=fps, size=size, scale=scale, progress=progress)


def write_motion(
    motion: ModeMotion, path: str | Path, title: str, *, frames: int, periods: int, fps: float,
    size: tuple[int, int], scale: float, progress: bool | Progress | None,
) -> Path:
    """Write a periodic motion, whose phases are set here; arguments as of :func:`render_mode`."""
    path, movie = target(path, fps, size)
    frames, periods = as_count(frames, "frames", 2), as_count(periods, "periods")
    require_scale("The mode", scale)
    # Numbered pictures of one period suffice for any number of them.
    count = frames * (periods if movie else 1)
    motion = replace(motion, phases=2.0 * np.pi * np.arange(count) / frames,
                     extent=_VISIBLE * scale)
    require_rendering(size, MOVING)
    images = images_of(motion, _mode_overlay(motion, size, title), range(count))
    return write_images(images, count, path, fps, size, progress)


def _mode_overlay(motion: ModeMotion, size: tuple[int, int], title: str) -> Overlay:
    """Title above the scene, colours and phase below."""
    overlay = Overlay(*size, title)
    overlay.colour_scale("displacement, relative to the largest", 1.0,
                         COLOUR_MAPS["displacement"])
    words = overlay.text(overlay.footer, 0.97, 0.5, "", ha="right")
    degrees = np.degrees(motion.phases) % 360.0
    overlay.changing(lambda frame: words.set_text(f"phase {degrees[frame]:3.0f}°"), words)
    return overlay


def _chosen(
    basis: ModalBasis, modes: ComplexModes | None, mode: int
) -> tuple[NDArray[np.complex128], str]:
    """Modal coordinates (m,) of a mode, and its description."""
    count = basis.modes if modes is None else len(modes.eigenvalues)
    if isinstance(mode, bool) or not isinstance(mode, int | np.integer) or not 0 <= mode < count:
        raise InputError(f"mode = {mode!r} must be the number of one of {count} modes, from 0.")
    if modes is None:
        hertz = basis.frequencies_hz[mode]
        words = "rigid" if hertz == 0.0 else f"{hertz:.5g} Hz"
        name = mode_names(basis)[mode]
        return (np.eye(basis.modes, dtype=complex)[mode],
                f"{name}{', ' if basis.parts else ': '}{words}")
    if len(modes.right) < 2 * basis.modes:
        raise InputError(f"The complex modes have {len(modes.right)} states, but the basis has "
                         f"{basis.modes} modes; take the basis that they belong to.")
    ratio = modes.damping_ratios[mode]
    return (np.asarray(modes.right[: basis.modes, mode]),
            f"mode {mode}: {modes.frequencies_hz[mode]:.5g} Hz, damping ratio {ratio:.2%}"
            f"{', grows' if modes.grows[mode] else ''}")
