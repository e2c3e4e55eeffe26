"""One thread for the small matrices of reduced models.

NumPy and SciPy bring a BLAS library each, with a thread per core that waits busily for a while
after every product. In turn, on matrices of a few hundred rows, they take the cores from each
other: a product that takes 1 ms alone then takes 20 ms.
"""

import contextlib
import threading
from types import TracebackType

import scipy.linalg  # noqa: F401 -- loads its BLAS, which must be there when threads are limited
from threadpoolctl import LibController, ThreadpoolController


class _OneThread(contextlib.ContextDecorator):
    """Limits all BLAS libraries to one thread while any call or block is under way.

    The libraries have one number for all threads of the program. When the last block ends,
    whichever thread it runs in, the numbers of before are restored.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._libraries: list[LibController] | None = None
        self._before: list[int] = []

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                if self._libraries is None:
                    self._libraries = ThreadpoolController().select(user_api="blas").lib_controllers
                self._before = [library.get_num_threads() for library in self._libraries]
                self._set([1] * len(self._libraries))
            self._inside += 1

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._set(self._before)

    def _set(self, numbers: list[int]) -> None:
        for library, number in zip(self._libraries or (), numbers, strict=True):
            _release(library)
            library.set_num_threads(number)
            _release(library)


def _release(library: LibController) -> None:
    """Let any thread set the number; threadpoolctl 3.8 reserves this to the first that did."""
    release = getattr(library, "clear_controlling_thread", None)
    if release is not None:
        release(force=True)


#: Decorates a function, or begins a block: ``with one_blas_thread:``.
one_blas_thread = _OneThread()
