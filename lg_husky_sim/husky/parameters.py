# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Physical parameters: values with unit, bounds, tolerance and source."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
import difflib
import math
from numbers import Real

from lg_husky_sim.errors import ParameterError, UnknownParameterError
from lg_husky_sim.yaml_files import shown


def number_of(name: str, value: object) -> float:
    """
    Return what a person gives as the value of a parameter.

    Raises
    ------
    ParameterError
        If it is no number.

    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ParameterError(f'{name} = {shown(value)} is not a number')
    try:
        return float(value)
    except OverflowError:
        return math.inf


@dataclass(frozen=True)
class Parameter:
    """
    One physical number.

    Parameters
    ----------
    name : str
        Full word, as in ``config/husky.yaml``.
    value : float
        In ``unit``.
    unit : str
        SI unit, ``'1'`` if none.
    lower, upper : float
        Bounds of the value, in ``unit``.
    source : str
        Where the value comes from.
    tolerance : float
        Relative uncertainty of a nominal value; 0 for an exact one.
    free : bool
        Whether an estimation varies it unless told otherwise.
    low, high : float or None
        95 % interval, where the value was estimated.

    Raises
    ------
    ParameterError
        If the value is not finite or outside its bounds, or the tolerance is negative.

    """

    name: str
    value: float
    unit: str
    lower: float
    upper: float
    source: str
    tolerance: float = 0.0
    free: bool = False
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        """Check the value against the bounds."""
        if not self.lower <= self.upper:
            raise ParameterError(
                f'{self.name}: lower bound {self.lower:g} is above upper bound {self.upper:g}')
        if not self.tolerance >= 0.0:
            raise ParameterError(f'{self.name}: tolerance = {self.tolerance:g} is negative')
        if not math.isfinite(self.value):
            raise ParameterError(f'{self.name} = {self.value} {self.unit} is not a finite number')
        if not self.lower <= self.value <= self.upper:
            side, bound = ('below its lower', self.lower) if self.value < self.lower else (
                'above its upper', self.upper)
            raise ParameterError(
                f'{self.name} = {self.value:g} {self.unit} is {side} bound {bound:g}')


@dataclass(frozen=True)
class Parameters(Mapping[str, float]):
    """
    A set of parameters; as a mapping it gives their values by name.

    Parameters
    ----------
    entries : tuple of Parameter
        In the order of the file; names are unique.

    """

    entries: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        """Index the names."""
        index = {entry.name: i for i, entry in enumerate(self.entries)}
        if len(index) != len(self.entries):
            raise ParameterError('a parameter is given twice: ' + ', '.join(sorted(
                {e.name for i, e in enumerate(self.entries) if index[e.name] != i})))
        object.__setattr__(self, '_index', index)
        object.__setattr__(self, '_values', {e.name: e.value for e in self.entries})

    def __getitem__(self, name: str) -> float:
        """Return the value of a parameter [its unit]."""
        values: dict[str, float] = self._values  # type: ignore[attr-defined]
        try:
            return values[name]
        except KeyError:
            raise self._unknown(name) from None

    def __contains__(self, name: object) -> bool:
        """Return whether there is a parameter of that name, without looking for near ones."""
        return name in self._index  # type: ignore[attr-defined]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._index)  # type: ignore[attr-defined]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.entries)

    def entry(self, name: str) -> Parameter:
        """
        Return one parameter with its unit, bounds and source.

        Raises
        ------
        UnknownParameterError
            If there is none of that name; a near name is suggested.

        """
        index: dict[str, int] = self._index  # type: ignore[attr-defined]
        if name not in index:
            raise self._unknown(name)
        return self.entries[index[name]]

    def _unknown(self, name: object) -> UnknownParameterError:
        near = difflib.get_close_matches(str(name), self, n=1)
        hint = f'; did you mean {near[0]}?' if near else ''
        return UnknownParameterError(
            f'unknown parameter {shown(name)}{hint} (known: {", ".join(self)})', str(name))

    def replacing(self, values: Mapping[str, float]) -> Parameters:
        """
        Return these parameters with other values.

        Parameters
        ----------
        values : mapping of str to float
            New values [unit of each].

        Raises
        ------
        ParameterError
            If a name is unknown, or a value is no number or outside its bounds.

        """
        changed = {name: replace(self.entry(name), value=number_of(name, value), low=None,
                                 high=None) for name, value in values.items()}
        return Parameters(tuple(changed.get(e.name, e) for e in self.entries))

    def with_entries(self, *entries: Parameter) -> Parameters:
        """Return these parameters with others added, or put in the place of their namesakes."""
        given = {entry.name: entry for entry in entries}
        kept = tuple(given.pop(e.name, e) for e in self.entries)
        return Parameters(kept + tuple(given.values()))
