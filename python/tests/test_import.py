import json
import math

import numpy as np
import pytest
from program import needs_program, run

import torsio

INPUTS = ["gear_angle_rad - joint_angle_rad", "rate(gear_angle_rad - joint_angle_rad)"]


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A network of two hidden units as JSON: y = 3 tanh(0.5 a + 0.1) - 2 tanh(0.25 b) + 0.2."""
    tensors = {
        "0.weight": {"shape": [2, 2], "data": [0.5, 0.0, 0.0, 0.25]},
        "0.bias": {"shape": [2], "data": [0.1, 0.0]},
        "2.weight": {"shape": [1, 2], "data": [3.0, -2.0]},
        "2.bias": {"shape": [1], "data": [0.2]},
    }
    path = tmp_path_factory.mktemp("weights") / "network.json"
    path.write_text(json.dumps({"tensors": tensors}))
    return path


def test_an_imported_network_computes_what_its_weights_state(weights):
    model = torsio.import_network(
        weights, ["gear_angle_rad", "joint_angle_rad"], 1000.0, activation="tanh", input_scale=[2.0, 1.0]
    )
    estimator = model.estimator()
    assert estimator.raw_inputs == ["gear_angle_rad", "joint_angle_rad"]
    wanted = 3.0 * math.tanh(0.5 * 2.0 * 0.3 + 0.1) - 2.0 * math.tanh(0.25 * -0.4) + 0.2
    assert estimator.step(0.3, -0.4).value == pytest.approx(wanted, abs=1e-5)
    assert any("guard" in note for note in model.notes)


@needs_program
def test_an_import_with_guards_is_that_of_the_program(tmp_path, weights, sweep):
    sweep.write_csv(tmp_path / "sweep.csv")
    mine = torsio.import_network(
        weights, INPUTS, 1000.0, activation="tanh", output_scale=0.5, guards=tmp_path / "sweep.csv", serial="elbow-7"
    )
    run(
        tmp_path, "import", str(weights), "--inputs", ", ".join(INPUTS), "--rate", "1000Hz", "--activation", "tanh",
        "--output-scale", "0.5", "--guards", "sweep.csv", "--device-serial", "elbow-7", "-o", "joint.safetensors",
    )  # fmt: skip
    theirs = torsio.load(tmp_path / "joint.safetensors")
    assert json.loads(mine.description_json()) == json.loads(theirs.description_json())
    np.testing.assert_array_equal(torsio.estimate(mine, sweep).value, torsio.estimate(theirs, sweep).value)
    assert mine.serial == "elbow-7" and not any("guard" in note for note in mine.notes)


def test_wrong_imports_are_refused(tmp_path, weights):
    (tmp_path / "broken.json").write_text('{"tensors": 1}')
    for arguments, message in [
        ((weights, INPUTS, 1000.0), "activation"),
        ((weights, INPUTS[:1], 1000.0), "input"),
        ((tmp_path / "broken.json", INPUTS, 1000.0), "tensors"),
        ((tmp_path / "none.json", INPUTS, 1000.0), "none.json"),
    ]:
        with pytest.raises(torsio.Error, match=message):
            torsio.import_network(*arguments, activation="" if message == "activation" else "tanh")
    with pytest.raises(torsio.UsageError, match="output_name"):
        torsio.import_network(weights, INPUTS, 1000.0, activation="tanh", output_name="torque")
