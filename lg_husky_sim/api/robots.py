# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The Husky as a user handles it: parameters, effects, matrices and what to do with them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
import os
from pathlib import Path
from typing import overload, TYPE_CHECKING

from lg_husky_sim.api.driving import Drive, driven
from lg_husky_sim.api.graphs import Graph
from lg_husky_sim.api.progress import Shown
from lg_husky_sim.api.recordings import PathLike, Recording, Recordings, Topics
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.errors import ModelFileError, ParameterError
from lg_husky_sim.husky import network
from lg_husky_sim.husky.by_hand import Number as Number  # a public name, used here too
from lg_husky_sim.husky.effects import check_distinct, Effect, Subsystem
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import apply_settings, load_model, ModelFile, save_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.linear_graph import LinearGraph
from lg_husky_sim.yaml_files import shown

if TYPE_CHECKING:
    from lg_husky_sim.api.comparing import Comparison
    from lg_husky_sim.api.diagnosing import DiagnosisResult
    from lg_husky_sim.api.identifying import Fit


class Husky(Graph):
    """
    A model of the Clearpath Husky, or of another skid-steer robot with other numbers.

    Parameters
    ----------
    model : path-like, ModelFile or Husky, optional
        A model file such as ``identify`` and ``diagnose`` write; the packaged Husky with the
        paper's parameters by default.
    about : str, optional
        One line on which robot it is; by default what the model says, and what is set by hand.
    **settings : float or Number
        Physical parameters by name, in place of the model's [SI]; a :class:`Number` says how
        well one is known, too. Bounds stay in proportion to the robot's size.

    Raises
    ------
    ModelFileError
        If the file cannot be read as a model.
    ParameterError
        If a setting is unknown or out of bounds.

    """

    path: str
    model: ModelFile

    # Two, so that a mapping of floats can be given as ``**settings`` and is checked as such.
    @overload
    def __init__(self, model: PathLike | ModelFile | Husky | None = None,
                 **settings: float | Number) -> None: ...

    @overload
    def __init__(self, model: PathLike | ModelFile | Husky | None = None, *,
                 about: str | None, **settings: float | Number) -> None: ...

    def __init__(self, model: PathLike | ModelFile | Husky | None = None, *,
                 about: str | float | Number | None = None, **settings: float | Number) -> None:
        """Read the model; the equations are derived when they are first needed."""
        if isinstance(model, Husky):
            file, self.path = model.model, model.path
        elif isinstance(model, ModelFile):
            file, self.path = model, ''
        elif not isinstance(model, (str, os.PathLike, type(None))):
            raise ModelFileError(f'{shown(model)} is no model, nor the path of a model file')
        else:
            file, self.path = load_model(model), '' if model is None else os.fspath(model)
        if not (about is None or isinstance(about, str)):
            raise ParameterError(f'about = {shown(about)} is not a text')
        self.model = apply_settings(file, settings, about)
        linear = file.structure.network().graph
        name = self.model.about or (Path(self.path).stem if self.path else 'Husky')
        super().__init__(name, linear, _values(self.model), paper_outputs(linear),
                         _note(file.structure))

    @property
    def parameters(self) -> Parameters:
        """Physical parameters: a mapping of names to values, with ``entry(name)`` for the rest."""
        return self.model.parameters

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the catalogue that are in the model."""
        return self.model.structure.effects

    @property
    def left_out(self) -> str:
        """Return what poles, transfer functions and responses are without; '' for nothing."""
        return '. '.join(filter(None, (super().left_out, self.outside)))

    @property
    def outside(self) -> str:
        """Return what is not in the graph, as a dead time of the commands; '' for nothing."""
        beside = _beside_the_graph(self.model.structure)
        return f'Without {", ".join(beside)}: outside the graph' if beside else ''

    def _owner(self, effort: str) -> str:
        return self.model.structure.owners()[effort].id

    @cached_property
    def plant(self) -> Plant:
        """Return the model ready to be stepped."""
        return compile_model(self.model.structure).at(self.model.parameters)

    @overload
    def replacing(self, **values: float | Number) -> Husky: ...

    @overload
    def replacing(self, *, about: str | None, **values: float | Number) -> Husky: ...

    def replacing(self, *, about: str | float | Number | None = None, **values: float | Number
                  ) -> Husky:
        """Return this model with other values of parameters [SI], as ``Husky(...)`` takes them."""
        return Husky(self.model, about=about, **values)

    def with_effect(self, effect: str, side: str = '', shape: str = '', **values: float) -> Husky:
        """
        Return this model with one effect of the catalogue more.

        Parameters
        ----------
        effect : str
            Its id; :func:`lg_husky_sim.list_effects` lists them.
        side, shape : str
            Where it has several; the first by default.
        **values : float
            Its numbers [SI]; by default sizes that are typical of such a robot.

        Returns
        -------
        Husky

        Raises
        ------
        ParameterError
            If the effect, its side or shape, or a number is unknown or out of bounds.

        """
        added = Effect(effect, side, shape)
        structure = self.model.in_proportion().structure.with_effect(added)
        check_distinct(structure.effects)
        parameters = self.model.parameters.with_entries(*(
            one.parameter() for one in structure.effects[-1].parameters()
            if one.name not in self.model.parameters))
        return Husky(ModelFile(structure, parameters.replacing(values), self.model.about))

    def simulate(self, commands: Drive, *, rate: float | None = None,
                 topics: Topics = None) -> Recording:
        """
        Drive the model with commands.

        Parameters
        ----------
        commands : path-like, str, Recording, Manoeuvre, TimeSeries, DataFrame or arrays
            A recording, whose commands are driven from its initial pose; a built-in manoeuvre
            (``'s_bend'``) or a command script; or times [s], forward speeds [m/s] and yaw rates
            [rad/s] as three arrays of shape (n,) or one of shape (n, 3).
        rate : float, optional
            Samples per second [Hz]; by default a recording's own stamps, else 50.
        topics : mapping of str to str, optional
            Topics of the recording chosen by hand.

        Returns
        -------
        Recording
            What the model's sensors read: command, wheels, wheel_angles, wheel_torques, imu, pose.
            A wheel rate is the mean over the 20 ms before its stamp, as an encoder counts it (in
            the first 20 ms the state itself); all else is the state at the stamp.

        Raises
        ------
        CommandError
            If the commands cannot be used.
        RecordingError
            If the recording cannot be read or has no commands.

        """
        return driven(self.plant, self.parameters, commands, rate, topics)

    def compare(self, recordings: Recordings, **options: object) -> Comparison:
        """Replay recordings through this model; see :func:`lg_husky_sim.compare`."""
        from lg_husky_sim.api.comparing import compare
        return compare(recordings, self, **options)  # type: ignore[arg-type]

    def identify(self, recordings: Recordings, free: Iterable[str] = (), *,
                 effects: Iterable[str] = (), method: str = 'least-squares',
                 nuisance: Iterable[str] = (), profiles: Iterable[str] = (), seed: int = 0,
                 starts: int = 6, jobs: int = 1, scheduler: str | None = None,
                 topics: Topics = None, progress: Shown = True) -> Fit:
        """
        Estimate parameters from recordings.

        Parameters
        ----------
        recordings : path-like, Recording, or several of them
            Those to fit to, or the paths of their bags.
        free : iterable of str
            Parameters to estimate; those that the model marks as free, and the numbers of its
            effects, by default.
        effects : iterable of str
            Effects to add: ``'id'``, ``'id:side'`` or ``'id:shape'``.
        method : str
            ``least-squares`` on all outputs; ``ga`` or ``de`` on the position alone (eq. 23).
        nuisance : iterable of str
            Unknowns of the recordings to estimate as well: latency, delay_wheels, delay_imu,
            delay_pose [s], gyro_bias [rad/s], initial_state.
        profiles : iterable of str
            Parameters that get a likelihood profile.
        seed, starts : int
            Of the search; the same seed gives the same estimates to the last bit.
        jobs : int
            Processes.
        scheduler : str, optional
            Dask scheduler in place of processes.
        topics : mapping of str to str, optional
            Topics of the recordings chosen by hand.
        progress : bool or callable
            Shown in terminals and notebooks; False for none.

        Returns
        -------
        Fit

        Raises
        ------
        FitError
            If nothing is free, or a name is unknown.
        RecordingError
            If there is no recording, or one cannot be used.
        CommandError
            If starts or jobs are fewer than one, or the seed is negative.

        """
        from lg_husky_sim.api.identifying import identify
        return identify(self, recordings, free, effects=effects, method=method,
                        nuisance=nuisance, profiles=profiles, seed=seed, starts=starts,
                        jobs=jobs, scheduler=scheduler, topics=topics, progress=progress)

    def diagnose(self, recordings: Recordings, *, baseline: Recordings = (),
                 jobs: int | None = None, topics: Topics = None,
                 progress: Shown = True) -> DiagnosisResult:
        """
        Say which physics this model lacks that recordings show.

        Parameters
        ----------
        recordings : path-like, Recording, or several of them
            Those to explain, or the paths of their bags.
        baseline : path-like, Recording, or several of them
            Of the same robot before a change; then the question is what changed.
        jobs : int, optional
            Threads; as many as there are cores by default.
        topics : mapping of str to str, optional
            Topics of the recordings chosen by hand.
        progress : bool or callable
            Shown in terminals and notebooks; False for none.

        Returns
        -------
        DiagnosisResult

        Raises
        ------
        RecordingError
            If there is no recording, or one cannot be used.
        CommandError
            If jobs are fewer than one.
        DiagnosisError
            If the recordings cannot be those of a Husky.

        """
        from lg_husky_sim.api.diagnosing import diagnose
        return diagnose(self, recordings, baseline=baseline, jobs=jobs,
                        topics=topics, progress=progress)

    def save(self, path: PathLike) -> Path:
        """Write a model file, which ``sim_node`` and ``Husky(path)`` read, over none by hand."""
        save_model(self.model, path)
        return Path(path)

    def table(self) -> Table:
        """Return the parameters as a table."""
        return Table('', ('parameter', 'value', 'unit', 'low', 'high', 'lower', 'upper',
                          'tolerance', 'free', 'source'),
                     tuple((p.name, p.value, p.unit, p.low, p.high, p.lower, p.upper,
                            p.tolerance, p.free, p.source)
                           for p in self.parameters.entries))

    def to_pandas(self) -> object:
        """Return the parameters as a pandas DataFrame, index ``parameter``."""
        return self.table().to_pandas().set_index('parameter')

    def __repr__(self) -> str:
        """Name the model and its effects."""
        added = ', '.join(f'{e.id}:{e.side}' if e.side != 'none' else e.id for e in self.effects)
        return f'<Husky {self.model.about or "without a name"}{": " + added if added else ""}>'

    def _repr_html_(self) -> str:
        shown = Table('', ('parameter', 'value', 'unit', 'source'), tuple(
            (p.name, p.value, p.unit, p.source) for p in self.parameters.entries))
        points = {'Effects': [f'{e.id} ({e.side}): {e.kind.title}' for e in self.effects]}
        return page_part(self.model.about or 'Husky', [], [shown], points)


def as_husky(model: PathLike | ModelFile | Husky | None) -> Husky:
    """Return a model as a Husky; the packaged one for None."""
    return model if isinstance(model, Husky) else Husky(model)


def paper_outputs(graph: LinearGraph) -> tuple[str, ...]:
    """Return the outputs of eq. (18): the wheels' rates, forward speed and yaw rate."""
    sides = ('J_LW', 'J_RW') if 'J_LW' in graph.names else ('J_RL', 'J_RR')
    return (*(f'omega({name})' for name in sides), 'v(M_H)', 'omega(J_H)')


