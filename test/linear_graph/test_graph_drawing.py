# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures: everything is on them, nothing lies on top of anything else, files are whole."""

from __future__ import annotations

import itertools
from pathlib import Path
import xml.etree.ElementTree as Xml

from lg_husky_sim.errors import GraphError
from lg_husky_sim.husky import network
from lg_husky_sim.linear_graph import Branch, Domain, Kind, LinearGraph, normal_tree
from lg_husky_sim.linear_graph.drawing import draw_graph, save_picture
from lg_husky_sim.linear_graph.layout import layout
from lg_husky_sim.linear_graph.netlist import read_netlist
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'
GRAPHS = {path.stem: path for path in sorted(EXAMPLES.glob('*.yaml'))}
pytest.importorskip('matplotlib', reason='pictures need matplotlib (the extra "plot")')


def graph_of(name: str) -> LinearGraph:
    if name in GRAPHS:
        return read_netlist(GRAPHS[name]).graph
    return network.simplified() if name == 'simplified' else network.expanded()


@pytest.mark.parametrize('name', ['simplified', 'expanded', *GRAPHS])
def test_every_branch_has_its_place(name: str) -> None:
    graph = graph_of(name)
    blocks = layout(graph)
    curves = {edge: curve for block in blocks for edge, curve in block.edges.items()}
    assert set(curves) == {edge.name for edge in graph.edges}
    nodes = {node: point for block in blocks for node, point in block.nodes.items()}
    rails: dict[Domain, set[float]] = {block.domain: set() for block in blocks}
    for block in blocks:
        rails[block.domain].add(block.y)
    for edge in graph.edges:
        curve = curves[edge.name]
        for node, point in ((edge.tail, curve.points[0]), (edge.head, curve.points[-1])):
            if node in nodes:
                assert point == pytest.approx(nodes[node])
            else:
                assert node == graph.ground_of(edge.domain)
                assert min(abs(point[1] - y) for y in rails[edge.domain]) < 1e-9
    middles = [curve.at(0.5) for curve in curves.values()]
    for one, two in itertools.combinations(middles, 2):
        assert abs(one[0] - two[0]) + abs(one[1] - two[1]) > 0.25
    for left, right in itertools.combinations(blocks, 2):      # panels do not overlap
        apart_x = left.x + left.width < right.x or right.x + right.width < left.x
        apart_y = left.y + left.top < right.y or right.y + right.top < left.y
        assert apart_x or apart_y


def draw(graph: LinearGraph, **marks: tuple[str, ...]) -> list[tuple[str, float, str]]:
    """Return (colour, width, dashes) of every branch drawn."""
    from matplotlib.colors import to_hex
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch

    axes = Figure().add_subplot()
    draw_graph(axes, graph, **marks)
    return [(to_hex(patch.get_edgecolor()), patch.get_linewidth(), str(patch.get_linestyle()))
            for patch in axes.patches if type(patch) is PathPatch]


def test_tree_branches_are_thick_and_links_thin(husky: LinearGraph) -> None:
    widths = [width for _, width, _ in draw(husky)]
    tree = normal_tree(husky)
    assert widths.count(3.0) == len(tree.tree) == 18
    assert widths.count(1.0) == len(tree.links) == 17


def test_suspects_are_marked_and_additions_dashed(husky: LinearGraph) -> None:
    graph = husky.with_branches(
        Branch('F_roll', Kind.D_TYPE, Domain.TRANSLATIONAL, 'body', 'ground', 'b'))
    plain, marked = draw(graph), draw(graph, culprits=('M_H', 'TF_3'), new=('F_roll',))
    red = [entry for entry in marked if entry[0] == '#d40000']
    assert len(red) == 6        # M_H and both ports of TF_3, each with its halo
    assert sum(width == 9.0 for _, width, _ in red) == 3
    assert not [entry for entry in plain if entry[0] == '#d40000']
    assert sum(entry[0] == '#d6336c' for entry in marked) == 1
    with pytest.raises(GraphError, match=r"cannot mark 'M_X': there is no such branch"):
        draw(graph, culprits=('M_X',))


@pytest.mark.parametrize('ending', ['svg', 'png', 'pdf'])
def test_files_are_written_whole_and_the_same_again(
        ending: str, husky: LinearGraph, tmp_path: Path) -> None:
    one = save_picture(husky, tmp_path / f'one.{ending}', title='Husky')
    two = save_picture(husky, tmp_path / f'two.{ending}', title='Husky')
    assert one.read_bytes() == two.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [one.name, two.name]
    if ending == 'svg':
        root = Xml.fromstring(one.read_text(encoding='utf-8'))
        text = {''.join(element.itertext()).strip() for element in root.iter()}
        assert {'Husky', 'M_H', 'B_RL', 'T_ML : 1', 'TF_8 : 2', 'axle_L', 'tree branch'} <= text
    if ending == 'png':
        import matplotlib.image
        picture = matplotlib.image.imread(one)
        assert picture.shape[1] > 1500
        assert picture[:, :, :3].std() > 0.05


def test_wrong_endings_and_folders_are_named(husky: LinearGraph, tmp_path: Path) -> None:
    with pytest.raises(GraphError, match=r"picture '.*g.gif' must end in .svg, .png, .pdf"):
        save_picture(husky, tmp_path / 'g.gif')
    (tmp_path / 'file').touch()
    with pytest.raises(OSError, match=r"exists: '.*/file'$"):
        save_picture(husky, tmp_path / 'file' / 'g.svg')


def test_a_folder_that_is_missing_is_made_as_exports_make_it(
        husky: LinearGraph, tmp_path: Path) -> None:
    assert save_picture(husky, tmp_path / 'new' / 'one' / 'g.svg').exists()
    assert [path.name for path in (tmp_path / 'new' / 'one').iterdir()] == ['g.svg']


def test_dollar_signs_are_plain_text(tmp_path: Path) -> None:
    graph = LinearGraph((
        Branch('R', Kind.D_TYPE, Domain.ELECTRICAL, r'$\foo$', 'ground', 'R'),
        Branch('C', Kind.A_TYPE, Domain.ELECTRICAL, r'$\foo$', 'ground', 'C')))
    picture = save_picture(graph, tmp_path / 'g.svg', title=r'cost $\foo$ \$1 demo')
    root = Xml.fromstring(picture.read_text(encoding='utf-8'))
    text = {''.join(element.itertext()).strip() for element in root.iter()}
    assert {r'cost $\foo$ \$1 demo', r'$\foo$'} <= text


def test_a_narrow_graph_stands_in_the_middle() -> None:
    from matplotlib.figure import Figure

    graph = LinearGraph((Branch('R', Kind.D_TYPE, Domain.ELECTRICAL, 'a', 'ground', 'R'),
                         Branch('C', Kind.A_TYPE, Domain.ELECTRICAL, 'a', 'ground', 'C')))
    axes = Figure().add_subplot()
    draw_graph(axes, graph)
    block, = layout(graph)
    assert sum(axes.get_xlim()) == pytest.approx(2.0 * block.x + block.width)
