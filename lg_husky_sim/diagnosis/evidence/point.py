# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A structure with numbers for the unknowns of the robot, of its effects and of the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import start_of, Unknown, values_of
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
import numpy as np


@dataclass(frozen=True, eq=False)
class Point:
    """
    A structure with numbers: what is simulated.

    Parameters
    ----------
    structure : Structure
    unknowns : tuple of Unknown
    places : numpy.ndarray, shape (k,)
        Of the unknowns on their scales.
    parameters : Parameters
        Of the model and of its effects; the unknowns' values replace theirs.
    reading : Reading
        How the log was made.

    """

    structure: Structure
    unknowns: tuple[Unknown, ...]
    places: FloatArray
    parameters: Parameters
    reading: Reading

    @property
    def values(self) -> dict[str, float]:
        """Numbers of the model and its effects, by name."""
        return values_of(self.unknowns, self.places, 'model') | values_of(
            self.unknowns, self.places, 'effect')

    @cached_property
    def numbers(self) -> Parameters:
        """Parameters with the values of the unknowns."""
        return self.parameters.replacing({
            name: min(max(value, self.parameters.entry(name).lower),
                      self.parameters.entry(name).upper)
            for name, value in self.values.items()})

    @cached_property
    def plant(self) -> Plant:
        """Return the plant with these numbers."""
        return compile_model(self.structure).at(self.numbers)

    @cached_property
    def log(self) -> Reading:
        """How the log was made, with the values of the unknowns."""
        return self.reading.replacing(values_of(self.unknowns, self.places, 'log'))

    @cached_property
    def delays(self) -> dict[str, str]:
        """Delays of the log that numbers of effects do the same as, by these numbers' names."""
        return {p.name: p.delays[e.shape] for e in self.structure.effects
                for p in e.parameters() if e.shape in p.delays and not e.late}

    @cached_property
    def prior_residuals(self) -> FloatArray:
        """Distances of the unknowns from the centres of their priors, in deviations."""
        centre = np.array([u.centre for u in self.unknowns])
        found: FloatArray = (self.places - centre) * self.weights
        return found

    @cached_property
    def weights(self) -> FloatArray:
        """One over the deviations of the priors."""
        return np.array([1.0 / u.deviation for u in self.unknowns])

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and largest places of the unknowns."""
        return (np.array([u.lower for u in self.unknowns]),
                np.array([u.upper for u in self.unknowns]))

    def at(self, places: FloatArray) -> Point:
        """Return this structure at other places, inside the bounds."""
        return replace(self, places=np.clip(places, *self.bounds))


def beginning(structure: Structure, unknowns: Sequence[Unknown], parameters: Parameters,
              reading: Reading) -> Point:
    """Return a structure at the centres of its priors."""
    return Point(structure, tuple(unknowns), start_of(unknowns), parameters, reading)
