# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Named mistakes in a graph: each message names the branch and says what to do, in one line."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.errors import GraphError, LgHuskyError, ParameterError
from lg_husky_sim.linear_graph import (
    Branch,
    Characteristic,
    compile_numeric,
    Domain,
    Form,
    Kind,
    LinearGraph,
    TwoPort,
)
import pytest

E, M, R, T = Domain.ELECTRICAL, Domain.TRANSLATIONAL, Domain.ROTATIONAL, Domain.THERMAL


def branch(name: str, kind: Kind, tail: str, head: str = 'ground', domain: Domain = E,
           value: str | None = None, form: Form | None = None) -> Branch:
    """Return a branch whose parameter has its own name."""
    source = kind in (Kind.ACROSS_SOURCE, Kind.THROUGH_SOURCE)
    return Branch(name, kind, domain, tail, head,
                  '' if source and value is None else value or name, form)


def source(name: str, tail: str, head: str = 'ground') -> Branch:
    return branch(name, Kind.ACROSS_SOURCE, tail, head)


def resistor(name: str, tail: str, head: str = 'ground') -> Branch:
    return branch(name, Kind.D_TYPE, tail, head)


def capacitor(name: str, tail: str, head: str = 'ground') -> Branch:
    return branch(name, Kind.A_TYPE, tail, head)


def inductor(name: str, tail: str, head: str = 'ground') -> Branch:
    return branch(name, Kind.T_TYPE, tail, head)


RC = (source('V', 'a'), resistor('R', 'a', 'b'), capacitor('C', 'b'))
DIODE = Branch('diode', Kind.D_TYPE, E, 'b', 'ground', form=Form.DAMPING,
               characteristic=Characteristic('diode', ('V(diode)',), ('I_s', 'V_t')))


def build(*branches: Branch, two_ports: tuple[TwoPort, ...] = ()) -> Callable[[], object]:
    return lambda: compile_numeric(LinearGraph(branches, two_ports))


def transformer(name: str, one: str, two: str, ratio: str = '') -> TwoPort:
    return TwoPort(name, Kind.TRANSFORMER, (E, one, 'ground'), (E, two, 'ground'), ratio or name)


