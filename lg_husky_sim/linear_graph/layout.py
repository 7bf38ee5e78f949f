# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where nodes and branches of a drawn graph lie; no drawing here.

The graph falls apart into blocks, the parts that are connected without their ground. A block is
drawn as a circuit: its nodes with three and more branches (hubs) in a row at the top, the ground
as a rail at the bottom, and every series chain between a hub and the ground as a column.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
import itertools

from lg_husky_sim.linear_graph.checks import Forest
from lg_husky_sim.linear_graph.elements import Domain
from lg_husky_sim.linear_graph.graph import Edge, LinearGraph, Node

COLUMN = 1.5
HEIGHT = 4.2
ROW_GAP = 2.1
BLOCK_GAP = 0.9
ROW_WIDTH = 26.0
MARGIN = 0.35
Point = tuple[float, float]


@dataclass(frozen=True)
class Curve:
    """A branch as a cubic Bezier curve from tail to head: four control points."""

    points: tuple[Point, Point, Point, Point]

    def at(self, share: float) -> Point:
        """Return the point at a share of the way from tail (0) to head (1)."""
        rest = 1.0 - share
        weights = (rest**3, 3 * rest**2 * share, 3 * rest * share**2, share**3)
        return (sum(w * p[0] for w, p in zip(weights, self.points, strict=True)),
                sum(w * p[1] for w, p in zip(weights, self.points, strict=True)))

    def shifted(self, x: float, y: float) -> Curve:
        """Return the curve moved."""
        one, two, three, four = ((p[0] + x, p[1] + y) for p in self.points)
        return Curve((one, two, three, four))

    def backwards(self) -> Curve:
        """Return the curve from the other end."""
        one, two, three, four = self.points
        return Curve((four, three, two, one))


@dataclass(frozen=True)
class Block:
    """
    One drawn block.

    Parameters
    ----------
    domain : Domain
        Its domain.
    x, y : float
        Lower left corner; the ground rail runs along the bottom.
    width : float
        Width of the block.
    top : float
        Height above the rail that its curves need.
    nodes : dict of Node to point
        All nodes but the ground.
    edges : dict of str to Curve
        All branches and ports.

    """

    domain: Domain
    x: float
    y: float
    width: float
    top: float
    nodes: dict[Node, Point]
    edges: dict[str, Curve]


@dataclass(frozen=True)
class _Chain:
    """
    Branches in series between two ends (None is the ground).

    ``forward`` says for each branch whether it points from start to end.
    """

    start: Node | None
    end: Node | None
    edges: tuple[Edge, ...]
    forward: tuple[bool, ...]
    inner: tuple[Node, ...]


def layout(graph: LinearGraph) -> tuple[Block, ...]:
    """
    Place all blocks of a graph, in rows.

    Parameters
    ----------
    graph : LinearGraph
        The graph.

    Returns
    -------
    tuple of Block
        In drawing units; rows run downwards from y = 0.

    """
    blocks = [_block(graph, edges) for edges in _parts(graph)]
    rows: list[list[Block]] = [[]]
    for block in blocks:
        used = sum(b.width + BLOCK_GAP for b in rows[-1])
        if rows[-1] and used + block.width > ROW_WIDTH:
            rows.append([])
        rows[-1].append(block)
    placed: list[Block] = []
    y = ROW_GAP
    for number, row in enumerate(rows):
        y -= max(block.top for block in row) + ROW_GAP
        x = 0.0
        # every other row runs backwards, so that blocks joined by two-ports stay close
        for block in reversed(row) if number % 2 else row:
            placed.append(_moved(block, x, y))
            x += block.width + BLOCK_GAP
    return tuple(placed)


def _moved(block: Block, x: float, y: float) -> Block:
    return replace(
        block, x=x, y=y, nodes={n: (p[0] + x, p[1] + y) for n, p in block.nodes.items()},
        edges={name: curve.shifted(x, y) for name, curve in block.edges.items()})


