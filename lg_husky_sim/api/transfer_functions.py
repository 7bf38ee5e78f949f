# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Transfer functions in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, TYPE_CHECKING
import warnings

from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.extras import require
from lg_husky_sim.linear_graph.transfer import STANDING
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.modes import StepFigures

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

NOT_REAL = 1e-12
"""Imaginary part, relative to the modulus, below which a root is printed as a real one."""
_POWERS = str.maketrans('0123456789', '⁰¹²³⁴⁵⁶⁷⁸⁹')


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """
    Output over input in numbers, common factors cancelled.

    Parameters
    ----------
    output, source : str
        Names.
    unit : str
        Of the output over the input; '' if it has none.
    numerator, denominator : numpy.ndarray
        Coefficients, highest power of s first; the denominator's first is 1.
    zeros, poles : numpy.ndarray of complex
        [1/s], fastest first.
    left_out : str
        What it is without, as it is not linear; '' for nothing.

    """

    output: str
    source: str
    unit: str
    numerator: FloatArray
    denominator: FloatArray
    zeros: ComplexArray
    poles: ComplexArray
    left_out: str = ''

    @property
    def gain(self) -> float:
        """Return the factor before the product of all (s - zero) over that of all (s - pole)."""
        return float(self.numerator[0])

    @property
    def dc_gain(self) -> float:
        """Return the value at s = 0; infinite with a pole there."""
        above, below = float(self.numerator[-1]), float(self.denominator[-1])
        return above / below + 0.0 if below else float(np.copysign(np.inf, above))     # no -0

    @property
    def final_value(self) -> float:
        """Return what the response to a unit step settles at; NaN if it does not."""
        settles = (self.poles.real < -STANDING * np.abs(self.poles)).all()
        return self.dc_gain if settles else float('nan')

    def step_figures(self, end: float) -> StepFigures:
        """Return the figures of a step response; where it does not settle, until a time [s]."""
        from lg_husky_sim.linear_graph.modes import step_figures, step_modes
        modes = step_modes(self.numerator[0], self.zeros, self.poles)
        return step_figures(modes, self.final_value, end)

    def __call__(self, s: Any) -> Any:
        """Return the value at a complex frequency, or at each of an array of them [1/s]."""
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)

    @property
    def expr(self) -> Any:
        """Return the fraction as a ``sympy.Expr`` in ``s``, with floating-point coefficients."""
        from lg_husky_sim.linear_graph.transfer import expression
        return expression(self.numerator, self.denominator)

    def to_control(self) -> Any:
        """Return it as a python-control ``TransferFunction``."""
        require('control', 'make a python-control system')
        import control
        warn_of(self.left_out)
        # control takes no dots in names
        return control.tf(self.numerator, self.denominator,
                          outputs=[self.output.replace('.', '_')], inputs=[self.source])

    def to_scipy(self) -> Any:
        """Return it as a ``scipy.signal.TransferFunction``."""
        from scipy.signal import TransferFunction as Scipys
        warn_of(self.left_out)
        return Scipys(self.numerator, self.denominator)

    def table(self) -> Table:
        """Return poles and zeros with natural frequency, damping ratio and time constant."""
        rows = []
        for kind, roots in (('pole', self.poles), ('zero', self.zeros)):
            for root in roots:
                size = abs(root)
                rows.append((kind, root_text(root), float(size),
                             float(0.0 - root.real / size) if size else None,
                             float(-1.0 / root.real) if root.real else None))
        return Table('', ('', 'value [1/s]', 'natural frequency [rad/s]', 'damping ratio',
                          'time constant [s]'), tuple(rows))

    def to_pandas(self) -> Any:
        """Return poles and zeros as a pandas DataFrame."""
        return self.table().to_pandas()

    def __str__(self) -> str:
        """Return the fraction as text, and poles and zeros below."""
        above, below = polynomial_text(self.numerator), polynomial_text(self.denominator)
        width = max(len(above), len(below)) + 2
        lines = [above.center(width).rstrip(), '-' * width, below.center(width).rstrip()]
        if len(self.denominator) == 1:
            lines = [above]
        table = [str(self.table())] * bool(len(self.poles) + len(self.zeros))
        return '\n'.join([self._title, *[self.left_out] * bool(self.left_out),
                          *(f'  {line}' for line in lines), self._dc, *table])

    __repr__ = __str__

    @property
    def _title(self) -> str:
        return f'{self.output} over {self.source}' + (f' [{self.unit}]' if self.unit else '')

    @property
    def _dc(self) -> str:
        return f'DC gain: {self.dc_gain:.6g}'

    def _repr_html_(self) -> str:
        above, below = (escape(polynomial_text(one)) for one in (self.numerator, self.denominator))
        fraction = ('<div style="display:inline-block;text-align:center">'
                    f'<div style="border-bottom:1px solid">{above}</div><div>{below}</div></div>')
        head = page_part(self._title, [self.left_out] * bool(self.left_out), [])
        return f'{head}{fraction}' + page_part(
            '', [self._dc], [self.table()]).replace('<h4></h4>', '')


def warn_of(left_out: str) -> None:
    """Warn the caller's caller of what an answer that cannot say so is without."""
    if left_out:
        warnings.warn(left_out, stacklevel=3)


def root_text(root: complex) -> str:
    """Return a root with six digits, a real one without its imaginary part."""
    if abs(root.imag) <= NOT_REAL * abs(root):
        return f'{root.real:.6g}'
    return f'{root.real:.6g} {"-" if root.imag < 0 else "+"} {abs(root.imag):.6g}j'


def polynomial_text(coefficients: Sequence[float] | FloatArray) -> str:
    """Return a polynomial in s with six digits, such as ``s² + 250.1 s + 1275``."""
    text = ''
    degree = len(coefficients) - 1
    for power, value in zip(range(degree, -1, -1), map(float, coefficients), strict=True):
        if value == 0.0 and degree:
            continue
        number = f'{abs(value):.6g}' if abs(value) != 1.0 or power == 0 else ''
        variable = {0: '', 1: 's'}.get(power, f's{str(power).translate(_POWERS)}')
        text += (' - ' if value < 0.0 else ' + ') + ' '.join(filter(None, (number, variable)))
    return text[3:] if text.startswith(' + ') else f'-{text[3:]}'
