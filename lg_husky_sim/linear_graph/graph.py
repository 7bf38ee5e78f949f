# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A linear graph: branches and two-ports over nodes, immutable and checked at birth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
import difflib
import hashlib
import re
from typing import TYPE_CHECKING

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.elements import article, Branch, Domain, Kind, TwoPort

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

GROUND = 'ground'
Node = tuple[Domain, str]
_VARIABLE = re.compile(r'\s*([A-Za-z]+)\s*\(\s*([A-Za-z_]\w*(?:\.[12])?)\s*\)\s*', re.ASCII)


@dataclass(frozen=True)
class Edge:
    """
    A directed edge of the graph: a branch, or one port of a two-port.

    Parameters
    ----------
    name : str
        Name of the branch, or ``two_port.1`` and ``two_port.2``.
    domain : Domain
        Energy domain.
    tail, head : tuple of (Domain, str)
        Nodes.
    owner : Branch or TwoPort
        What the edge belongs to.
    port : int
        0 for a branch, 1 or 2 for a port.

    """

    name: str
    domain: Domain
    tail: Node
    head: Node
    owner: Branch | TwoPort
    port: int = 0


@dataclass(frozen=True)
class Variable:
    """The across or the through variable of one edge."""

    edge: int
    is_across: bool
    name: str


