# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which physics is in, derived once; numbers put in often."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import enum
from functools import lru_cache
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky import network
from lg_husky_sim.husky.command_lag import smooth_commands
from lg_husky_sim.husky.command_lag import STATES as LAG_STATES
from lg_husky_sim.husky.edits import axles, branch_of, edit, EditedNetwork, stage_of
from lg_husky_sim.husky.effects import always_on, Effect, Onset
from lg_husky_sim.husky.laws import MOTOR, WIDTH
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import CommandStage, Plant, PlantSet, SensorModel
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize
from lg_husky_sim.husky.speed_loop import close_speed_loop
from lg_husky_sim.husky.speed_loop import STATES as LOOP_STATES
from lg_husky_sim.linear_graph import compile_numeric, LinearGraph, NumericModel, StateSpace
from lg_husky_sim.linear_graph.expressions import compile_tuple, GLOBALS
import numpy as np


class Drivetrain(enum.Enum):
    """The paper's two drivetrain graphs."""

    SIMPLIFIED = 'simplified'
    EXPANDED = 'expanded'


@dataclass(frozen=True)
class Structure:
    """
    Which physics is in.

    Parameters
    ----------
    drivetrain : Drivetrain
    effects : tuple of Effect
        Applied in this order.
    onset : Onset or None
        When or where the late ones among the effects begin.
    robot : RobotSize
        Of the robot: what is typical of effects that it may get is in proportion.

    Raises
    ------
    ParameterError
        If an effect is late and there is no onset.

    """

    drivetrain: Drivetrain = Drivetrain.SIMPLIFIED
    effects: tuple[Effect, ...] = ()
    onset: Onset | None = None
    robot: RobotSize = field(default=HUSKY, compare=False)

    def __post_init__(self) -> None:
        """Check the effects against the onset."""
        for effect in self.effects:
            if effect.late and self.onset is None:
                raise ParameterError(f'effect {effect.id} begins at an onset, but the model has '
                                     'none')
            if effect.again and not any((e.id, e.side, e.again) == (effect.id, effect.side, False)
                                        for e in self.effects):
                raise ParameterError(
                    f'effect {effect.id} is changed at the onset, but does not exist before it')

    def with_effect(self, effect: Effect, onset: Onset | None = None) -> Structure:
        """
        Return this structure with one effect more; a belt needs the expanded drivetrain.

        Parameters
        ----------
        effect : Effect
            To be added behind those that there are.
        onset : Onset, optional
            When or where it begins, if it does.

        Raises
        ------
        ParameterError
            If other effects begin elsewhere: a model has one onset.

        """
        if onset is not None and self.onset is not None and onset != self.onset:
            raise ParameterError(
                f'effect {effect.id} has the onset {onset.kind.value} = {onset.value:g}, but the '
                f'model {self.onset.kind.value} = {self.onset.value:g}: there is one in a model')
        drivetrain = self.drivetrain
        if effect.kind.drivetrain:
            drivetrain = Drivetrain(effect.kind.drivetrain)
        added = replace(effect, robot=self.robot)
        return Structure(drivetrain, (*self.effects, added), onset or self.onset, self.robot)

    def network(self, late: bool = True) -> EditedNetwork:
        """
        Return the edited graph.

        Parameters
        ----------
        late : bool
            Whether the late effects are in.

        Returns
        -------
        EditedNetwork

        """
        return [self._bare(), *(edited for _, edited in self._edits(late))][-1]

    def owners(self) -> dict[str, Effect]:
        """Return which effect each law of the edited graph belongs to, by the law's source."""
        found: dict[str, Effect] = {}
        for effect, edited in self._edits(late=True):
            for name in edited.laws:
                found.setdefault(name, effect)
        return found

    def _bare(self) -> EditedNetwork:
        return EditedNetwork(network.simplified() if self.drivetrain is Drivetrain.SIMPLIFIED
                             else network.expanded())

    def _edits(self, late: bool) -> list[tuple[Effect, EditedNetwork]]:
        """Return the effects that act in the order of their edits, each with the graph then."""
        edited, there = self._bare(), self.in_force(late)
        found: list[tuple[Effect, EditedNetwork]] = []
        for effect in there:
            needed = effect.kind.needs.get(effect.shape)
            if needed and all(other.id != needed for other in there):
                raise ParameterError(f'effect {effect.id} of shape {effect.shape} changes what '
                                     f'another one has; it needs {needed}')
        for effect in sorted(there, key=stage_of):
            edited = edit(edited, effect)
            found.append((effect, edited))
        return found

    def in_force(self, late: bool = True) -> tuple[Effect, ...]:
        """
        Return the effects that act.

        Parameters
        ----------
        late : bool
            Whether the late effects are in.

        Returns
        -------
        tuple of Effect
            Without those whose place a changed one has taken.

        """
        there = [e for e in self.effects if late or not e.late]
        changed = {(e.id, e.side) for e in there if e.again}
        return tuple(e for e in there if e.again or (e.id, e.side) not in changed)