def _parts(graph: LinearGraph) -> list[list[Edge]]:
    """Return the edges of each block, neighbours by two-ports next to each other."""
    forest = Forest()
    for edge in graph.edges:
        ground = graph.ground_of(edge.domain)
        if ground not in (edge.tail, edge.head):
            forest.join(edge.tail, edge.head)
    found: dict[Node, list[Edge]] = {}
    part_of: dict[str, Node] = {}
    for edge in graph.edges:
        node = edge.head if edge.tail == graph.ground_of(edge.domain) else edge.tail
        key = forest.find(node)
        found.setdefault(key, []).append(edge)
        part_of[edge.name] = key
    waiting = sorted(found, key=lambda key: key[0] is not Domain.ELECTRICAL)
    order: list[Node] = []
    while waiting:
        queue = [waiting[0]]
        while queue:
            key = queue.pop(0)
            if key not in waiting:
                continue
            waiting.remove(key)
            order.append(key)
            for edge in found[key]:
                if edge.port:
                    other = part_of[f'{edge.owner.name}.{3 - edge.port}']
                    if other in waiting and other not in queue:
                        queue.append(other)
    return [found[key] for key in order]


def _chains(graph: LinearGraph, edges: Sequence[Edge]) -> tuple[list[Node], list[_Chain]]:
    """Return the hubs, and all series chains between hubs and ground."""
    at_node: dict[Node, list[Edge]] = {}
    ground = graph.ground_of(edges[0].domain)
    for edge in edges:
        for node in {edge.tail, edge.head} - {ground}:
            at_node.setdefault(node, []).append(edge)
    hubs = [node for node, found in at_node.items()
            if len(found) != 2 or len({_other(edge, node) for edge in found}) == 1]
    chains = []
    used: set[str] = set()
    starts: list[Node] = [*hubs, ground, *at_node]
    for start in starts:
        for edge in edges:
            if edge.name in used or start not in (edge.tail, edge.head):
                continue
            line, forward, inner = [edge], [edge.tail == start], []
            node = _other(edge, start)
            used.add(edge.name)
            while node != ground and node not in hubs:
                following = [e for e in at_node[node] if e.name not in used]
                if not following:
                    break
                inner.append(node)
                line.append(following[0])
                forward.append(following[0].tail == node)
                used.add(following[0].name)
                node = _other(following[0], node)
            chains.append(_Chain(
                None if start == ground else start, None if node == ground else node,
                tuple(line), tuple(forward), tuple(inner)))
    return _in_row(hubs, chains), chains


def _other(edge: Edge, node: Node) -> Node:
    return edge.head if edge.tail == node else edge.tail


def _in_row(hubs: list[Node], chains: Iterable[_Chain]) -> list[Node]:
    """Order hubs so that those joined by chains are neighbours where they can be."""
    joined: dict[Node, list[Node]] = {hub: [] for hub in hubs}
    for chain in chains:
        if chain.start in joined and chain.end in joined and chain.start != chain.end:
            joined[chain.start].append(chain.end)
            joined[chain.end].append(chain.start)
    order: list[Node] = []
    waiting = sorted(hubs, key=lambda hub: len(set(joined[hub])))
    while waiting:
        stack = [waiting[0]]
        while stack:
            hub = stack.pop()
            if hub in waiting:
                waiting.remove(hub)
                order.append(hub)
                stack += sorted(joined[hub], key=lambda n: -len(set(joined[n])))
    return order


def _block(graph: LinearGraph, edges: Sequence[Edge]) -> Block:
    hubs, chains = _chains(graph, edges)
    nodes: dict[Node, Point] = {}
    curves: dict[str, Curve] = {}
    x = 0.0
    for ring in (c for c in chains if c.start is None and c.end is None):
        x = _place_ring(ring, x, nodes, curves)
    position: dict[Node, int] = {hub: at for at, hub in enumerate(hubs)}
    for hub in hubs:
        columns = [c for c in chains if {c.start, c.end} == {hub, None}]
        width = max(len(columns), 1) * COLUMN
        nodes[hub] = (x + width / 2.0, HEIGHT)
        for at, chain in enumerate(_balanced(columns)):
            _place_column(chain, hub, x + (at + 0.5) * COLUMN, nodes, curves)
        between = [len(c.inner) for c in chains
                   if c.start in position and c.end in position
                   and {position[c.start], position[c.end]} == {position[hub],
                                                                position[hub] + 1}]
        x += width + (max(0.4 * COLUMN, COLUMN * max(between)) if between else 0.0)
    top = _place_bridges(chains, position, nodes, curves)
    return Block(edges[0].domain, 0.0, 0.0, max(x, COLUMN) + MARGIN, top, nodes, curves)


