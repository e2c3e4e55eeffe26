"""Time integration by CVODE of SUNDIALS, as a reference."""

import time as clock
from collections.abc import Callable

import numpy as np

from fecontact.core.errors import InputError, MissingLibraryError
from fecontact.core.types import Array
from fecontact.integrate.reference import scipy
from fecontact.integrate.trajectory import Solution, Status
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import slider_counts


def integrate(
    system: ContactSystem,
    state: Array,
    times: Array,
    *,
    rtol: float,
    progress: Callable[[float], None] | None,
    max_step: float | None = None,
) -> Solution:
    """Integrate by CVODE's backward differentiation formulas, restarting at breakpoints.

    The equations are those of :func:`fecontact.integrate.reference.scipy.integrate`.

    Raises
    ------
    MissingLibraryError
        If scikit-sundae is not installed.
    InputError
        For friction by elastic Coulomb elements, whose switches it does not locate.
    """
    if slider_counts(system).any():
        raise InputError("CVODE does not locate where elastic Coulomb elements (JenkinsFriction, "
                         "IwanFriction, FourParameterIwanFriction) end to slide; take Rodas5P() "
                         "or Scipy().")
    try:
        from sksundae.cvode import CVODE  # type: ignore[import-untyped]
    except ImportError:
        raise MissingLibraryError("The solver CVODE needs scikit-sundae: pip install "
                                  "'fecontact[cvode]'.") from None
    begin = clock.perf_counter()
    rate, derivative, tolerance, counts = scipy.with_work(system, state, rtol)

    # CVODE's arrays are read-only, which the compiled functions do not accept.
    def rhs(t: float, y: Array, out: Array) -> None:
        out[:] = rate(min(max(t, after), latest), y.copy())

    def jacobian(t: float, y: Array, out: Array, into: Array) -> None:
        into[:] = derivative(t, y.copy())

    pieces, t = scipy.smooth_pieces(system, times), float(times[0])
    result = np.empty((len(times), len(tolerance)))
    done, y = scipy.pass_break(system, t, pieces[0].begin, times, 0, result,
                               np.concatenate([state, np.zeros(len(tolerance) - len(state))]))
    status = Status.FINISHED
    longest = scipy.longest_step(system, times, max_step)
    after = latest = t
    try:
        for piece in pieces:
            t, after, end = piece.begin, piece.after, piece.end
            solver = CVODE(rhs, jacfn=jacobian, method="BDF", rtol=rtol, atol=tolerance,
                           max_step=longest, max_num_steps=100_000)
            latest = scipy.before_break(t, end)
            solver.init_step(t, y)
            while t < end and status is Status.FINISHED:
                target = min(float(times[done]), end) if done < len(times) else end
                try:
                    step = solver.step(target, tstop=end)
                except (ValueError, RuntimeError, ArithmeticError, np.linalg.LinAlgError) as error:
                    status, counts["message"] = Status.FAILED, str(error)
                    break
                if not step.success or not np.isfinite(step.y).all():
                    status, counts["message"] = Status.FAILED, str(step.message)
                    break
                t, y = target, np.array(step.y, dtype=float)
                if t == times[done] and t < end:
                    result[done] = y
                    done += 1
                if progress is not None:
                    progress(t)
            if status is not Status.FINISHED:
                break
            done, y = scipy.pass_break(system, latest, piece.until, times, done, result, y)
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    size, statistics = len(state), {**counts, "seconds": clock.perf_counter() - begin}
    return Solution(times[:done], result[:done, :size], result[:done, size:], status, statistics)