@lru_cache(maxsize=256)
def _numeric(graph: LinearGraph, outputs: tuple[str, ...]) -> NumericModel:
    # Effects on commands and sensors leave the graph as it is: half of the catalogue. Laws hang
    # on others where a driver's voltages act one behind the other: these the kernel adds up.
    series = any(name.startswith('V(E_') for branch in graph.branches
                 if branch.characteristic is not None for name in branch.characteristic.of)
    return compile_numeric(graph, outputs, chained=series)


def _outputs(edited: EditedNetwork) -> tuple[str, ...]:
    left, right = (edited.counted.get(letter, axle.name)
                   for letter, axle in axles(edited.graph, 'both'))
    return (f'omega({left})', f'omega({right})', 'v(M_H)', 'omega(J_H)', 'i(L_1)', 'i(L_2)')


def _sided(space: StateSpace, ratio: float) -> StateSpace:
    # The same voltage does more on the left than on the right by a ratio.
    if ratio == 1.0:
        return space
    sides = np.array([math.sqrt(ratio), 1.0 / math.sqrt(ratio)])
    return replace(space, B=space.B * sides, D=space.D * sides, K=space.K * sides)


class _Regime:
    """One network, analysed; gives a :class:`PlantSet` for numbers."""

    def __init__(self, edited: EditedNetwork, renamed: Mapping[str, str]) -> None:
        self.edited = edited
        self._renamed = dict(renamed)
        self.numeric: NumericModel = _numeric(edited.graph, _outputs(edited))
        rows = [edited.laws[name] for name in self.numeric.efforts]
        self._laws = np.array([int(row.law) for row in rows], dtype=np.int64)
        self._places = [(j, i) for j, row in enumerate(rows) for i in range(len(row.coefficients))]
        self._code = compile_tuple(tuple(str(c) for row in rows for c in row.coefficients))
        counts = [len(branch_of(edited.graph, name).characteristic.of)  # type: ignore[union-attr]
                  for name in self.numeric.efforts]
        self._offsets = np.cumsum([0, *counts], dtype=np.int64)[:-1]
        self._motors = np.array([row.motor for row in rows], dtype=float)
        self._felt = np.array([row.felt for row in rows], dtype=float)
        self._volts = np.zeros((2, len(rows)))
        for j, name in enumerate(self.numeric.efforts):
            if name.startswith('E_'):
                self._volts[0 if name.endswith('_1') else 1, j] = 1.0

    def at(self, values: Mapping[str, float]) -> PlantSet:
        # Names of functions are looked for among the parameters first: in a dict, for speed.
        values = dict(values)
        values.update({name: values[own] for name, own in self._renamed.items()})
        space: StateSpace = _sided(self.numeric.at(values), values['side_gain_ratio'])
        coefficients = np.zeros((self._laws.size, WIDTH))
        coefficients[:, MOTOR] = self._motors
        numbers = eval(self._code, dict(GLOBALS), values)  # noqa: S307 (our own expressions)
        for place, number in zip(self._places, numbers, strict=True):
            coefficients[place] = number
        forward = space.C[2]
        rows = np.vstack([space.C, forward @ space.A, np.zeros((2, space.A.shape[0]))])
        rows_u = np.vstack([space.D, forward @ space.B, np.eye(2)])
        # An accelerometer gives specific force: it does not feel gravity's pull along a slope.
        rows_f = np.vstack([space.L_c, self._felt * (forward @ space.G), self._volts])
        volts = values['supply_voltage'] * values['command_gain']
        command = CommandStage(volts, volts * values['turn_ratio'], values['supply_voltage'])
        command = replace(command, **{
            name: values[key] for name, key in self.edited.command.items()})
        sensors = SensorModel(**{
            name: values[key] for name, key in self.edited.sensors.items()})
        plant = PlantSet(space.A, space.B, space.G, space.H, space.K, rows, rows_u, rows_f,
                         self._laws, self._offsets, coefficients, command, sensors)
        if self.edited.speed_loop:
            plant = close_speed_loop(plant, values)
        if self.edited.command_lag:
            plant = smooth_commands(plant, values[self.edited.command_lag])
        return plant

    @property
    def states(self) -> tuple[str, ...]:
        """States of the graph and of what controls it."""
        return (tuple(self.numeric.states) + (LOOP_STATES if self.edited.speed_loop else ())
                + (LAG_STATES if self.edited.command_lag else ()))


