"""Resonances and forced responses from a single nonlinear mode."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.harmonic.forced_starts import given_force, require_excitation, rest_state
from fecontact.bifurcation.harmonic.response import levels_of
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode, with_point
from fecontact.core.checks import require_kind
from fecontact.core.errors import FecontactError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, listed, quantity, span
from fecontact.system.contact_system import ContactSystem

# Places between two points of a mode at which the response is evaluated.
_BETWEEN = 8
# Relative distance of amplitudes within which a resonance needs a point of the mode, and how often
# such points are added.
_NEAR, _ROUNDS = 1e-3, 4


@dataclass(frozen=True)
class Resonance:
    """Resonance: the work of a force balances the energy that a nonlinear mode loses.

    Attributes
    ----------
    amplitude : float
        Half the range of the observed displacement [m].
    frequency_hz : float
        Frequency of the mode at the resonance [Hz].
    damping_ratio : float
        Damping ratio of the mode at the resonance.
    solved : bool
        Whether the mode is solved within 1e-3 of this amplitude; where that cannot be done, the
        resonance is interpolated between points of the mode.
    """

    amplitude: float
    frequency_hz: float
    damping_ratio: float
    solved: bool = True


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ModeResponse(Summarised):
    """Forced responses near the resonance of one nonlinear mode.

    Attributes
    ----------
    mode : NonlinearMode
    level_name : str or None
        Name of the parameter that differs between levels.
    levels : (k,) array
        Its values; one that is not a number without such a parameter.
    resonances : tuple of tuple of Resonance
        Of each level, in their order along the mode. The first belongs to the response that begins
        at rest; further ones to isolated responses, or to branches that join it.
    """

    mode: NonlinearMode
    level_name: str | None
    levels: Array
    resonances: tuple[tuple[Resonance, ...], ...]
    _curves: tuple[Array, ...]

    def frequency_hz(self, level: int = 0) -> Array:
        """Frequencies of the excitation (K,) along the response [Hz].

        From below resonance to above; NaN separates isolated responses.
        """
        return np.asarray(self._curves[level][0] / (2.0 * np.pi))

    def amplitude(self, level: int = 0) -> Array:
        """Half the range (K,) of the observed displacement."""
        return self._curves[level][1]

    def phase(self, level: int = 0) -> Array:
        """Phase (K,) [rad] of its first harmonic, |X_1| sin(w t + phase), as of a response."""
        return self._curves[level][2]

    def peak(self, level: int = 0) -> Resonance:
        """The resonance of the response that begins at rest.

        Raises
        ------
        InputError
            If the force balances the losses at no amplitude of the mode.
        """
        if not self.resonances[level]:
            raise InputError(f"The mode has no resonance at level {level}: the work of the force "
                             f"does not balance its losses between the amplitudes "
                             f"{span(self.mode.amplitude)}; follow it to larger ones.")
        return self.resonances[level][0]

    def summary(self) -> list[tuple[str, str]]:
        """Mode, levels and resonances."""
        found = [f"{quantity(one.amplitude, 'm')} at {one.frequency_hz:.5g} Hz"
                 + ("" if one.solved else ", interpolated")
                 for level in self.resonances for one in level]
        return [("mode", f"{self.mode.number}"), ("observed", self.mode.observed),
                *([(self.level_name, listed([f"{level:.5g}" for level in self.levels], 6))]
                  if self.level_name else []),
                ("resonances", listed(found, 6))]


@one_blas_thread
def mode_response(
    mode: NonlinearMode, system: ContactSystem, *,
    levels: Mapping[str, ArrayLike] | None = None, frequency: str = "drive.frequency_hz",
) -> ModeResponse:
    r"""Resonance and forced response of a system from one of its nonlinear modes, at little cost.

    With the harmonics :math:`X_k` of the mode at each amplitude, its frequency :math:`\Omega_0` and
    :math:`\xi`, modal damping C and the first harmonic P of the excitation, the response of the
    same amplitude has the frequencies :math:`\Omega` of

    .. math:: \left|(\Omega_0^2 - \Omega^2) X_1^H X_1
        + i \sum_k k^2 X_k^H ((\Omega - \Omega_0) C + \Omega_0 \xi) X_k\right| = |X_1^H P|,

    exact for one linear mode, and for one harmonic of one coordinate. At the resonance,
    :math:`\Omega = \Omega_0`, the work of the force balances the losses of all harmonics; there the
    mode is solved for, as far as it can be (``solved``), and between its points interpolated. Other
    modes must be far.

    Parameters
    ----------
    mode : NonlinearMode
        Of the same system, up to amplitudes above the resonance.
    system : ContactSystem
        With its excitation, a drive or loads of one frequency.
    levels : mapping of one name, optional
        A parameter and its values, ``{"drive.amplitude_x": [1.0, 2.0]}``.
    frequency : str
        Dotted name of the frequency of the excitation [Hz].

    Raises
    ------
    InputError
        For another number of modal coordinates, or without excitation.

    References
    ----------
    M. Krack, L. Panning-von Scheidt, J. Wallaschek, A method for nonlinear modal analysis and
    synthesis, Journal of Sound and Vibration 332 (2013).
    """
    require_kind("mode_response", NonlinearMode, mode=mode)
    require_kind("mode_response", ContactSystem, system=system)
    level_name, values = levels_of(levels)
    names = dict.fromkeys([frequency] + ([level_name] if level_name else []))
    field = contact_field(system, names)
    if mode.coordinates().shape[1] != system.basis.modes:
        raise InputError(f"mode_response: the mode has {mode.coordinates().shape[1]} modal "
                         f"coordinates, but the system {system.basis.modes}; take the system of "
                         f"the mode.")
    found, curves = [], []
    for value in values:
        given = field.values if level_name is None else field.values_with(**{level_name: value})
        along = _refined(mode, system, partial(
            _Along.of, field=field, values=given, free=field.index(frequency)))
        found.append(tuple(along.resonances().values()))
        curves.append(along.curve())
    return ModeResponse(mode, level_name, values, tuple(found), tuple(curves))


def _refined(
    mode: NonlinearMode, system: ContactSystem, along_of: Callable[[NonlinearMode], "_Along"]
) -> "_Along":
    """Quantities along a mode, which is solved near all resonances."""
    for _ in range(_ROUNDS):
        far = [(place, one.amplitude) for place, one in along_of(mode).resonances().items()
               if not one.solved]
        known = len(mode)
        # From the last one on, so that numbers of points before stay.
        for place, amplitude in far[::-1]:
            with suppress(FecontactError):
                mode = with_point(mode, system, place, amplitude)
        if len(mode) == known:
            break
    return along_of(mode)


@dataclass(frozen=True, eq=False)
class _Along:
    """Quantities along a mode from which the response follows, over the chord s (N,).

    Rows of ``known`` (9, N): frequency, damping ratio, logarithm of the amplitude a; X_1^H X_1 and
    the sums of the equation with C and with xi (see :func:`mode_response`), all over a^2; X_1^H P
    over a by magnitude and phase; phase of the observed displacement. Of a linear mode they are
    constant except for a. ``points`` (N,) are their numbers on the mode; one that repeats is left
    out.
    """

    chord: Array
    known: Array
    points: NDArray[np.intp]

    @classmethod
    def of(cls, mode: NonlinearMode, field: ContactField, values: Array, free: int) -> "_Along":
        w, X = mode.angular_frequency, mode.coordinates()
        state = rest_state(field, values)
        forces = []
        for each in w / (2.0 * np.pi):
            values = values.copy()
            values[free] = each
            forces.append(given_force(field, values, state, require_excitation(field, values)))
        P: ComplexArray = np.array(forces)
        C = field.arrays(values).damping
        lost, damped = np.zeros(len(w)), np.zeros(len(w))
        for k in range(1, mode.branch.method.highest + 1):
            each = k * mode.coordinates(k)
            lost += w * mode.xi * (np.abs(each) ** 2).sum(axis=1)
            damped += np.einsum("ni,ij,nj->n", each.conj(), C, each).real
        work = (X.conj() * P).sum(axis=1)
        a = mode.amplitude
        known = np.array([w, mode.damping_ratio, np.log(a), (np.abs(X) ** 2).sum(axis=1) / a**2,
                          damped / a**2, lost / a**2, np.abs(work) / a,
                          np.unwrap(np.angle(work)), np.unwrap(np.angle(mode.harmonic()))])
        # Steps relative to amplitude, frequency and damping.
        steps = np.diff(np.array([known[2], 5.0 * np.log(w), 10.0 * known[1]]), axis=1)
        kept = np.append(True, np.linalg.norm(steps, axis=0) > 1e-12)
        chord = np.append(0.0, np.cumsum(np.linalg.norm(steps, axis=0)))
        return cls(chord[kept], known[:, kept], np.flatnonzero(kept))

    def at(self, s: Array) -> Array:
        """Quantities (9, k) at places s (k,), by monotone cubics: as the rows, but not over a."""
        from scipy.interpolate import PchipInterpolator

        return _whole(np.asarray(PchipInterpolator(self.chord, self.known, axis=1)(s)))

    @staticmethod
    def balance(known: Array) -> Array:
        """Work of the force over the losses, less one (k,)."""
        lost, work = known[5:7]
        return np.asarray(work / np.where(lost > 0.0, lost, np.finfo(float).tiny) - 1.0)

    def _places(self) -> dict[int, float]:
        """Places s of the resonances, by the number of the point of the mode that is before it."""
        from scipy.optimize import brentq

        def off(s: float) -> float:
            return float(np.tanh(self.balance(self.at(np.array([s])))[0]))

        known = self.balance(_whole(self.known))
        return {int(self.points[k + 1]) - 1:
                float(brentq(off, self.chord[k], self.chord[k + 1], xtol=1e-14))
                for k in np.flatnonzero(known[:-1] * known[1:] < 0.0)}

    def resonances(self) -> dict[int, Resonance]:
        """All of them in their order, by the number of the point of the mode that is before it."""
        places = self._places()
        found = self.at(np.array([*places.values()]))
        amplitudes = np.exp(self.known[2])
        return {before: Resonance(float(a), float(w / (2.0 * np.pi)), float(ratio),
                                  bool(np.abs(amplitudes / a - 1.0).min() <= _NEAR))
                for before, (w, ratio, a) in zip(places, found[:3].T, strict=True)}

    def curve(self) -> Array:
        """Frequency, amplitude and phase (3, K) along the responses."""
        between = np.linspace(0.0, 1.0, _BETWEEN, endpoint=False)
        fine = (self.chord[:-1, None] + np.diff(self.chord)[:, None] * between).reshape(-1)
        places = np.array([*self._places().values()])
        s = np.unique(np.concatenate([fine, self.chord[-1:], places]))
        known = self.at(s)
        responding = self.balance(known) > 0.0
        # The resonance itself belongs to the response on both sides of it.
        responding |= np.isin(s, places)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], responding.astype(int), [0]])))
        pieces: list[Array] = []
        for first, end in edges.reshape(-1, 2):
            sides = _frequencies(known[:, first:end])
            both = [np.array([w, known[2, first:end], _phase(known[:, first:end], w)])
                    for w in sides]
            whole = np.concatenate([both[0], both[1][:, ::-1]], axis=1)
            whole = whole[:, np.isfinite(whole[0])]
            whole[2] = np.unwrap(whole[2])
            whole[2] -= 2.0 * np.pi * np.floor(whole[2, :1] / (2.0 * np.pi) + 0.5)
            pieces += [np.full((3, 1), np.nan)] * bool(pieces)
            pieces.append(whole)
        return np.concatenate(pieces, axis=1) if pieces else np.empty((3, 0))


def _whole(known: Array) -> Array:
    """Quantities (9, k) from rows that are over amplitudes."""
    found = known.copy()
    found[2] = np.exp(known[2])
    found[3:6] *= found[2] ** 2
    found[6] *= found[2]
    return found


def _frequencies(known: Array) -> tuple[Array, Array]:
    """Frequencies (k,) of the excitation below and above those of the mode; NaN where none."""
    sides = np.full((2, known.shape[1]), np.nan)
    for k, (w, _, _, size, damped, lost, work) in enumerate(known[:7].T):
        linear = np.array([damped, lost - damped * w])
        whole = np.polyadd(np.polymul([-size, 0.0, w * w * size], [-size, 0.0, w * w * size]),
                           np.polysub(np.polymul(linear, linear), [work**2]))
        roots = np.roots(whole)
        real = roots.real[(np.abs(roots.imag) <= 1e-6 * w) & (roots.real > 0.0)]
        below, above = real[real <= w], real[real > w]
        sides[0, k] = below.max() if len(below) else np.nan
        sides[1, k] = above.min() if len(above) else np.nan
    return sides[0], sides[1]


def _phase(known: Array, excited: Array) -> Array:
    """Phase (k,) of the observed displacement against a sine, at frequencies (k,)."""
    w, _, _, size, damped, lost, _, force, seen = known
    impedance = (w**2 - excited**2) * size + 1j * ((excited - w) * damped + lost)
    return np.asarray(seen + force - np.angle(impedance) + np.pi / 2.0)