MISTAKES: dict[str, tuple[Callable[[], object], str]] = {
    'floating part': (
        build(*RC, resistor('R_x', 'p', 'q'), capacitor('C_x', 'p', 'q')),
        r"node 'p' floats: R_x, C_x have no way to the electrical ground 'ground'; connect"),
    'loop of across sources': (
        build(*RC, source('V_2', 'b', 'a'), source('V_3', 'b')),
        r'across sources V_2, V, V_3 form a loop.*remove one'),
    'cutset of through sources': (
        build(*RC, branch('I_1', Kind.THROUGH_SOURCE, 'b', 'c'),
              branch('I_2', Kind.THROUGH_SOURCE, 'c')),
        r"through sources I_1, I_2 alone connect node 'c'.*in parallel"),
    'one through source alone': (
        build(branch('I_1', Kind.THROUGH_SOURCE, 'c'), *RC),
        r"through source I_1 alone connects node 'c', so its flow has no other way and the"),
    'one input of two units': (
        build(*RC, Branch('I', Kind.THROUGH_SOURCE, E, 'b', 'ground', 'V')),
        r"sources 'V' \(electrical across source\) and 'I' .* share the input 'V', but not its"),
    'sources in contradiction through a transformer': (
        build(*RC, source('V_2', 'd'), two_ports=(transformer('n', 'a', 'd'),)),
        r"source 'V_2' cannot set V\(V_2\): it is already fixed by V;.*put a D-type between"),
    'duplicate name': (
        build(*RC, resistor('R', 'b')), r"the name 'R' is used twice"),
    'two-port domain clash': (
        build(*RC, two_ports=(TwoPort('k', Kind.TRANSFORMER, (R, 'b', 'ground'),
                                      (R, 'w', 'ground'), 'k'),)),
        r"node 'b' is electrical at 'R' and rotational at 'k.1'; only a two-port joins domains"),
    'missing ground': (
        build(resistor('R', 'a', 'b'), capacitor('C', 'a', 'b')),
        r"the electrical domain has no ground: no branch touches node 'ground'; connect one of R"),
    'ground of a domain not given': (
        lambda: LinearGraph((*RC, branch('m', Kind.A_TYPE, 'x', 'floor', M)), (),
                            {E: 'ground'}),
        r'the translational domain has no ground; name its reference node'),
    'no state': (
        build(source('V', 'a'), resistor('R', 'a')), r'the graph has no state: it needs'),
    'only dependent storages': (
        build(source('V', 'a'), capacitor('C', 'a')), r'no state'),
    'bad value': (
        lambda: branch('R', Kind.D_TYPE, 'a', value='R*'),
        r"branch 'R': expression 'R\*' cannot be read"),
    'forbidden value': (
        lambda: branch('R', Kind.D_TYPE, 'a', value='__import__("os")'),
        r"branch 'R': expression .* unknown function '__import__'"),
    'no value': (
        lambda: Branch('R', Kind.D_TYPE, E, 'a', 'b'), r"branch 'R' has no value; a D-type needs"),
    'unknown output': (
        lambda: compile_numeric(LinearGraph(RC), ['V(Q)']),
        r"unknown output: no branch 'Q' in the graph; there are V, R, C"),
    'output in the wrong symbol': (
        lambda: compile_numeric(LinearGraph(RC), ['F(C)']),
        r"variable 'F\(C\)': an electrical branch has V\(C\) and i\(C\)"),
    'ambiguous port': (
        lambda: compile_numeric(LinearGraph(
            (*RC, resistor('R_2', 'd')), (transformer('n', 'b', 'd'),)), ['i(n)']),
        r"variable 'i\(n\)' fits both ports; write 'i\(n.1\)' or 'i\(n.2\)'"),
    'mass between two bodies': (
        build(branch('m', Kind.A_TYPE, 'a', 'b', M), branch('k', Kind.T_TYPE, 'a', domain=M),
              branch('d', Kind.D_TYPE, 'b', domain=M)),
        r"A-type 'm' lies between 'a' and 'b'; the velocity of a mass is measured against ground"),
    'thermal T-type': (
        lambda: branch('L', Kind.T_TYPE, 'a', domain=T),
        r"branch 'L': the thermal domain has no T-type; use an A-type"),
    'thermal two-port': (
        lambda: TwoPort('k', Kind.TRANSFORMER, (E, 'a', 'ground'), (T, 'b', 'ground'), 'k'),
        r"port 'k.2' is thermal: temperature times heat flow is no power"),
    'branch to itself': (
        lambda: resistor('R', 'a', 'a'), r"branch 'R' starts and ends at node 'a'"),
    'open end': (
        build(*RC, resistor('R_x', 'b', 'nowhere')),
        r"node 'nowhere' has no branch but 'R_x', so nothing can flow through it"),
    'two-port made as a branch': (
        lambda: branch('k', Kind.GYRATOR, 'a'),
        r"branch 'k': a gyrator has two ports; make it with TwoPort"),
    'form on the wrong kind': (
        lambda: branch('C', Kind.A_TYPE, 'a', form=Form.DAMPING),
        r"branch 'C': an A-type takes no form, not damping"),
    'doubled transformer': (
        build(*RC, resistor('R_2', 'd'),
              two_ports=(transformer('n', 'b', 'd'), transformer('k', 'b', 'd'))),
        r'no state: .* not fixed by sources and two-ports alone'),
    'transformers of equal ratio in parallel': (
        build(*RC, resistor('R_2', 'd'),
              two_ports=(transformer('n', 'b', 'd', '2*p/q'),
                         transformer('k', 'b', 'd', 'p/(q/2)'))),
        r"two-port '[nk]' has a variable that nothing determines.*doubled"),
    'storage held at zero': (
        build(*RC, resistor('R_2', 'd'), inductor('L', 'a'),
              two_ports=(transformer('n', 'b', 'd'), transformer('k', 'b', 'd'))),
        r"V\(C\) of storage 'C' is held at zero by the branches around it; remove"),
    'source on two-ports that allow nothing': (
        build(*RC, two_ports=(transformer('n', 'a', 'd'), transformer('k', 'a', 'd'))),
        r"source 'V' cannot set V\(V\): it is already fixed by the two-ports alone"),
    'gyrator on itself': (
        build(*RC, two_ports=(TwoPort('g', Kind.GYRATOR, (E, 'd', 'ground'),
                                      (E, 'd', 'ground'), 'g'),)),
        r"two-port 'g' has a variable that nothing determines.*shorted, open, or doubled"),
    'unknown variable in a law': (
        lambda: LinearGraph((*RC, Branch(
            'F', Kind.THROUGH_SOURCE, E, 'b', 'ground',
            characteristic=Characteristic('coulomb', ('V(c)',), ('p', 'q'))))),
        r"characteristic of 'F': no branch 'c' in the graph; there are V, R, C, F"),
    'law with too few parameters': (
        lambda: Characteristic('coulomb', ('V(C)',), ('p',)),
        r"law 'coulomb' takes 1 argument\(s\) .* and 2 parameter\(s\) \(p1: dry .*, not 1 and 1"),
    'unknown name in a law': (
        lambda: Characteristic('p*z + q', ('V(C)',), ('p',)),
        r"law 'p\*z \+ q' uses q, which is neither one of its arguments z1 nor"),
    'algebraic loop': (
        build(source('V', 'a'), resistor('R', 'a', 'b'), DIODE, inductor('L', 'b')),
        r'algebraic loop diode <- V\(diode\) <- diode: .*put an energy storage into the loop'),
    'law of the wrong variable': (
        build(source('V', 'b'), DIODE, branch('L', Kind.T_TYPE, 'b', 'c'),
              Branch('lamp', Kind.D_TYPE, E, 'c', 'ground', form=Form.DAMPING,
                     characteristic=Characteristic('cubic', ('V(lamp)',), ('p', 'q')))),
        r"D-type 'lamp': its law gives i\(lamp\), which is already fixed by L; give the inverse "
        r"law with form 'resistance'"),
    'effort on an excess storage': (
        build(*RC, Branch('E_x', Kind.ACROSS_SOURCE, E, 'd', 'ground',
                          characteristic=Characteristic('cubic', ('V(C)',), ('p', 'q'))),
              capacitor('C_x', 'd'), resistor('R_x', 'd', 'b')),
        r"V\(C_x\) of excess storage 'C_x' is set by 'E_x', whose rate of change is not known"),
    'unknown element removed': (
        lambda: LinearGraph(RC).without('RR'), r"no element 'RR' in the graph; did you mean 'R'"),
}


