# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Physics without a name: a missing effort as a smooth function of one quantity.

Every description is a modulated source of the graph whose law is a table of nine knots. Its
columns are screened like those of the catalogue; what counts is the gain on blocks that were not
fitted. A description that explains much more than the named effects do says that something is
missing which is none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import itertools
import math

from lg_husky_sim.diagnosis.candidates import Candidate, still_open
from lg_husky_sim.diagnosis.evidence import FOLDS, folds_of, held_out_cost
from lg_husky_sim.diagnosis.fits import extras_of, Fit, fit_structure, shared_metric
from lg_husky_sim.diagnosis.screening import Projector, Signature, signatures_of
from lg_husky_sim.husky.effects import descriptions, Effect, Onset
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, PERIOD, simulate_piece
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.kernel import COLUMNS
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np

#: Column of the simulator that gives the range of an argument.
_SOURCE = {'forward': 'forward', 'yaw': 'yaw_rate', 'x': 'x', 'y': 'y',
           'wheel_rate': 'wheel_left', 'voltage': 'voltage_left'}
#: Size of a knot when its column is taken, by the effect.
_SIZE = {'smooth_force': 5.0, 'smooth_moment': 1.0, 'smooth_torque': 0.5, 'smooth_voltage': 0.5}
_PERIODIC = ('heading', 'angle', 'angle_left', 'angle_right')
#: Descriptions of a change that are compared with earlier recordings, from which gain on [nats],
#: and by how much they must explain more than in earlier ones, and than if always there.
FIRST, LEAST, PLACEBO, ALWAYS = 3, 85.0, 2.0, 1.5
#: Descriptions that are confirmed at most, and from which gain on [nats].
ASKED, WORTH = 6, 40.0
#: Steps of a refit with a description.
STEPS = 16
KNOTS = tuple(f'knot_{i}' for i in range(1, 10))


@dataclass(frozen=True, eq=False)
class Description:
    """
    A smooth effort and what it explains.

    Parameters
    ----------
    effect : Effect
        Of ``descriptions()``.
    held_out : float
        Gain on blocks that were not fitted [nats].
    energy : float
        Scaled sum of squares that is left with it.
    knots : tuple of float
        Values at the knots [unit of the effort].
    range : tuple of float
        First and last knot [unit of the argument].
    onset : Onset or None
        Where it begins, if a change between recordings was asked for.
    confirmed : float
        Held-out gain under a metric that takes all but this description for noise [nats]: what a
        rough floor shakes slowly looks like many smooth functions, and is none of them. 0 where
        it is not counted.
    """

    effect: Effect
    held_out: float
    energy: float
    knots: tuple[float, ...]
    range: tuple[float, float]  # noqa: A003
    onset: Onset | None = None
    confirmed: float = 0.0

    @property
    def argument(self) -> str:
        """Quantity that it is a function of."""
        return self.effect.shape


def ranges(observations: Observations, plant: Plant) -> dict[str, tuple[float, float]]:
    """
    Return the range of every argument in a simulation of the data.

    Parameters
    ----------
    observations : Observations
    plant : Plant

    Returns
    -------
    dict of str to (float, float)
        Robust lowest and highest value.
    """
    simulator = Simulator(observations.plant_in(plant, observations.recordings[-1]), PERIOD,
                          fine_pose=False)
    rows = np.vstack([simulate_piece(simulator, piece) for piece in observations.pieces])
    found = dict.fromkeys(_PERIODIC, (0.0, 2.0 * math.pi))
    for argument, column in _SOURCE.items():
        low, high = np.quantile(rows[:, COLUMNS.index(column)], [0.005, 0.995])
        found[argument] = (float(low), float(max(high, low + 1e-3)))
    found['time'] = (float(observations.times.min()), float(observations.times.max()))
    return found


def description_signatures(observations: Observations, structure: Structure,
                           parameters: Parameters, extra: dict[str, float], plant: Plant,
                           base: FloatArray) -> list[Signature]:
    """
    Return the signatures of all descriptions, one column a knot.

    Parameters
    ----------
    observations : Observations
    structure, parameters, extra, plant
        A fitted model.
    base : numpy.ndarray, shape (n_values,)
        Its prediction.

    Returns
    -------
    list of Signature
        None where the model has a description already: all have the same knots.
    """
    spans = ranges(observations, plant)
    pool = []
    for name, kind in descriptions().items():
        for side, shape in itertools.product(kind.sides, kind.shapes):
            low, high = spans[shape]
            start = dict.fromkeys(KNOTS, _SIZE[name])
            pool.append(Candidate(Effect(name, side, shape),
                                  ({**start, 'range_low': low, 'range_high': high},), True))
    return [signature for candidate in still_open(pool, structure) for signature in signatures_of(
        candidate, structure, parameters, extra, observations, base)]


