# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A state-space model for other tools: JSON, MATLAB, NumPy, C, LaTeX, Python, control, scipy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import json
import os
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.extras import require
from lg_husky_sim.folders import check_marked, scratch_beside, signed
from lg_husky_sim.linear_graph.state_space import equation_forms, FloatArray, MATRICES, StateSpace
import numpy as np

SCHEMA = 'lg_husky_sim/state_space/1'
_NAMES = ('states', 'inputs', 'outputs', 'efforts', 'arguments')


def used_matrices(space: StateSpace) -> dict[str, FloatArray]:
    """Return A, B, C, D, and of the others those that are not zero."""
    found: dict[str, FloatArray] = {}
    for name in MATRICES:
        matrix: FloatArray = getattr(space, name)
        if name in 'ABCD' or (matrix.size and matrix.any()):
            found[name] = matrix
    return found


def linear(space: StateSpace) -> StateSpace:
    """
    Return a model that A, B, C and D hold whole, but for laws that are not linear.

    Where a state is x - E u, it is called so, such as ``V(C_1) - E u``.

    Raises
    ------
    SettingsError
        If the outputs depend on the rate of change of an input: such a model is not proper.

    """
    proper = space.standard_form()
    if proper.F.any():
        raise SettingsError(
            'outputs depend on the rate of change of an input (matrix F is not zero); only .json, '
            '.mat and .npz can hold such a model')
    return replace(proper, states=tuple(
        f'{name} - E u' if space.E[at].any() else name for at, name in enumerate(space.states)))


def _shifted(space: StateSpace) -> list[str]:
    """Say of each state of the standard form that is not x what it is, in numbers."""
    found = []
    for name, row in zip(space.states, space.E, strict=True):
        terms = ''.join(f' {"+" if value < 0.0 else "-"} {float(abs(value))!r} {source}'
                        for value, source in zip(row, space.inputs, strict=True) if value != 0.0)
        found += [f'{name} - E u = {name}{terms}'] * bool(terms)
    return found


def _with_input(space: StateSpace) -> StateSpace:
    if space.inputs:
        return space
    return replace(space, inputs=('none',), B=np.zeros((len(space.states), 1)),
                   D=np.zeros((len(space.outputs), 1)))


def _label(names: Sequence[str]) -> list[str]:
    """Return names that python-control takes: it has no dots in them."""
    found: list[str] = []
    for name in names:
        label = name.replace('.', '_')
        while label in found or (label != name and label in names):
            label += '_'
        found.append(label)
    return found


def to_control(space: StateSpace) -> Any:
    """
    Return the linear part as a python-control ``StateSpace``, with its names.

    Ports are called ``Q(ram_1)`` in place of ``Q(ram.1)``: control allows no dots. It needs an
    input, too: a model without gets one of zeros, called ``none``.

    Raises
    ------
    MissingExtraError
        If python-control is not installed.
    SettingsError
        If the model is not proper.

    """
    require('control', 'make a python-control system')
    import control

    own = _with_input(linear(space))
    return control.ss(own.A, own.B, own.C, own.D, states=_label(own.states),
                      inputs=_label(own.inputs), outputs=_label(own.outputs))


def to_scipy(space: StateSpace) -> Any:
    """
    Return the linear part as a ``scipy.signal.StateSpace``.

    Raises
    ------
    SettingsError
        If the model is not proper.

    """
    from scipy.signal import StateSpace as Linear

    own = linear(space)
    return Linear(own.A, own.B, own.C, own.D)


