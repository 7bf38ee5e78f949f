# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear graphs with their matrices, in symbols and in numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from numbers import Real
import os
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.api.responses import Responses
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.api.transfer_functions import warn_of
from lg_husky_sim.errors import GraphError, LgHuskyError, ModelFileError, ParameterError
from lg_husky_sim.linear_graph import (
    compile_numeric,
    derive,
    equation_forms,
    LinearGraph,
    StateSpace,
    SymbolicStateSpace,
)
from lg_husky_sim.linear_graph.netlist import (
    Netlist,
    netlist_of,
    parse_netlist,
    read_netlist,
)
from lg_husky_sim.yaml_files import shown

_ELEMENTS = re.compile(r'\belements\s*:')


class Graph(Responses):
    """
    A linear graph and the state-space model that follows from it.

    dx/dt = A x + B u + E du/dt + G f(z), y = C x + D u + F du/dt + L_c f(z), z = H x + K u + N f.
    E and F are zero unless an excess storage hangs on an input, G and what follows unless laws
    are not linear; ``repr(graph)`` says which there are. ``standard_form()`` of
    :attr:`symbolic` and of :meth:`numeric` makes E zero: the states become x - E u.

    Parameters
    ----------
    name : str
        Title.
    graph : LinearGraph
        Branches and two-ports.
    values : mapping of str to float
        Numbers of the parameters, SI; those that are missing stay symbols.
    outputs : sequence of str
        Variables to put out, such as ``'v(M_H)'``.
    note : str
        What to say of the matrices.
    source : str
        File that it comes from, for messages.

    """

    def __init__(self, name: str, graph: LinearGraph, values: Mapping[str, float],
                 outputs: Sequence[str] = (), note: str = '', source: str = '') -> None:
        """Keep what the matrices are derived from when they are first asked for."""
        self.name, self.graph, self.values = name, graph, dict(values)
        self.outputs, self.note, self.source = _listed(outputs), note, source

    @cached_property
    def symbolic(self) -> SymbolicStateSpace:
        """Return the model in symbols, each element's value under the element's own name."""
        with self._in_file():
            return derive(self.graph, self.outputs, by_element=True)

    @property
    def A(self) -> Any:
        """State matrix in symbols, a ``sympy.Matrix`` of shape (n, n)."""
        return self.symbolic.A

    @property
    def B(self) -> Any:
        """Input matrix in symbols, a ``sympy.Matrix`` of shape (n, m)."""
        return self.symbolic.B

    @property
    def C(self) -> Any:
        """Output matrix in symbols, a ``sympy.Matrix`` of shape (p, n)."""
        return self.symbolic.C

    @property
    def D(self) -> Any:
        """Feed-through in symbols, a ``sympy.Matrix`` of shape (p, m)."""
        return self.symbolic.D

    @property
    def E(self) -> Any:
        """State equations' matrix of du/dt in symbols, a ``sympy.Matrix`` of shape (n, m)."""
        return self.symbolic.E

    @property
    def F(self) -> Any:
        """Return the outputs' matrix of du/dt in symbols, a ``sympy.Matrix`` of shape (p, m)."""
        return self.symbolic.F

    @property
    def G(self) -> Any:
        """State equations' matrix of the efforts f(z), a ``sympy.Matrix`` of shape (n, k)."""
        return self.symbolic.G

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, such as ``omega(J_1)``."""
        return self.symbolic.states

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.symbolic.inputs

    @property
    def left_out(self) -> str:
        """Return what poles, transfer functions and responses are without; '' for nothing."""
        with self._in_file():
            efforts = compile_numeric(self.graph, self.outputs, chained=True).efforts
        names = dict.fromkeys(self._owner(name) for name in efforts)
        return f'Without {", ".join(names)}: not linear' if names else ''

    def _owner(self, effort: str) -> str:
        """Return what a user calls the source of an effort: here, the element itself."""
        return effort

    def numeric(self, **values: float) -> StateSpace:
        """
        Return the model in numbers.

        Parameters
        ----------
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        StateSpace
            ``A``, ``B``, ``C``, ``D`` as arrays, names of states, inputs and outputs, ``poles``.

        Raises
        ------
        ParameterError
            If a parameter is unknown, has no number, or one that is not allowed.

        """
        with self._in_file():
            model = compile_numeric(self.graph, self.outputs, chained=True)
            laws = model.structure.laws.values()
            known = dict.fromkeys((*model.parameters, *(p for law in laws for p in law.parameters),
                                   *self.values))
            given: dict[str, object] = {**values}
            for name, value in given.items():
                if name not in known:
                    raise ParameterError(f'unknown parameter {name!r} '
                                         f'(known: {", ".join(known)})')
                if isinstance(value, bool) or not isinstance(value, Real):
                    raise ParameterError(f'parameter {name!r} = {value!r} must be a number, SI')
            return model.at({**self.values, **values})

    def text(self, by_parameter: bool = False) -> str:
        """
        Return every step of the derivation as text.

        Parameters
        ----------
        by_parameter : bool
            Write the parameters' expressions instead of the elements' names.

        """
        from lg_husky_sim.linear_graph.equations import equations
        from lg_husky_sim.linear_graph.report import text_report

        with self._in_file():
            numeric = compile_numeric(self.graph, self.outputs, chained=True)
            known = all(name in self.values for name in numeric.parameters)
            return text_report(
                self.name, equations(self.graph, by_element=not by_parameter),
                self._symbolic(by_parameter), None if by_parameter else self.graph,
                (numeric, self.values) if known else None, self._notes())

    def latex(self, by_parameter: bool = False) -> str:
        """
        Return every step of the derivation as LaTeX (needs amsmath).

        Parameters
        ----------
        by_parameter : bool
            Write the parameters' expressions instead of the elements' names.

        """
        from lg_husky_sim.linear_graph.equations import equations
        from lg_husky_sim.linear_graph.report import latex_report

        with self._in_file():
            return latex_report(self.name, equations(self.graph, by_element=not by_parameter),
                                self._symbolic(by_parameter), self._notes())

    def _notes(self) -> str:
        """Return the note, and why a graph with some numbers has no matrices in numbers."""
        numeric = compile_numeric(self.graph, self.outputs, chained=True)
        if not self.values or all(name in self.values for name in numeric.parameters):
            return self.note
        try:
            numeric.at(self.values)
        except ParameterError as error:
            return '. '.join([self.note] * bool(self.note) + [f'No numbers: {error}'])
        return self.note

    def draw(self, path: str | os.PathLike[str]) -> Path:
        """
        Draw the graph into a file.

        Parameters
        ----------
        path : path-like
            Ends in .svg, .png or .pdf.

        Returns
        -------
        pathlib.Path

        """
        from lg_husky_sim.linear_graph.drawing import save_picture

        save_picture(self.graph, Path(path), title=self.name)
        return Path(path)

    def export(self, path: str | os.PathLike[str], **values: float) -> Path:
        """
        Write A, B, C and D in numbers for other tools, with the names of what is not linear.

        Parameters
        ----------
        path : path-like
            .json, .mat, .npz, .h (C), .tex or .py (with python-control and scipy objects).
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        pathlib.Path

        Raises
        ------
        SettingsError
            If the ending is unknown, or the format cannot hold the model.
        ParameterError
            If a parameter has no number.

        """
        from lg_husky_sim.linear_graph.export import check_export, export

        check_export(Path(path))
        return export(self.numeric(**values), path, self.name, {**self.values, **values})

    def to_control(self, **values: float) -> Any:
        """Return the linear part as a python-control ``StateSpace``, warning of what is not."""
        from lg_husky_sim.linear_graph.export import to_control
        warn_of(self.left_out)
        return to_control(self.numeric(**values))

    def to_scipy(self, **values: float) -> Any:
        """Return the linear part as a ``scipy.signal.StateSpace``, warning of what is not."""
        from lg_husky_sim.linear_graph.export import to_scipy
        warn_of(self.left_out)
        return to_scipy(self.numeric(**values))

    def _symbolic(self, by_parameter: bool) -> SymbolicStateSpace:
        return derive(self.graph, self.outputs) if by_parameter else self.symbolic

    def __repr__(self) -> str:
        """Name the graph, its size and the equations that it has."""
        try:
            model = compile_numeric(self.graph, self.outputs, chained=True).generic()
            forms = [''] + list(equation_forms(model))
        except LgHuskyError:        # one that cannot be derived has a name all the same
            forms = []
        return (f'<{type(self).__name__} {self.name}: {len(self.graph.branches)} branches'
                f'{"; ".join(forms)}>')

    def _repr_latex_(self) -> str | None:
        from lg_husky_sim.linear_graph.report import state_equation_latex

        try:
            return f'${state_equation_latex(self.symbolic)}$'
        except LgHuskyError:        # which the page says
            return None

    def _repr_html_(self) -> str:
        try:
            model = self.symbolic
        except LgHuskyError as error:
            return page_part(self.name, [*[self.note] * bool(self.note), str(error)], [])
        variables = Table('', ('', 'names'), (
            ('states x', ', '.join(model.states)), ('inputs u', ', '.join(model.inputs)),
            ('outputs y', ', '.join(model.outputs))))
        numbers = Table('', ('parameter', 'value [SI]'), tuple(self.values.items()))
        return page_part(self.name, [self.note] * bool(self.note), [variables, numbers])


def graph(source: str | os.PathLike[str] | dict[str, Any] | LinearGraph,
          outputs: Sequence[str] = ()) -> Graph:
    """
    Read a linear graph of your own.

    Parameters
    ----------
    source : path-like, str, dict or LinearGraph
        A netlist file, the text of one, its content as a dict, a graph made in Python; a model
        file; or ``simplified`` or ``expanded``, the paper's two graphs of the Husky.
    outputs : sequence of str
        Variables to put out, such as ``'omega(J_1)'``; those of the netlist by default.

    Returns
    -------
    Graph
        Of a model file a :class:`~lg_husky_sim.Husky`, which is one.

    Raises
    ------
    ModelFileError
        If the file is neither a netlist nor a model file.
    GraphError
        If the source is of another type, or the graph cannot be built.

    """
    if not isinstance(source, str | os.PathLike | LinearGraph | dict):
        raise GraphError(f'{shown(source)} is no linear graph: lg.graph takes a netlist file, '
                         'the text or the dict of one, or a LinearGraph')
    if isinstance(source, str) and source in ('simplified', 'expanded'):
        from lg_husky_sim.api.robots import paper_graph
        return paper_graph(source, outputs)
    if isinstance(source, LinearGraph):
        return Graph('linear graph', source, {}, outputs)
    if isinstance(source, dict):
        return _of_netlist(netlist_of(source), outputs)
    if isinstance(source, str) and ('\n' in source or _ELEMENTS.search(source)):
        return _of_netlist(parse_netlist(source), outputs)
    if not os.fspath(source):
        raise ModelFileError('no netlist given: the source is empty')
    return _of_file(Path(source), outputs)


def _listed(outputs: Sequence[str]) -> tuple[str, ...]:
    """Return outputs, checked to be a list without repetitions."""
    if isinstance(outputs, str):
        raise GraphError(f'outputs = {outputs!r} must be a list, such as [{outputs!r}]')
    found = tuple(outputs)
    for name in found:
        if found.count(name) > 1:
            raise GraphError(f'output {name!r} is named twice')
    return found


def _of_netlist(netlist: Netlist, outputs: Sequence[str], source: str = '') -> Graph:
    return Graph(netlist.name, netlist.graph, netlist.values, outputs or netlist.outputs,
                 netlist.about, source)


def _is_model(path: Path) -> bool:
    from lg_husky_sim.yaml_files import read_yaml
    try:
        top = read_yaml(path, ModelFileError)
    except ModelFileError:      # which the netlist's reader says
        return False
    return 'elements' not in top and not {'schema', 'structure'}.isdisjoint(top)


def _of_file(path: Path, outputs: Sequence[str]) -> Graph:
    if not _is_model(path):
        return _of_netlist(read_netlist(path), outputs, str(path))
    from lg_husky_sim.api.robots import Husky
    husky = Husky(path)
    husky.outputs = _listed(outputs) or husky.outputs
    return husky