def describe(observations: Observations, signatures: Sequence[Signature], projector: Projector,
             residual: FloatArray, jacobian: FloatArray, folds: FloatArray, count: int
             ) -> tuple[Description, ...]:
    """
    Rank descriptions by what they explain of held-out blocks.

    Parameters
    ----------
    observations : Observations
    signatures : sequence of Signature
        Of :func:`description_signatures`.
    projector : Projector
        Of the fitted model, under a metric for which the signatures are no noise.
    residual : numpy.ndarray, shape (n_values,)
        Of the fitted model.
    jacobian : numpy.ndarray, shape (n_values, n_unknowns)
        Of the same: its unknowns move with the description.
    folds : numpy.ndarray, shape (n_values,)
        Fold of each value.
    count : int
        Number of folds.

    Returns
    -------
    tuple of Description
        Largest held-out gain first.
    """
    found = []
    target = projector.residual[:projector.size]
    scale = projector.metric.scale
    for signature in signatures:
        columns = projector.projected(signature.columns)[:projector.size]
        held_out = 0.0
        for fold in range(count):
            out = folds == fold
            weights = ridge(columns[~out], target[~out])
            left = target[out] - columns[out] @ weights
            held_out += 0.5 * float(target[out] @ target[out] - left @ left)
        weights = ridge(columns, target)
        left = residual - signature.columns @ weights
        left = (left - jacobian @ projector.recalibrated(left)) * scale
        names = [n for n in signature.start if n in KNOTS]
        knots = tuple(float(w) * signature.start[n] for w, n in zip(weights, names, strict=True))
        found.append(Description(
            signature.candidate.effect, held_out, float(np.sum(np.minimum(left ** 2, 1e6))),
            knots, (signature.start['range_low'], signature.start['range_high'])))
    return tuple(sorted(found, key=lambda d: -d.held_out))


def ridge(columns: FloatArray, target: FloatArray) -> FloatArray:
    """Return coefficients of columns with a small ridge, shape (n_columns,)."""
    gram = columns.T @ columns
    lift = 1e-3 * float(np.trace(gram)) / gram.shape[0] + 1e-9
    weights: FloatArray = np.linalg.solve(gram + lift * np.eye(gram.shape[0]),
                                          columns.T @ target)
    return weights


@dataclass(frozen=True, eq=False)
class Unnamed:
    """
    What smooth descriptions explain on top of a fit.

    Parameters
    ----------
    descriptions : tuple of Description
        Best first.
    energy : float
        Scaled sum of squares before [sensor noise per value, summed].
    count : int
        Values.
    metric : Metric
        Under which it was counted.
    """

    descriptions: tuple[Description, ...]
    energy: float
    count: int
    metric: Metric

    @property
    def share(self) -> float:
        """Share of the unexplained energy that the best description explains."""
        return self.share_of(self.descriptions[0]) if self.descriptions else 0.0

    def share_of(self, description: Description) -> float:
        """Return the share of the unexplained energy that a description explains."""
        return (self.energy - description.energy) / max(self.energy - 0.5 * self.count, 1e-9)

    def refitted(self, fit: Fit, description: Description) -> Unnamed:
        """Return the same with the knots that one of the descriptions has in a fit."""
        knots = tuple(fit.parameters[name] for name in KNOTS)
        return replace(self, descriptions=tuple(
            replace(one, knots=knots) if one is description else one
            for one in self.descriptions))

    @property
    def held_out(self) -> float:
        """Held-out gain of the best description [nats]; 0 without one."""
        return self.descriptions[0].held_out if self.descriptions else 0.0

    @property
    def confirmed(self) -> float:
        """Largest confirmed gain of a description [nats]; 0 without one."""
        return max((d.confirmed for d in self.descriptions), default=0.0)


