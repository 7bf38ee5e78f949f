# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Named characteristics: laws of friction, drag and mixing with their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.expressions import parse, substituted


@dataclass(frozen=True)
class Law:
    """
    A law in arguments z1, z2, ... and parameters p1, p2, ...

    Parameters
    ----------
    expression : str
        The law.
    arguments, parameters : tuple of str
        What each of them is, in their order.
    about : str
        What it is, with its source.

    """

    expression: str
    arguments: tuple[str, ...]
    parameters: tuple[str, ...]
    about: str


_SPEED = ('sliding speed',)
LAWS: Mapping[str, Law] = {
    'proportional': Law('p1*z1', ('any variable',), ('gain',),
                        'a source that follows a variable (an amplifier)'),
    'coulomb': Law('p1*tanh(z1/p2)', _SPEED,
                   ('dry friction', 'speed over which it is smoothed'), 'Coulomb friction'),
    'viscous_coulomb': Law(
        'p1*z1 + p2*tanh(z1/p3)', _SPEED,
        ('damping', 'dry friction', 'speed over which it is smoothed'),
        'viscous and Coulomb friction'),
    'stribeck': Law(
        '(p1 + (p2 - p1)*exp(-(z1/p3)**2))*tanh(z1/p4)', _SPEED,
        ('dry friction', 'breakaway friction', 'Stribeck speed',
         'speed over which it is smoothed'), 'friction that is larger at the beginning'),
    'quadratic': Law('p1*z1*abs(z1)', ('speed or flow',), ('drag over the square of z1',),
                     'turbulent drag, or pressure lost by a turbulent flow'),
    'orifice': Law(
        'p1*z1/sqrt(abs(z1) + p2)', ('pressure drop',),
        ('flow over the square root of pressure', 'pressure below which it is smoothed'),
        'flow through an orifice'),
    'diode': Law('p1*(exp(z1/p2) - 1)', ('voltage',),
                 ('saturation current', 'thermal voltage times ideality'), 'Shockley diode'),
    'cubic': Law('p1*z1 + p2*z1**3', ('any variable',),
                 ('slope at zero', 'factor of the cube'), 'what becomes stiffer'),
    'saturation': Law('p1*tanh(z1/p1)', ('any variable',), ('largest value',),
                      'unit slope with a limit'),
    'product': Law('p1*z1*z2', ('any variable', 'any variable'), ('gain',),
                   'a variable that another one modulates'),
}


def expression_of(law: str, arguments: int, parameters: tuple[str, ...]) -> str:
    """
    Return a law as an expression in z1, z2, ... and the given parameters.

    Raises
    ------
    GraphError
        If a named law takes another number of arguments or parameters, or the text is neither
        the name of a law nor an expression.

    """
    known = LAWS.get(law)
    if known is None:
        try:
            parse(law)
        except GraphError as error:
            raise GraphError(f'law {law!r} is neither one of {", ".join(LAWS)} nor an expression: '
                             f'{error}') from error
        return substituted(law, {'z': 'z1'})
    if (len(known.arguments), len(known.parameters)) != (arguments, len(parameters)):
        raise GraphError(
            f'law {law!r} takes {len(known.arguments)} argument(s) in of '
            f'({listed("z", known.arguments)}) and {len(known.parameters)} parameter(s) '
            f'({listed("p", known.parameters)}), not {arguments} and {len(parameters)}')
    return substituted(known.expression, {
        f'p{index + 1}': name for index, name in enumerate(parameters)})


def listed(letter: str, meanings: tuple[str, ...]) -> str:
    """Return what arguments (z) or parameters (p) of a law are, in their order."""
    return ', '.join(f'{letter}{at}: {meaning}' for at, meaning in enumerate(meanings, 1))
