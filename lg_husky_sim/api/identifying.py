# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters from recordings: the fit as a value with tables, pictures and files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING

from lg_husky_sim import recording as rec
from lg_husky_sim.api.progress import Shown, shown
from lg_husky_sim.api.recordings import (
    check_count,
    check_seed,
    given,
    PathLike,
    read_all,
    Recordings,
    Topics,
)
from lg_husky_sim.api.robots import Husky
from lg_husky_sim.api.sensor_warnings import warnings_of
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.errors import FitError
from lg_husky_sim.extras import require
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.report import ENDINGS, write_fit
from lg_husky_sim.identification.result import FitResult, Method
from lg_husky_sim.identification.unknowns import check_profiles
from lg_husky_sim.reporting.provenance import provenance

if TYPE_CHECKING:
    from lg_husky_sim.diagnosis.prediction_errors import Assessment


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """
    Parameters estimated from recordings. Made by :meth:`Husky.identify`.

    Parameters
    ----------
    result : FitResult
        Estimates, covariance, warnings and all that belongs to the fit.
    segments : tuple of Segment
        That were fitted.
    before : Husky
        The model as it was given.
    sources : tuple of (str, str)
        Name and path of each recording.

    """

    result: FitResult
    segments: tuple[rec.Segment, ...]
    before: Husky
    sources: tuple[tuple[str, str], ...] = ()

    @property
    def husky(self) -> Husky:
        """Return the calibrated model."""
        return Husky(self.result.model)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name [SI]."""
        return self.result.values

    @property
    def converged(self) -> bool:
        """Whether the search came to an end."""
        return self.result.converged

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what to know before estimates are used: losses, parameters at their bounds."""
        return (*[self.result.loss] * bool(self.result.loss), *self.result.warnings)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Return what these data cannot determine, in sentences."""
        return self.result.undetermined

    @cached_property
    def what_to_change(self) -> Assessment:
        """How the recordings still differ from the fitted model, and what to change."""
        from lg_husky_sim.diagnosis.prediction_errors import assess

        plant = self.husky.plant
        return assess([(part, replay(plant, part)) for part in self.segments],
                      'the fitted model', self.result.model.parameters)

    def table(self) -> Table:
        """Return the estimates with their 95 % intervals."""
        return Table('', ('parameter', 'value', 'low', 'high', 'before', 'unit'), tuple(
            (one.name, one.value, one.low, one.high, one.start, one.unit)
            for one in self.result.estimates))

    def channels(self) -> Table:
        """Return the root mean square errors before and after, by channel."""
        return Table('', ('channel', 'before', 'after', 'unit', 'samples'), tuple(
            (one.name, one.before, one.after, one.unit, one.count)
            for one in self.result.channels))

    def to_pandas(self) -> Any:
        """Return the estimates as a pandas DataFrame, index ``parameter``."""
        return self.table().to_pandas().set_index('parameter')

    def data(self) -> dict[str, Any]:
        """Return the fit as plain data, schema ``lg_husky_sim/fit/1``."""
        return self.result.data()

    def plot(self, ax: Any = None) -> Any:
        """
        Draw the estimates' 95 % intervals, relative to the estimates.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current axes if not given.

        Returns
        -------
        matplotlib Axes

        """
        require('matplotlib', 'draw figures')
        from lg_husky_sim.reporting.pictures import draw_intervals
        if ax is None:
            from matplotlib import pyplot
            ax = pyplot.gca()
        draw_intervals(ax, [(one.name, one.unit, one.value, one.low, one.high)
                            for one in self.result.estimates])
        return ax

    def save(self, path: PathLike) -> tuple[Path, ...]:
        """
        Write the model file and, beside it, the report as .txt, .json and .html.

        Parameters
        ----------
        path : path-like
            Ends in .yaml.

        Returns
        -------
        tuple of pathlib.Path
            Model, text, JSON, HTML.

        Raises
        ------
        SettingsError
            If the name cannot be used.

        """
        return write_fit(self.result, self.segments, self.before.model, Path(path),
                         provenance(self.sources), self.what_to_change.advice())

    def report(self, path: PathLike | None = None) -> Path:
        """Write everything into a folder, a temporary one by default; return the page."""
        place = Path(path or tempfile.mkdtemp(prefix='lg_husky_fit.'))
        return self.save(place if place.suffix in ENDINGS else place / 'fit.yaml')[-1]

    def __str__(self) -> str:
        """Return the report as text."""
        return str(self.result)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        state = 'converged' if self.converged else 'NOT CONVERGED'
        return page_part(
            f'Fit of {", ".join(self.result.recordings)}',
            [f'{self.result.method.value}, {self.result.evaluations} simulations, {state}'],
            [self.table(), self.channels()],
            {'Warnings': self.warnings,
             **{one.where: one.sentences for one in self.what_to_change.advice()},
             'What these data cannot determine': self.undetermined})


def identify(husky: Husky, recordings: Recordings, free: Iterable[str] = (), *,
             effects: Iterable[str] = (), method: str = 'least-squares',
             nuisance: Iterable[str] = (), profiles: Iterable[str] = (), seed: int = 0,
             starts: int = 6, jobs: int = 1, scheduler: str | None = None,
             topics: Topics = None, progress: Shown = True) -> Fit:
    """Estimate parameters; see :meth:`lg_husky_sim.Husky.identify`."""
    methods = [one.value for one in Method]
    if method not in methods:
        raise FitError(f'method {method!r} is unknown; there are {", ".join(methods)}')
    check_seed(seed)
    check_count('starts', starts)
    check_count('jobs', jobs)
    recordings = given(recordings)
    free, effects, nuisance, profiles = map(_names, (free, effects, nuisance, profiles))
    model = with_effects(husky.model, effects)
    check_profiles(model, free, nuisance, profiles)
    onset = model.structure.onset
    with shown(progress, known=False) as report:
        read, = rec.named_apart(rec.named_as_in(
            read_all(recordings, topics=topics, progress=report),
            () if onset is None else onset.recordings))
        parts = tuple(part for one in read for part in rec.segments(one))
        result = estimate(model, parts, method=Method(method), free=free,
                          nuisance=nuisance, profiles=profiles, seed=seed,
                          starts=starts, jobs=jobs, scheduler=scheduler, baseline=husky.model,
                          progress=lambda word: report(f'fitting: {word}', None))
    said = warnings_of(parts, result.model, nuisance)
    result = replace(result, warnings=(*said, *result.warnings))
    return Fit(result, parts, husky, tuple((one.name, one.path) for one in read))


def _names(several: Iterable[str]) -> tuple[str, ...]:
    # A text is one name, not its letters.
    return (several,) if isinstance(several, str) else tuple(several)
