# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files: what is written is read back; what is wrong is one line that names it."""

from __future__ import annotations

from collections.abc import Callable
import dataclasses
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import ModelFileError
from lg_husky_sim.husky.effects import catalogue, descriptions, Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model, model_data, ModelFile, save_model
import numpy as np
import pytest
import yaml

EFFECTS = [Effect(kind.id, kind.sides[-1], kind.shapes[-1])
           for kind in (*catalogue().values(), *descriptions().values())]


def with_effects(*effects: Effect, onset: Onset | None = None) -> ModelFile:
    nominal, structure = load_model(), Structure(onset=onset)
    for effect in effects:
        structure = structure.with_effect(effect)
    own = [dataclasses.replace(p.parameter(), low=p.lower, high=p.upper)
           for e in effects for p in e.parameters() if p.name not in nominal.parameters]
    return ModelFile(structure, nominal.parameters.with_entries(*own), 'made by a test · ω')


def test_the_packaged_file_is_the_nominal_robot() -> None:
    model = load_model()
    assert model.structure == Structure()
    assert 'paper' in model.about


@pytest.mark.parametrize('effect', EFFECTS, ids=lambda e: e.id)
def test_round_trip_of_each_effect(tmp_path: Path, effect: Effect) -> None:
    tyres = Effect('traction_saturation', shape='circle')
    model = with_effects(*((tyres,) if effect.shape == 'grip' else ()), effect)
    save_model(model, tmp_path / 'deep' / 'model.yaml')
    again = load_model(tmp_path / 'deep' / 'model.yaml')
    assert again == model
    for one, other in zip(compile_model(model.structure).at(model.parameters).sets,
                          compile_model(again.structure).at(again.parameters).sets, strict=True):
        np.testing.assert_array_equal(one.a, other.a)
        np.testing.assert_array_equal(one.coefficients, other.coefficients)
        assert one.command == other.command
        assert one.sensors == other.sensors
    assert [p.name for p in (tmp_path / 'deep').iterdir()] == ['model.yaml']


@pytest.mark.parametrize('kind', OnsetKind)
def test_round_trip_of_late_effects(tmp_path: Path, kind: OnsetKind) -> None:
    onset = Onset(kind, 31.25, 'rec2' if kind is OnsetKind.TIME else '')
    model = with_effects(Effect('terrain_change', late=True), Effect('payload'),
                         Effect('yaw_pull', late=True), onset=onset)
    save_model(model, tmp_path / 'model.yaml')
    assert load_model(tmp_path / 'model.yaml') == model


def test_every_bit_of_a_number_comes_back(tmp_path: Path) -> None:
    nominal = load_model()
    value = 48.39 * (1.0 + 2.0 ** -52) + 1e-13
    model = ModelFile(nominal.structure, nominal.parameters.replacing({'mass': value}))
    save_model(model, tmp_path / 'model.yaml')
    assert load_model(tmp_path / 'model.yaml').parameters['mass'] == value


