import pathlib

import numpy as np
import pytest

import torsio

LOAD = """load: {pendulum: {mass: 9kg, length: lever_m}, joint_inertia: 0.15kg_m2, zero: 0deg}
load_uncertainty: {mass: 1%, length: 1mm}
"""


def sweep_without_sensor(lever_m: float, seed: int) -> torsio.Recording:
    made = torsio.simulate("dfki-50", "sweep", seed=seed, duration_s=20.0, lever_m=lever_m, with_truth=True)
    sweep = torsio.Recording(f"lever {lever_m}", made.sample_rate_Hz)
    for name in ("gear_angle_rad", "joint_angle_rad", "truth_torque_Nm"):
        sweep.add(name, made[name])
    sweep.add_condition("lever_m", lever_m)
    return sweep


@pytest.fixture(scope="module")
def sweeps() -> list[torsio.Recording]:
    return [sweep_without_sensor(0.1, 1), sweep_without_sensor(0.24, 2)]


@pytest.fixture
def load_file(tmp_path: pathlib.Path) -> pathlib.Path:
    path = tmp_path / "load.yaml"
    path.write_text(LOAD)
    return path


def test_a_load_gives_gravity_inertia_and_errors(sweeps, load_file):
    load = torsio.read_load(load_file)
    found = load.of(sweeps[1])
    assert found["gravity_Nm"] == pytest.approx(9 * 9.81 * 0.24)
    assert found["inertia_kg_m2"] == pytest.approx(0.15 + 9 * 0.24**2)
    assert found["errors"]["mass"]["gravity_Nm"] == pytest.approx(0.01 * found["gravity_Nm"])
    assert str(load_file) in repr(load) and load.file == str(load_file)


def test_a_spring_is_learned_without_a_sensor(sweeps, load_file):
    model = torsio.fit(sweeps, "grey_box", load=load_file)
    truth = torsio.evaluate(model, sweeps[1], target="truth_torque_Nm").together()[0]
    assert truth.rmse < 0.15
    same = torsio.evaluate(model, sweeps[1], load=load_file).together()[0]
    assert same.rmse < 0.15


def test_a_dataset_has_the_computed_torque_and_its_error(sweeps, load_file):
    dataset = torsio.Dataset(train=sweeps, load=torsio.read_load(load_file))
    recording = dataset.recordings[0]
    torque = recording["torque_Nm"]
    known = np.isfinite(torque)
    assert known.sum() > 0.9 * len(torque) and not known[0]
    error = torque[known] - recording["truth_torque_Nm"][known]
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert np.all(recording["torque_load_error_Nm"][known] > 0.0)
    assert "load.yaml" in dataset.load_notes[0]
    with pytest.raises(torsio.UsageError, match="has its target already"):
        torsio.fit(dataset, "linear", load=load_file)


def test_mistakes_are_named(sweeps, tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("load: {pendulum: {mass: 9, length: 0.1m}}")
    with pytest.raises(torsio.Error, match="wrong.yaml"):
        torsio.read_load(wrong)
    other = tmp_path / "other.yaml"
    other.write_text("load: {pendulum: {mass: 9kg, length: arm_m}}")
    with pytest.raises(torsio.Error, match="arm_m"):
        torsio.fit(sweeps, "linear", load=other)
