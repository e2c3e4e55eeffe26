"""Modal bases shared by several batches: computed once, stored, sent to the workers."""

import pickle
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fecontact.core.errors import AnalysisError
from fecontact.study.bodies_section import Reduced
from fecontact.study.study import Study
from fecontact.sweeps.batch import Batch, make_basis, packed, read_reduced, run_batch
from fecontact.sweeps.dispatch import Job, LostError
from fecontact.sweeps.store import Store


class Bases:
    """Modal bases on which batches depend.

    A basis needed by a single batch is computed with that batch. A basis common to all cases is
    computed in this process, where the study may have cached it; workers compute the others.
    """

    def __init__(self, study: Study, store: Store, batches: Sequence[Batch]) -> None:
        self.study, self.store = study, store
        needed = [{case.basis for case in batch.cases} for batch in batches]
        times = Counter(key for keys in needed for key in keys)
        shared = {key for key, count in times.items() if count > 1 or len(times) == 1}
        self.only = len(times) == 1
        self.held = [(keys & shared, batch) for keys, batch in zip(needed, batches, strict=True)]
        self.ready: dict[str, bytes | Path | str] = {}
        self.makers = {case.basis: replace(batch, cases=(case,))
                       for batch in batches for case in batch.cases if case.basis in shared}

    def first(self) -> list[Job]:
        """Jobs that can start at once: bases to compute, and batches that do not wait for one.

        Raises
        ------
        FecontactError
            If the basis common to all cases cannot be computed.
        """
        jobs = []
        for key, batch in self.makers.items():
            if self.store.basis_file(key).exists():
                self._put(key, read_reduced(self.store.basis_file(key)), batch)
            elif self.only:
                self._put(key, self.study.with_(**batch.cases[0].basis_changes).reduced,
                          batch)
            else:
                jobs.append(Job(make_basis, batch))
        return jobs + self._released()

    def made(self, batch: Batch, result: bytes | str | LostError) -> list[Job]:
        """Store a basis made by a worker; returns the jobs that can now start."""
        key = batch.cases[0].basis
        if isinstance(result, bytes):
            self._put(key, pickle.loads(result), batch)
        else:
            self.ready[key] = str(result)
        return self._released()

    def _put(self, key: str, basis: Reduced, batch: Batch) -> None:
        try:
            self.store.keep_basis(key, basis)
        except OSError as error:
            raise AnalysisError(f"{self.store.basis_file(key)} cannot be written "
                                f"({(error.strerror or str(error)).lower()}).") from None
        # Fields are large; workers that write them have access to the folder anyway.
        at_places = any(isinstance(force.point, tuple) for force in self.study.load.forces)
        self.ready[key] = (self.store.basis_file(key).absolute() if batch.frames
                           else packed(basis, shapes=at_places))

    def _released(self) -> list[Job]:
        free = [batch for keys, batch in self.held if keys <= self.ready.keys()]
        self.held = [(keys, batch) for keys, batch in self.held if not keys <= self.ready.keys()]
        return [Job(run_batch, replace(batch, bases={
            key: self.ready[key] for case in batch.cases if (key := case.basis) in self.ready}))
                for batch in free]
