# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Missing physics as a value with tables, pictures and files: the one door to the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import os
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING
import warnings

from lg_husky_sim.api.progress import Shown, shown
from lg_husky_sim.api.recordings import (
    check_count,
    given,
    listed,
    PathLike,
    read_all,
    Recording,
    Recordings,
    Topics,
)
from lg_husky_sim.api.robots import Husky
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.folders import result_folder

if TYPE_CHECKING:
    from lg_husky_sim.api.comparing import Comparison
    from lg_husky_sim.diagnosis.before_after.diagnose_change import ChangeCase
    from lg_husky_sim.diagnosis.diagnose import Case
    from lg_husky_sim.diagnosis.result import Diagnosis, Finding


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosisResult:
    """
    Which physics a model lacks. Made by :meth:`Husky.diagnose`.

    Parameters
    ----------
    case : Case or ChangeCase
        The diagnosis with what it was made from.
    recordings : tuple of Recording
    before : Husky
        The model in doubt.
    baseline : tuple of Recording
        Recordings before a change.

    """

    case: Case | ChangeCase
    recordings: tuple[Recording, ...]
    before: Husky
    baseline: tuple[Recording, ...] = ()

    @property
    def diagnosis(self) -> Diagnosis:
        """Return the whole answer as a value."""
        return self.case.diagnosis

    @property
    def verdict(self) -> str:
        """``nothing_missing``, ``known`` or ``unknown``."""
        return self.diagnosis.verdict.value

    @property
    def confidence(self) -> float:
        """Probability that verdict and first name are right (0 to 1)."""
        return self.diagnosis.confidence

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return what is missing: effect, side, numbers with intervals, a sentence."""
        return self.diagnosis.findings

    @property
    def headline(self) -> str:
        """Return the answer in one sentence."""
        from lg_husky_sim.diagnosis.output import headline
        return headline(self.diagnosis, bool(self.baseline))

    @property
    def husky(self) -> Husky:
        """Return the model recalibrated, with what was found."""
        return Husky(self.diagnosis.model)

    @property
    def recalibrated(self) -> Husky:
        """Return the model recalibrated only."""
        return Husky(self.diagnosis.plain_model)

    def table(self) -> Table:
        """Return the findings' numbers with their 95 % intervals."""
        rows: list[tuple[object, ...]] = []
        for finding in self.findings:
            for one in finding.parameters:
                rows.append((finding.effect, finding.side, one.name, one.value, one.low,
                             one.high, one.unit))
            if not finding.parameters:
                rows.append((finding.effect, finding.side, '', None, None, None, ''))
        return Table('', ('effect', 'side', 'parameter', 'value', 'low', 'high', 'unit'),
                     tuple(rows))

    def errors(self, held_out: bool = True) -> Table:
        """
        Return the errors of each model: nominal, recalibrated, with the finding.

        Parameters
        ----------
        held_out : bool
            On data that were not fitted, or on all data.

        Returns
        -------
        Table
            The last column has the change to the last model, marked as better or worse; none
            where there is one model.

        """
        from lg_husky_sim.diagnosis.error_tables import error_tables
        from lg_husky_sim.reporting.page import change_words, error_cells
        from lg_husky_sim.reporting.sections import Cell

        for table in error_tables(self.diagnosis, bool(self.baseline)):
            if table.held_out == held_out:
                values = {row.name: row.values for row in table.rows}
                # Those of the report: a quantity without a number has no row.
                rows = [(str(name), *(values[str(name)].get(one) for one in table.columns), *(
                    change_words(one) for one in cells[len(table.columns):]
                    if isinstance(one, Cell))) for name, *cells in error_cells(table).rows]
                change = ('change',) if table.compared else ()
                return Table('', (table.title.lower(), *table.columns, *change), tuple(rows))
        return Table('', (), ())

    def _advice(self) -> dict[str, tuple[str, ...]]:
        from lg_husky_sim.diagnosis.report import advice
        shapes = {(one.id, one.side): one.shape for one in self.husky.model.structure.effects}
        return {one.where: one.sentences
                for one in advice(self.diagnosis, shapes, changed=bool(self.baseline))}

    def to_pandas(self) -> Any:
        """Return the findings' numbers as a pandas DataFrame."""
        return self.table().to_pandas()

    def data(self) -> dict[str, Any]:
        """Return the diagnosis as plain data, schema ``lg_husky_sim/diagnosis/1``."""
        from lg_husky_sim.diagnosis.result import diagnosis_data
        return diagnosis_data(self.diagnosis)

    def compare(self) -> Comparison:
        """Return the recordings beside the nominal, the recalibrated and the found model."""
        from lg_husky_sim.api.comparing import compare
        return compare(self.recordings, {'nominal': self.before, 'recalibrated':
                       self.recalibrated, 'with finding': self.husky}, progress=False)

    def plot(self, axes: Any = None, recording: int = 0) -> Any:
        """
        Draw a recording: measured, nominal, recalibrated, with the finding.

        Parameters
        ----------
        axes : sequence of four matplotlib Axes, optional
            Where to draw; a new figure if not given.
        recording : int
            Which of the recordings.

        Returns
        -------
        numpy.ndarray of matplotlib Axes, shape (4,)

        """
        return self.compare().plot(axes, recording)

    def save(self, folder: PathLike, report: bool = True, command: str = '',
             warn: Callable[[str], object] = warnings.warn) -> Path:
        """
        Write diagnosis.json, model.yaml, plain.yaml, diagnosis.txt, and the report.

        Parameters
        ----------
        folder : path-like
            Made, or files of an earlier run in it replaced.
        report : bool
            Whether to write report.html and the pictures too.
        command : str
            What was typed, for the report.
        warn : callable
            Told why there is no report, if one was asked for and cannot be made.

        Returns
        -------
        pathlib.Path
            The report, or diagnosis.json without one.

        """
        from lg_husky_sim.diagnosis.output import MARKER, write_files
        from lg_husky_sim.reporting.provenance import provenance
        from lg_husky_sim.reporting.write import REPORT

        target = Path(folder)
        with result_folder(target, MARKER) as made:
            failure = write_files(made, self.case, report, provenance(
                [(one.name, one.path) for one in (*self.baseline, *self.recordings)],
                [('of --robot', self.before.path)] if self.before.path else [], command))
        if failure:
            warn(failure)
        return target / (REPORT if report and not failure else MARKER)

    def report(self, folder: PathLike | None = None) -> Path:
        """Write everything into a folder, a temporary one by default; return the page."""
        return self.save(folder or tempfile.mkdtemp(prefix='lg_husky_diagnosis.'))

    def __str__(self) -> str:
        """Return the answer as text."""
        from lg_husky_sim.diagnosis.output import summary_text
        return summary_text(self.diagnosis, bool(self.baseline))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page_part(
            self.headline, [f'Confidence {self.confidence:.2f}',
                            *(finding.statement for finding in self.findings)],
            [self.table(), self.errors(), self.errors(held_out=False)],
            {'Warnings': self.diagnosis.warnings, **self._advice(),
             'Notes': self.diagnosis.notes})


def diagnose(husky: Husky, recordings: Recordings, *, baseline: Recordings = (),
             jobs: int | None = None, topics: Topics = None,
             progress: Shown = True) -> DiagnosisResult:
    """Say which physics a model lacks; see :meth:`lg_husky_sim.Husky.diagnose`."""
    from lg_husky_sim.diagnosis.before_after.diagnose_change import change_case
    from lg_husky_sim.diagnosis.diagnose import diagnose as run
    from lg_husky_sim.diagnosis.error_tables import with_nominal

    recordings, baseline = given(recordings), listed(baseline)
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    check_count('jobs', jobs)
    with shown(progress) as report:
        after = read_all(recordings, topics=topics, progress=lambda stage, _: report(stage, 0.0))
        before = read_all(baseline, topics=topics, progress=lambda stage, _: report(stage, 0.0))
        case = change_case(after, before, husky.model, report, jobs=jobs) if before else run(
            after, husky.model, report, jobs=jobs)
        case = replace(case, diagnosis=with_nominal(case.diagnosis, case.nominal, case.segments))
    return DiagnosisResult(case, tuple(after), husky, tuple(before))