@dataclass(frozen=True)
class HuskyModel:
    """
    A structure whose equations are derived; numbers are put in by :meth:`at`.

    Parameters
    ----------
    structure : Structure
    regimes : tuple
        The derived networks, without and with the late effects.

    """

    structure: Structure
    regimes: tuple[_Regime, ...]

    def at(self, parameters: Parameters) -> Plant:
        """
        Put numbers in.

        Parameters
        ----------
        parameters : Parameters
            Must hold every name that the structure uses.

        Returns
        -------
        Plant

        Raises
        ------
        ParameterError
            If a parameter is missing.

        """
        try:
            sets = tuple(regime.at(parameters) for regime in self.regimes)
        except (NameError, KeyError) as error:
            name = error.name if isinstance(error, NameError) else error.args[0]
            raise ParameterError(
                f'parameter {name!r} is missing; the structure needs it') from error
        return Plant(sets, self.regimes[0].states, self.structure.onset)


def _regime(structure: Structure) -> _Regime:
    renamed: dict[str, str] = {}
    for effect in structure.in_force():
        renamed.update(effect.renamed)
    return _Regime(structure.network(), renamed)


@lru_cache(maxsize=512)
def _compiled(drivetrain: Drivetrain, effects: tuple[Effect, ...]) -> tuple[_Regime, ...]:
    marked = Structure(drivetrain, tuple(replace(e, late=False) for e in effects))
    regimes = [_regime(marked)]
    if any(effect.late for effect in effects):
        early = Structure(drivetrain, tuple(e for e in effects if not e.late))
        regimes.insert(0, _regime(early))
        # States of the graph may have other names behind an onset.
        kinds = [(len(one.numeric.states), one.edited.speed_loop, one.edited.command_lag)
                 for one in regimes]
        if kinds[0] != kinds[1]:
            raise ParameterError('an effect with an onset may not add states: '
                                 f'{", ".join(always_on())} are always active')
    return tuple(regimes)


def compile_model(structure: Structure) -> HuskyModel:
    """
    Derive the equations of a structure.

    Parameters
    ----------
    structure : Structure
        Drivetrain, effects and onset.

    Returns
    -------
    HuskyModel
        The graph analysis is kept for structures that differ only in the onset's value.

    Raises
    ------
    GraphError
        If the edited graph cannot be derived.
    ParameterError
        If the effects do not fit the structure.

    """
    return HuskyModel(structure, _compiled(structure.drivetrain, structure.effects))