def export(space: StateSpace, path: str | os.PathLike[str], name: str = 'model',
           parameters: Mapping[str, float] | None = None) -> Path:
    """
    Write a state-space model; the file's ending chooses the format.

    Parameters
    ----------
    space : StateSpace
        Matrices, with the names of states, inputs and outputs.
    path : path-like
        .json, .mat (MATLAB 5), .npz (NumPy), .h (C), .tex (LaTeX, amsmath) or .py (a module that
        makes python-control and scipy objects). An export that is there is replaced, if nobody
        changed it.
    name : str
        Title.
    parameters : mapping of str to float, optional
        Numbers that went in [SI], for the record.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    SettingsError
        If the ending is unknown, or the format cannot hold the model.

    """
    place = Path(path)
    check_export(place)
    ending = place.suffix.lower()
    content = _WRITERS[ending](space, name, dict(parameters or {}), place.stem)
    if ending in _COMMENTS:
        content = signed(content.decode(), _COMMENTS[ending]).encode()
    with scratch_beside(place) as scratch:
        draft = scratch / place.name
        draft.write_bytes(content)
        os.replace(draft, place)
    return place


def check_export(path: Path) -> None:
    """
    Check that a model can be exported to a file of this name.

    Raises
    ------
    SettingsError
        If the ending is unknown, or something else than an export is there.

    """
    if path.suffix.lower() not in _WRITERS:
        raise SettingsError(f'cannot export to {path}: the ending must be one of '
                            f'{", ".join(_WRITERS)}')
    check_marked(path, SCHEMA, text=path.suffix.lower() in _COMMENTS)


def json_text(space: StateSpace, name: str, parameters: Mapping[str, float]) -> str:
    """Return a model as JSON, schema ``lg_husky_sim/state_space/1``."""
    data = {'schema': SCHEMA, 'name': name,
            'equations': ', '.join(equation_forms(space)),
            **{key: list(getattr(space, key)) for key in _NAMES},
            **{key: matrix.tolist() for key, matrix in used_matrices(space).items()},
            'parameters': dict(parameters)}
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + '\n'


def _as_json(space: StateSpace, name: str, parameters: Mapping[str, float], _: str) -> bytes:
    return json_text(space, name, parameters).encode()


def _as_mat(space: StateSpace, name: str, parameters: Mapping[str, float], _: str) -> bytes:
    from io import BytesIO

    from scipy.io import savemat

    stream = BytesIO()
    cells = {key: np.array(list(getattr(space, key)), dtype=object) for key in _NAMES
             if getattr(space, key)}
    savemat(stream, {'schema': SCHEMA, **used_matrices(space), **cells, 'name': name,
                     'parameters': dict(parameters) or np.zeros((0, 0))},
            long_field_names=True)
    return stream.getvalue()


def _as_npz(space: StateSpace, name: str, parameters: Mapping[str, float], _: str) -> bytes:
    from io import BytesIO

    stream = BytesIO()
    texts = {key: np.array(getattr(space, key), dtype=np.str_) for key in _NAMES}
    arrays: dict[str, Any] = {
        'schema': np.array(SCHEMA.encode()), **used_matrices(space), **texts,
        'name': np.array(name),
        'parameter_names': np.array(list(parameters), dtype=np.str_),
        'parameter_values': np.array(list(parameters.values()), dtype=np.float64)}
    np.savez(stream, **arrays)
    return stream.getvalue()


def _as_c(space: StateSpace, name: str, _: Mapping[str, float], stem: str) -> bytes:
    own = linear(space)
    prefix = re.sub(r'\W', '_', stem if stem[:1].isalpha() else f'model_{stem}', flags=re.ASCII)
    lines = [f'/* {_comment(name)}: dx/dt = A x + B u, y = C x + D u; SI units.',
             *(f' *   {letter}: {", ".join(names) or "none"}' for letter, names in
               (('x', own.states), ('u', own.inputs), ('y', own.outputs))),
             *(f' *   {line}' for line in _shifted(space)),
             *([f' * Non-linear laws are left out: {", ".join(own.efforts)}']
               if own.efforts else []),
             f' * Schema {SCHEMA}. */',
             f'#ifndef {prefix.upper()}_H', f'#define {prefix.upper()}_H', '']
    lines += [f'#define {prefix.upper()}_{word} {len(names)}' for word, names in
              (('STATES', own.states), ('INPUTS', own.inputs), ('OUTPUTS', own.outputs))]
    for key in 'ABCD':
        matrix = getattr(own, key)
        if not matrix.size:     # no array of C
            continue
        rows = ',\n'.join('    {' + ', '.join(repr(float(v)) for v in row) + '}'
                          for row in matrix)
        lines += ['', f'static const double {prefix}_{key}[{matrix.shape[0]}]'
                      f'[{matrix.shape[1]}] = {{', rows, '};']
    return '\n'.join([*lines, '', '#endif', '']).encode()