@pytest.mark.parametrize('name', MISTAKES)
def test_mistake_is_named(name: str) -> None:
    make, message = MISTAKES[name]
    with pytest.raises(GraphError, match=message) as caught:
        make()
    text = str(caught.value)
    assert '\n' not in text
    assert len(text) < 400


def test_there_are_ten_and_more_and_the_right_graph_passes() -> None:
    assert len(MISTAKES) >= 10
    assert compile_numeric(LinearGraph(RC)).states == ('V(C)',)


@pytest.mark.parametrize(('values', 'message'), [
    ({'R': 1.0}, r"parameter 'C' of element 'C' has no value"),
    ({'R': 1.0, 'C': 0.0}, r"element 'C' = 0 F is not allowed; it must be finite and positive"),
    ({'R': 1.0, 'C': 1e-320}, r"element 'C' = 9.99989e-321 F is not allowed"),
    ({'R': -2.0, 'C': 1.0}, r"element 'R' = -2 ohm is not allowed"),
    ({'R': float('nan'), 'C': 1.0}, r"element 'R' = nan ohm is not allowed"),
    ({'R': 1.0, 'C': float('inf')}, r"element 'C' = inf F is not allowed"),
    ({'R': 1.0, 'C': 'x'}, r"element 'C' cannot be evaluated"),
])
def test_numbers_that_are_not_allowed(values: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        compile_numeric(LinearGraph(RC)).at(values)


def test_division_by_zero_in_an_expression_is_named() -> None:
    graph = LinearGraph((RC[0], branch('R', Kind.D_TYPE, 'a', 'b', value='1/g'), RC[2]))
    with pytest.raises(ParameterError, match=r"element 'R' = 1/g cannot be evaluated: .*zero"):
        compile_numeric(graph).at({'g': 0.0, 'C': 1.0})


def test_gain_without_solution_is_named() -> None:
    amplifier = Branch('amp', Kind.ACROSS_SOURCE, E, 'd', 'ground',
                       characteristic=Characteristic('proportional', ('V(R_x)',), ('g',)))
    graph = LinearGraph((*RC, amplifier, resistor('R_x', 'd', 'ground')))
    model = compile_numeric(graph)
    assert model.at({'R': 1.0, 'C': 1.0, 'R_x': 1.0, 'g': 0.5}).A[0, 0] == -1.0
    with pytest.raises(ParameterError, match=r'no single solution .* gains of modulated sources'):
        model.at({'R': 1.0, 'C': 1.0, 'R_x': 1.0, 'g': 1.0})


@pytest.mark.parametrize('text', [
    'a.b', 'a[0]', 'lambda: 1', 'f(x)', '"x"', '1 if a else 2', 'a and b', '(a, b)', 'a**b',
    'sqrt', 'sqrt(a, b)', 'sqrt(x=1)', '9**99', '1e400', 'a' * 600, 'sin(' * 60 + 'a' + ')' * 60,
    '-' * 60 + 'a', '', ' ', 'a b', 'True', '1j', 'a := 1', '__x', 'a @ b', 'a // b', 'é',
])
def test_expressions_outside_the_whitelist_are_refused(text: str) -> None:
    with pytest.raises(LgHuskyError):
        branch('R', Kind.D_TYPE, 'a', value=text or ' ')