def paper_graph(drivetrain: str, outputs: Sequence[str] = ()) -> Graph:
    """Return one of the paper's two graphs with the packaged parameters."""
    graph = network.simplified() if drivetrain == 'simplified' else network.expanded()
    return Graph(f'Husky, {drivetrain} drivetrain', graph, load_model().parameters,
                 outputs or paper_outputs(graph))


def _values(model: ModelFile) -> Mapping[str, float]:
    # By the names of the graph, where changed effects have others.
    values = dict(model.parameters)
    for effect in model.structure.in_force():
        values.update({name: model.parameters[own] for name, own in effect.renamed.items()})
    return values


def _beside_the_graph(structure: Structure) -> tuple[str, ...]:
    return tuple(dict.fromkeys(
        effect.id for effect in structure.in_force()
        if effect.kind.subsystem in (Subsystem.COMMAND, Subsystem.SENSOR)))


def _note(structure: Structure) -> str:
    # Which effects are no part of the graph, and which of two graphs it is.
    names = _beside_the_graph(structure)
    left_out = ('Not in the matrices and poles, which are those of the graph alone: '
                f'{", ".join(names)}') if names else ''
    late = dict.fromkeys(effect.id for effect in structure.in_force() if effect.late)
    onset = f'The model after the onset of {", ".join(late)}' if late else ''
    return '. '.join(text for text in (onset, left_out) if text)