def test_a_failed_write_leaves_the_old_file(tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / 'model.yaml'
    save_model(load_model(), place)
    old = place.read_text()

    def fail(*_: object, **__: object) -> None:
        raise OSError('no space')
    monkeypatch.setattr(yaml, 'dump', fail)
    with pytest.raises(OSError, match='no space'):
        save_model(load_model(), place)
    assert place.read_text() == old
    assert list(tmp_path.iterdir()) == [place]


def mass(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        data['parameters']['mass'][key] = value
    return change


def put(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        data[key] = value
    return change


def without(key: str) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        del data['parameters'][key]
    return change


SLOPED = [{'effect': 'slope', 'parameters': {'slope_x': 3.0}}]
HOSTILE: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (put('schema', 'another/1'), "schema is 'another/1', expected 'lg_husky_sim/model/1'"),
    (put('schema', None), 'schema is missing, expected'),
    (put('colour', 'red'), "unknown key 'colour'"),
    (put('parameters', [1, 2]), 'parameters is not a mapping of names'),
    (put('parameters', None), 'parameters is not a mapping of names'),
    (put('structure', 'expanded'), 'structure is not a mapping of names'),
    (put('structure', {'drivetrain': 'tracks'}), "structure.drivetrain = 'tracks' is not one of "
                                                 'simplified, expanded'),
    (put('structure', {'onset': {'kind': 'mood', 'value': 1.0}}),
     "structure.onset.kind = 'mood' is not one of time, place_above, place_below"),
    (put('structure', {'onset': {'kind': 'time', 'value': 'noon'}}),
     "structure.onset: value = 'noon' is not a number"),
    (put('structure', {'drivetrian': 'expanded'}), "structure: unknown key 'drivetrian'"),
    (put('structure', {'onset': {'kind': 'time', 'value': 1.0, 'recordng': 'rec2'}}),
     "structure.onset: unknown key 'recordng'"),
    (put('effects', [{'effect': 'encoder_scale', 'side': side} for side in ('left', 'right')]),
     'effects encoder_scale:left and encoder_scale:right share the parameter encoder_factor'),
    (mass('value', 'heavy'), "mass: value = 'heavy' is not a number"),
    (mass('value', True), 'mass: value = True is not a number'),
    (mass('value', float('nan')), 'mass: value = nan is not finite'),
    (mass('value', 10 ** 400), 'is not finite'),
    (mass('value', -3.0), 'mass = -3 kg is not positive'),
    (mass('lower', None), 'mass: lower = None is not a number'),
    (mass('free', 'maybe'), "parameter mass: free = 'maybe' is neither true nor false"),
    (mass('weight', 1.0), "parameter mass: unknown key 'weight'"),
    (without('mass'), 'parameter mass is missing'),
    (put('effects', {'slope': 1}), 'effects is not a list'),
    (put('effects', ['slope']), 'effect 1 is not a mapping of names'),
    (put('effects', [{'effect': 'slop'}]), "unknown effect 'slop'; did you mean slope?"),
    (put('effects', [{'effect': 'encoder_scale', 'side': 'top'}]),
     "side 'top' of effect encoder_scale is not one of left, right"),
    (put('effects', [{'effect': 'slope', 'parameters': {'steep': 1.0}}]),
     "effect slope: unknown parameter 'steep'"),
    (put('effects', [{'effect': 'slope', 'parameters': {'slope_x': 1e6}}]),
     'slope_x = 1e+06 N is above its upper bound 400'),
    (put('effects', [{'effect': 'slope', 'late': True}]),
     'effect slope begins at an onset, but the model has none'),
    (put('effects', [{'effect': 'slope', 'late': 'soon'}]),
     "effect 1: late = 'soon' is neither true nor false"),
]


@pytest.mark.parametrize(('change', 'message'), HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_wrong_is_one_line(tmp_path: Path, change: Callable[[dict[str, Any]], None],
                                   message: str) -> None:
    data = model_data(load_model())
    change(data)
    place = tmp_path / 'model.yaml'
    place.write_text(yaml.safe_dump(data))
    with pytest.raises(ModelFileError) as caught:
        load_model(place)
    text = str(caught.value)
    assert text.startswith(f'{place}: ')
    assert message in text
    assert '\n' not in text


def written(tmp_path: Path, parameters: dict[str, Any], **more: Any) -> Path:
    place = tmp_path / 'model.yaml'
    place.write_text(yaml.safe_dump({'schema': 'lg_husky_sim/model/1', 'about': 'a small one',
                                     'parameters': parameters, **more}))
    return place


def test_all_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    data = model_data(load_model())
    parameters: Any = data['parameters']
    parameters['mass'] = {'vlaue': 6.0, 'unit': 'kg', 'lower': 1.0, 'upper': 50.0}
    parameters['track'].update(value='wide', free='maybe')
    parameters['wheel_inertia']['unit'] = 'g·m²'
    parameters['wheel_radios'] = parameters.pop('wheel_radius')
    del parameters['supply_voltage']
    parameters['yaw_inertia']['value'] = -1.0
    place = written(tmp_path, parameters, effects=[
        {'effect': 'slop'}, {'effect': 'slope', 'parameters': {'slope_z': 1.0, 'slope_x': 'up'}}],
        structre={})
    with pytest.raises(ModelFileError) as caught:
        load_model(place)
    head, *lines = str(caught.value).split('\n  ')
    assert head == f'{place}: {len(lines)} errors'
    assert [line.partition(' (known: ')[0] for line in lines] == [
        "unknown key 'structre'; did you mean structure?",
        "unknown parameter 'wheel_radios'; did you mean wheel_radius?",
        'parameter supply_voltage is missing',
        "parameter mass: unknown key 'vlaue'; did you mean value?",
        "parameter track: free = 'maybe' is neither true nor false",
        "track: value = 'wide' is not a number",
        "wheel_inertia: unit = 'g·m²' is not kg·m²",
        'yaw_inertia = -1 kg·m² is not positive',
        next(line for line in lines if line.startswith("unknown effect 'slop'; did you mean slop")
             ).partition(' (known: ')[0],
        "effect slope: unknown parameter 'slope_z'; did you mean slope_y?",
        "slope_x: value = 'up' is not a number"]


def test_a_file_without_end_of_errors_says_so_many(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError) as caught:
        load_model(written(tmp_path, {f'{k}thing': 1.0 for k in range(30)}))
    lines = str(caught.value).split('\n')
    assert len(lines) == 22
    assert lines[-1] == '  and 27 more'


def test_numbers_alone_are_a_robot(tmp_path: Path) -> None:
    """What is left out is the packaged robot's; its bounds are in proportion."""
    nominal = load_model().parameters
    values = {entry.name: entry.value for entry in nominal.entries}
    model = load_model(written(tmp_path, values))
    for entry in nominal.entries:
        assert model.parameters.entry(entry.name) == dataclasses.replace(entry, source='not told')
    told = {'value': 10.0 * values['mass'], 'source': 'scales', 'tolerance': 0.01}
    heavy = load_model(written(tmp_path, {**values, 'mass': told}))
    mass, damping = (heavy.parameters.entry(name) for name in ('mass', 'wheel_damping'))
    assert (mass.lower, mass.upper, mass.tolerance, mass.source) == (1.0, 5000.0, 0.01, 'scales')
    assert (damping.lower, damping.upper, damping.free) == (0.1, 1000.0, True)


def test_a_negative_tolerance_is_refused(tmp_path: Path) -> None:
    values = {entry.name: entry.value for entry in load_model().parameters.entries}
    with pytest.raises(ModelFileError, match=r'mass: tolerance = -0\.02 is negative'):
        load_model(written(tmp_path, {**values, 'mass': {'value': 42.0, 'tolerance': -0.02}}))


def test_effects_of_a_large_robot_are_in_proportion(tmp_path: Path) -> None:
    values = {entry.name: entry.value for entry in load_model().parameters.entries}
    values['mass'] *= 10.0
    model = load_model(written(tmp_path, values, effects=[
        {'effect': 'slope', 'parameters': {'slope_x': 900.0}}]))
    assert model.parameters['slope_x'] == 900.0
    assert model.parameters['slope_y'] == pytest.approx(80.0)
    assert load_model(written(tmp_path, model_data(model)['parameters'],  # type: ignore[arg-type]
                              effects=model_data(model)['effects'])).parameters == model.parameters


def test_a_file_of_the_packaged_files_name_is_a_file_like_others(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, {'mass': 6.0}).rename('husky.yaml')
    with pytest.raises(ModelFileError, match='parameter track is missing'):
        load_model('husky.yaml')


@pytest.mark.parametrize('content', [
    b'', b'- a list', b'just words', b'\xff\xfe\x00garbage', b'a: [1, 2', b'{a: 1, a: 2}: 3',
    b'!!python/object/apply:os.system ["touch hacked"]', b'a: &x [*x]',
    b'a: &a [1]\nb: &b [*a, *a]\n',
])
def test_what_is_no_model_is_refused_in_one_line(
        tmp_path: Path, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / 'model.yaml'
    place.write_bytes(content)
    with pytest.raises(ModelFileError) as caught:
        load_model(place)
    assert str(place) in str(caught.value)
    assert '\n' not in str(caught.value)
    assert not (tmp_path / 'hacked').exists()


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r'nowhere\.yaml'):
        load_model(tmp_path / 'nowhere.yaml')
    with pytest.raises(ModelFileError):
        load_model(tmp_path)


def test_short_forms_take_the_catalogues_defaults(tmp_path: Path) -> None:
    data = model_data(load_model())
    data['effects'] = SLOPED
    (tmp_path / 'model.yaml').write_text(yaml.safe_dump(data))
    model = load_model(tmp_path / 'model.yaml')
    assert model.structure.effects == (Effect('slope'),)
    assert model.parameters['slope_x'] == 3.0
    assert model.parameters['slope_y'] == 8.0
    assert model.parameters.entry('slope_x').unit == 'N'


def test_a_changed_effect_survives_the_file(tmp_path: Path) -> None:
    model = load_model()
    structure = model.structure.with_effect(Effect('command_latency')).with_effect(
        Effect('command_latency', late=True, again=True), Onset(OnsetKind.TIME, 3.0, 'rec1'))
    parameters = model.parameters.with_entries(*(
        p.parameter(0.2 if p.name.endswith('_later') else 0.1)
        for effect in structure.effects for p in effect.parameters()))
    save_model(ModelFile(structure, parameters), tmp_path / 'model.yaml')
    again = load_model(tmp_path / 'model.yaml')
    assert again.structure == structure
    assert (again.parameters['latency'], again.parameters['latency_later']) == (0.1, 0.2)


@pytest.mark.parametrize('name', ['1e5', '2E+3', '12', 'null', 'yes', 'a: b', 'mon/1e3'])
def test_names_of_recordings_stay_names(tmp_path: Path, name: str) -> None:
    model = with_effects(Effect('yaw_pull', late=True),
                         onset=Onset(OnsetKind.TIME, 3.0, name, (f'{name}0', name + '1')))
    save_model(model, tmp_path / 'model.yaml')
    assert load_model(tmp_path / 'model.yaml').structure == model.structure


def test_a_key_without_a_value_is_an_empty_text(tmp_path: Path) -> None:
    data = model_data(with_effects(Effect('yaw_pull', late=True),
                                   onset=Onset(OnsetKind.TIME, 3.0)))
    data['about'] = None
    data['structure']['onset']['recording'] = None  # type: ignore[index]
    (tmp_path / 'model.yaml').write_text(yaml.safe_dump(data))
    model = load_model(tmp_path / 'model.yaml')
    assert model.about == ''
    assert model.structure.onset == Onset(OnsetKind.TIME, 3.0)


def test_a_file_need_not_say_that_both_sides_are_alike(tmp_path: Path) -> None:
    """Files of robots from before there was a number for it are read as they are."""
    nominal, written_before = load_model(), tmp_path / 'before.yaml'
    data = yaml.safe_load((Path(__file__).parents[2] / 'config' / 'husky.yaml').read_text('utf-8'))
    del data['parameters']['side_gain_ratio']
    written_before.write_text(yaml.safe_dump(data), 'utf-8')
    read = load_model(written_before)
    assert read.parameters['side_gain_ratio'] == 1.0
    assert dict(read.parameters) == dict(nominal.parameters)