def _balanced(chains: list[_Chain]) -> list[_Chain]:
    """Put long chains outside and single branches inside, as far as order allows."""
    short = [c for c in chains if len(c.edges) == 1]
    long = [c for c in chains if len(c.edges) > 1]
    return [*short, *long] if len(long) < 2 else [long[0], *short, *long[1:]]


def _store(chain: _Chain, pieces: Sequence[Curve], curves: dict[str, Curve]) -> None:
    """Store the pieces of a chain, laid out from start to end, each from its tail to its head."""
    for edge, forward, piece in zip(chain.edges, chain.forward, pieces, strict=True):
        curves[edge.name] = piece if forward else piece.backwards()


def _place_ring(ring: _Chain, x: float, nodes: dict[Node, Point], curves: dict[str, Curve],
                ) -> float:
    """Lay a chain from ground to ground as a circuit: up, along the top, and down."""
    spread = 1.2 * COLUMN
    places = [(x + COLUMN / 2.0 + at * spread, HEIGHT) for at in range(len(ring.inner))]
    nodes.update(zip(ring.inner, places, strict=True))
    stations = [(places[0][0], 0.0), *places, (places[-1][0], 0.0)]
    _store(ring, [_straight(a, b) for a, b in itertools.pairwise(stations)], curves)
    return x + COLUMN + (len(places) - 1) * spread


def _place_column(chain: _Chain, hub: Node, x: float, nodes: dict[Node, Point],
                  curves: dict[str, Curve]) -> None:
    """Lay a chain from a hub down to the ground rail."""
    count = len(chain.edges)
    height = HEIGHT if count == 1 else HEIGHT * 0.94
    stations = [(x, height * (count - at) / count) for at in range(count + 1)]
    nodes.update(zip(chain.inner, stations[1:], strict=False))
    top, first = nodes[hub], stations[1]
    drop = top[1] - first[1]
    fan = Curve((top, (x, top[1] - 0.05 * drop), (x, top[1] - 0.45 * drop), first))
    _store(chain, [fan, *(_straight(a, b) for a, b in itertools.pairwise(stations[1:]))], curves)


def _place_bridges(chains: Sequence[_Chain], position: dict[Node, int],
                   nodes: dict[Node, Point], curves: dict[str, Curve]) -> float:
    """Lay chains between hubs along the top, parallel ones as arcs; return the height needed."""
    top = HEIGHT
    drawn: dict[frozenset[Node], int] = {}
    for chain in chains:
        if chain.start is None or chain.end is None:
            continue
        pair = frozenset((chain.start, chain.end))
        count = drawn.get(pair, 0)
        drawn[pair] = count + 1
        apart = abs(position[chain.start] - position[chain.end])
        lift = 0.95 * count if apart == 1 else 1.0 + 0.45 * apart + 0.8 * count
        arc = _arc(nodes[chain.start], nodes[chain.end], lift)
        top = max(top, HEIGHT + 0.75 * lift + 0.1)
        shares = [at / len(chain.edges) for at in range(len(chain.edges) + 1)]
        stations = [arc.at(share) for share in shares]
        nodes.update(zip(chain.inner, stations[1:], strict=False))
        pieces = [arc] if len(chain.edges) == 1 else [
            _straight(a, b) for a, b in itertools.pairwise(stations)]
        _store(chain, pieces, curves)
    return top


def _arc(start: Point, end: Point, lift: float) -> Curve:
    if start == end:    # a loop of branches at one hub
        return Curve((start, (start[0] - 1.0, start[1] + 1.5), (start[0] + 1.0, start[1] + 1.5),
                      end))
    third = (end[0] - start[0]) / 3.0
    return Curve((start, (start[0] + third, start[1] + lift), (end[0] - third, end[1] + lift),
                  end))


def _straight(start: Point, end: Point) -> Curve:
    x, y = (end[0] - start[0]) / 3.0, (end[1] - start[1]) / 3.0
    return Curve((start, (start[0] + x, start[1] + y), (end[0] - x, end[1] - y), end))