@dataclass(frozen=True)
class LinearGraph:
    """
    Branches and two-ports over named nodes, with one ground node for each domain.

    Node names belong to one domain each; only the ground's name may be shared, and means a
    separate ground in each domain.

    Parameters
    ----------
    branches : tuple of Branch
        One-port elements; their order is the order of states and inputs.
    two_ports : tuple of TwoPort
        Transformers and gyrators.
    ground : str or mapping of Domain to str
        Reference node (of all domains, or of each).

    Raises
    ------
    GraphError
        If a name is used twice, a node lies in two domains or has no way to its ground, a domain
        has no ground, a mass is not referred to ground, across sources form a loop, or a
        characteristic names an unknown variable. What only a finished graph must have (no open
        ends, no node on through sources alone) is checked when the graph is derived.

    """

    branches: tuple[Branch, ...]
    two_ports: tuple[TwoPort, ...] = ()
    ground: str | Mapping[Domain, str] = GROUND
    edges: tuple[Edge, ...] = field(init=False, repr=False, compare=False)
    _index: Mapping[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Collect the edges and check the graph."""
        from lg_husky_sim.linear_graph.checks import check_graph

        object.__setattr__(self, 'branches', tuple(self.branches))
        object.__setattr__(self, 'two_ports', tuple(self.two_ports))
        if not isinstance(self.ground, str):
            object.__setattr__(self, 'ground', dict(self.ground))
        edges = [Edge(branch.name, branch.domain, (branch.domain, branch.tail),
                      (branch.domain, branch.head), branch) for branch in self.branches]
        for two_port in self.two_ports:
            for number, (domain, tail, head) in enumerate((two_port.port1, two_port.port2), 1):
                edges.append(Edge(f'{two_port.name}.{number}', domain, (domain, tail),
                                  (domain, head), two_port, number))
        object.__setattr__(self, 'edges', tuple(edges))
        object.__setattr__(self, '_index', {edge.name: at for at, edge in enumerate(edges)})
        check_graph(self)

    def __hash__(self) -> int:
        """Hash by content."""
        return hash(self.fingerprint())

    def ground_of(self, domain: Domain) -> Node:
        """
        Return the ground node of a domain.

        Raises
        ------
        GraphError
            If the domain has none.

        """
        if isinstance(self.ground, str):
            return domain, self.ground
        if domain not in self.ground:
            raise GraphError(f'the {domain.value} domain has no ground; name its reference node '
                             f'in ground={{Domain.{domain.name}: ...}}')
        return domain, self.ground[domain]

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All nodes in order of appearance."""
        found: dict[Node, None] = {}
        for edge in self.edges:
            found.setdefault(edge.tail)
            found.setdefault(edge.head)
        return tuple(found)

    @property
    def domains(self) -> tuple[Domain, ...]:
        """Domains in order of appearance."""
        return tuple(dict.fromkeys(edge.domain for edge in self.edges))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all branches and two-ports."""
        return (*(branch.name for branch in self.branches),
                *(two_port.name for two_port in self.two_ports))

    def edge_index(self, name: str) -> int:
        """
        Return the position of a branch or port in ``edges``.

        Raises
        ------
        GraphError
            If there is no such edge; the message suggests a close name.

        """
        at = self._index.get(name)
        if at is None:
            raise GraphError(f'no branch {name!r} in the graph{suggestion(name, self._index)}')
        return at

    def variable(self, text: str) -> Variable:
        """
        Find a variable by its text, such as ``'v(M_H)'`` or ``'tau(TF_1.1)'``.

        The symbol must be the across or the through symbol of the branch's domain (V i, v F,
        omega tau, P Q, T q). A two-port may be named without its port's number where the symbol
        fits only one of the two ports.

        Raises
        ------
        GraphError
            If it names no variable of this graph.

        """
        match = _VARIABLE.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise GraphError(f'variable {text!r} must be written as symbol(branch), '
                             'for example v(M_H)')
        symbol, name = match.groups()
        ports = [f'{name}.1', f'{name}.2'] if f'{name}.1' in self._index else [name]
        found = []
        for port in ports:
            at = self.edge_index(port)
            domain = self.edges[at].domain
            if symbol in (domain.across, domain.through):
                found.append(Variable(at, symbol == domain.across, f'{symbol}({port})'))
        if len(found) == 1:
            return found[0]
        if found:
            raise GraphError(f'variable {text!r} fits both ports; write {found[0].name!r} '
                             f'or {found[1].name!r}')
        domain = self.edges[self.edge_index(ports[0])].domain
        raise GraphError(f'variable {text!r}: {article(domain.value)} branch has '
                         f'{domain.across}({ports[0]}) and {domain.through}({ports[0]})')

    def variable_name(self, edge: int, is_across: bool) -> str:
        """Return the text of an edge's variable, for example ``'omega(J_L)'``."""
        found = self.edges[edge]
        return f'{found.domain.across if is_across else found.domain.through}({found.name})'

    def with_branches(self, *elements: Branch | TwoPort) -> LinearGraph:
        """
        Return the graph with more branches and two-ports.

        Raises
        ------
        GraphError
            If the result is no valid graph.
        TypeError
            If something else is given.

        """
        for element in elements:
            if not isinstance(element, Branch | TwoPort):
                raise TypeError(f'{element!r} is neither a Branch nor a TwoPort')
        return replace(
            self,
            branches=self.branches + tuple(e for e in elements if isinstance(e, Branch)),
            two_ports=self.two_ports + tuple(e for e in elements if isinstance(e, TwoPort)))

    def without(self, *names: str) -> LinearGraph:
        """
        Return the graph without some branches or two-ports.

        Raises
        ------
        GraphError
            If there is no such element, or the rest is no valid graph.

        """
        for name in names:
            self._require(name)
        return replace(
            self, branches=tuple(b for b in self.branches if b.name not in names),
            two_ports=tuple(t for t in self.two_ports if t.name not in names))

    def replacing(self, element: Branch | TwoPort) -> LinearGraph:
        """
        Return the graph with the element of the same name replaced, in the same place.

        Raises
        ------
        GraphError
            If there is no such element, or it is of the other sort (branch, two-port).

        """
        self._require(element.name)
        if isinstance(element, Branch) == (element.name in {t.name for t in self.two_ports}):
            raise GraphError(f'{element.name!r}: a branch cannot take the place of a two-port, '
                             'nor a two-port that of a branch; remove it and add the other')
        return replace(
            self,
            branches=tuple(element if isinstance(element, Branch) and b.name == element.name
                           else b for b in self.branches),
            two_ports=tuple(element if isinstance(element, TwoPort) and t.name == element.name
                            else t for t in self.two_ports))

    def _require(self, name: str) -> None:
        if name not in self.names:
            raise GraphError(f'no element {name!r} in the graph{suggestion(name, self.names)}')

    def fingerprint(self) -> str:
        """Return a hash of everything that defines the graph, the same on every machine."""
        ground = self.ground if isinstance(self.ground, str) else sorted(
            (domain.value, node) for domain, node in self.ground.items())
        text = repr((self.branches, self.two_ports, ground))
        return hashlib.sha256(text.encode()).hexdigest()

    def incidence(self) -> NDArray[np.float64]:
        """
        Return the reduced incidence matrix.

        Returns
        -------
        numpy.ndarray, shape (n_nodes - n_grounds, n_edges)
            +1 where the edge leaves the node, -1 where it enters; grounds left out.

        """
        import numpy as np

        grounds = {self.ground_of(domain) for domain in self.domains}
        rows = {node: at for at, node in enumerate(n for n in self.nodes if n not in grounds)}
        matrix = np.zeros((len(rows), len(self.edges)))
        for at, edge in enumerate(self.edges):
            if edge.tail in rows:
                matrix[rows[edge.tail], at] += 1.0
            if edge.head in rows:
                matrix[rows[edge.head], at] -= 1.0
        return matrix

    def of_kind(self, *kinds: Kind) -> tuple[Branch, ...]:
        """Return the branches of some kinds in order."""
        return tuple(branch for branch in self.branches if branch.kind in kinds)


def close_name(name: str, known: Iterable[str], cutoff: float = 0.5) -> str:
    """Return '; did you mean ...?' with the closest known name, or ''."""
    close = difflib.get_close_matches(name, tuple(known), n=1, cutoff=cutoff)
    return f'; did you mean {close[0]!r}?' if close else ''


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean ...?' with the closest known name, or the known names."""
    known = tuple(known)
    if close := close_name(name, known, cutoff=0.6):
        return close
    shown = ', '.join(known[:12]) + (', ...' if len(known) > 12 else '')
    return f'; there {"is" if len(known) == 1 else "are"} {shown}' if known else ''