def _as_latex(space: StateSpace, name: str, _: Mapping[str, float], __: str) -> bytes:
    own = linear(space)
    left_out = [f'% Non-linear laws are left out: {", ".join(own.efforts)}'
                ] if own.efforts else []
    lines = [f'% {_comment(name)}; needs amsmath', f'% Schema {SCHEMA}',
             *(f'% {letter}: {", ".join(names) or "none"}' for letter, names in
               (('x', own.states), ('u', own.inputs), ('y', own.outputs))),
             *(f'% {line}' for line in _shifted(space)), *left_out]
    for key in (key for key in 'ABCD' if getattr(own, key).size):
        rows = ' \\\\\n'.join(' & '.join(latex_number(float(v)) for v in row)
                              for row in getattr(own, key))
        lines += [rf'\[ {key} = \begin{{bmatrix}}', rows, r'\end{bmatrix} \]']
    return ('\n'.join(lines) + '\n').encode()


def latex_number(value: float) -> str:
    r"""Return a number in full precision, such as ``2 \times 10^{-9}``."""
    digits, _, power = repr(value).partition('e')
    return rf'{digits} \times 10^{{{int(power)}}}' if power else digits


def _as_python(space: StateSpace, name: str, _: Mapping[str, float], __: str) -> bytes:
    own = _with_input(linear(space))
    left_out = f'\n\nNon-linear laws are left out: {", ".join(own.efforts)}.' if (
        own.efforts) else ''
    shifted = ''.join(f'\n\nThe state {line}.' for line in _shifted(space))
    matrices = '\n'.join(f'{key} = {_rows(getattr(own, key))}' for key in 'ABCD')
    names = '\n'.join(f'{key} = {_label(getattr(own, key))!r}' for key in _NAMES[:3])
    empty = '' if all(getattr(own, key).size for key in 'ABCD') else 'import numpy as np\n\n'
    return f'''"""
{_comment(name)}: dx/dt = A x + B u, y = C x + D u; SI units.{shifted}{left_out}

Schema {SCHEMA}.
"""

{empty}{names}
{matrices}


def control_system():
    """Return the model as a python-control StateSpace."""
    import control
    return control.ss(A, B, C, D, states=states, inputs=inputs, outputs=outputs)


def scipy_system():
    """Return the model as a scipy.signal.StateSpace."""
    from scipy.signal import StateSpace
    return StateSpace(A, B, C, D)
'''.encode()


def _rows(matrix: FloatArray) -> str:
    # A list of lists has no second size where it has no rows.
    return repr(matrix.tolist()) if matrix.size else f'np.zeros({matrix.shape!r})'


def _comment(text: str) -> str:
    # A title may come from a file: it must neither end the comment or docstring that it stands
    # in, nor begin one inside it.
    return re.sub(r'[\\"]|\*(?=/)|/(?=\*)', ' ', ' '.join(text.split()))


_WRITERS: Mapping[str, Callable[[StateSpace, str, Mapping[str, float], str], bytes]] = {
    '.json': _as_json, '.mat': _as_mat, '.npz': _as_npz, '.h': _as_c, '.tex': _as_latex,
    '.py': _as_python}
#: How a comment is written in those that people may write on.
_COMMENTS: Mapping[str, str] = {'.h': '/* {} */', '.tex': '% {}', '.py': '# {}'}