def look_for_unnamed(observations: Observations, fit: Fit, change: Onset | None = None
                     ) -> Unnamed:
    """
    Rank smooth descriptions on top of a fit.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    change : Onset, optional
        The beginning of the later recordings, if a change was asked for: efforts that begin there
        are described then, and only the first few that explain more than they would if switched
        on in earlier recordings instead, or in all.

    Returns
    -------
    Unnamed
    """
    plant = compile_model(fit.structure).at(fit.parameters)
    signatures = description_signatures(observations, fit.structure, fit.parameters,
                                        extras_of(fit), plant, fit.solution.predicted)
    if change is not None:
        whole = signatures
        signatures = switched(observations, whole, change)
    metric = shared_metric(observations, fit, signatures)
    unknowns = fit.solution.unknowns
    deviations = np.array([u.deviation for u in unknowns])
    pull = np.array([(u.centre - u.varied(fit.solution.values[u.name])) / u.deviation
                     for u in unknowns])
    residual = observations.measured - fit.solution.predicted
    jacobian, folds = fit.solution.jacobian, folds_of(observations)
    projector = Projector(observations, metric, residual, jacobian, deviations, pull)

    def ranking(shown: Sequence[Signature], under: Projector = projector
                ) -> tuple[Description, ...]:
        return describe(observations, shown, under, residual, jacobian, folds, FOLDS)
    ranked = ranking(signatures)
    if change is not None:
        ranked = beyond_placebo(observations, ranked, whole, change, ranking)
    else:
        by_effect = {s.candidate.effect: s for s in signatures}
        for i, one in enumerate(d for d in ranked[:ASKED] if d.held_out > WORTH):
            own = by_effect[one.effect]
            under = Projector(observations, shared_metric(observations, fit, [own]), residual,
                              jacobian, deviations, pull)
            confirmed = ranking([own], under)[0].held_out
            ranked = (*ranked[:i], replace(one, confirmed=confirmed), *ranked[i + 1:])
    left = (residual - jacobian @ projector.recalibrated(residual)) * metric.scale
    return Unnamed(ranked, float(np.sum(np.minimum(left ** 2, 1e6))),
                   int(np.count_nonzero(metric.scale)), metric)


def beyond_placebo(observations: Observations, ranked: Sequence[Description],
                   signatures: Sequence[Signature], change: Onset,
                   ranking: Callable[[Sequence[Signature]], tuple[Description, ...]]
                   ) -> tuple[Description, ...]:
    """
    Keep the first few descriptions that explain more since a change than if it were another one.

    Parameters
    ----------
    observations : Observations
    ranked : sequence of Description
        Efforts that begin with the later recordings, best first.
    signatures : sequence of Signature
        The same efforts, on in all recordings.
    change : Onset
    ranking : callable
        Ranks what some signatures describe.

    Returns
    -------
    tuple of Description
        Each with its onset.
    """
    earlier = observations.recordings[:observations.recordings.index(change.recording)]
    beyond = []
    for one in [d for d in ranked[:FIRST] if d.held_out > LEAST]:
        own = [s for s in signatures if s.candidate.effect == one.effect]
        placebo = sum(max(ranking(switched(observations, own, change, name))[0].held_out, 0.0)
                      for name in earlier)
        always = ranking(own)[0].held_out
        if one.held_out > max(PLACEBO * placebo, ALWAYS * always):
            beyond.append(replace(one, effect=replace(one.effect, late=True), onset=change))
    return tuple(beyond)


def switched(observations: Observations, signatures: Sequence[Signature], change: Onset,
             only: str = '') -> list[Signature]:
    """
    Return signatures that are on in some recordings only.

    Parameters
    ----------
    observations : Observations
    signatures : sequence of Signature
    change : Onset
        The beginning of the later recordings.
    only : str
        The one recording in which they are on; all later ones where it is empty.

    Returns
    -------
    list of Signature
    """
    names = observations.recordings
    chosen = {only} if only else set(names[names.index(change.recording):])
    on = np.zeros(observations.measured.size)
    for one in observations.slices:
        on[one.first:one.last] = observations.pieces[one.piece].recording in chosen
    return [replace(s, columns=s.columns * on[:, None]) for s in signatures]


def described(observations: Observations, fit: Fit, nominal: Parameters, unnamed: Unnamed,
              description: Description) -> Fit | None:
    """
    Put a description into a model and refit both.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        That lacks something.
    nominal : Parameters
    unnamed : Unnamed
        What was looked at on top of it.
    description : Description
        One of these.

    Returns
    -------
    Fit or None
        None where the model predicts held-out data no better than before.
    """
    values = dict(zip(KNOTS, description.knots, strict=True))
    values['range_low'], values['range_high'] = description.range
    kind = description.effect.kind
    values = {p.name: min(max(values[p.name], p.lower), p.upper) for p in kind.parameters}
    size = max(abs(v) for v in description.knots)
    again = fit_structure(
        observations, fit.structure.with_effect(description.effect, description.onset), nominal,
        unnamed.metric, {**fit.solution.values, **values},
        {**fit.parameters, **dict.fromkeys(KNOTS, size), 'range_low': values['range_low'],
         'range_high': values['range_high']}, STEPS)
    folds = folds_of(observations)
    if again is None or not np.sum(held_out_cost(observations, again, unnamed.metric, folds)) < (
            np.sum(held_out_cost(observations, fit, unnamed.metric, folds))):
        return None
    return again
