import pytest
from program import document, needs_program

import torsio


@needs_program
def test_the_impedance_of_a_torsion_tube_is_that_of_the_program(tmp_path):
    mine = torsio.track_impedance(impedance=1000.0, damping_Nms_rad=20.0, duration_s=10.0, amplitude_Nm=15.0, seed=3)
    theirs = document(
        tmp_path, "track", "--impedance", "1000Nm_rad", "--impedance-damping", "20Nms_rad", "--duration", "10s",
        "--amplitude", "15Nm", "--seed", "3",
    )  # fmt: skip
    assert mine.document == theirs
    [run] = mine.runs
    assert run["actuator"] == "harmonic-drive" and run["model"] is None
    assert len(mine.records) == 1 and "truth_joint_angle_rad" in mine.records[0]


@needs_program
def test_a_model_in_the_loop_is_that_of_the_program(tmp_path, dataset):
    model = torsio.fit(dataset, "linear", inputs="spring_deflection_rad")
    model.save(tmp_path / "m.safetensors")
    mine = torsio.track_impedance(
        "dfki-50", 20.0, {"m.safetensors": model}, damping_Nms_rad=2.0, duration_s=10.0, bandwidth_rad_s=40.0
    )
    theirs = document(
        tmp_path, "track", "--actuator", "dfki-50", "--impedance", "20Nm_rad", "--impedance-damping", "2Nms_rad",
        "--duration", "10s", "--bandwidth", "40rad_s", "--model", "m.safetensors",
    )  # fmt: skip
    assert mine.document == theirs
    assert [run["model"] for run in mine.runs][1:] == ["m.safetensors"] and len(mine.records) == 2
    table = mine.to_pandas()
    assert len(table) == sum(len(run["frequencies"]) for run in mine.runs)
    assert (table["wanted_Nm_rad"] > 0.0).all() and "rendered_Nm_rad" in repr(mine)


def test_a_stiffness_that_is_too_large_and_wrong_calls_are_refused():
    for arguments, message in [
        ({"impedance": 1e6}, "passive"),
        ({"impedance": "soft"}, "stiffness"),
        ({"impedance": None}, "stiffness"),
        ({"impedance": True}, "stiffness"),
        ({"impedance": "zero", "damping_Nms_rad": 1.0}, "damping_Nms_rad"),
        ({"impedance": 100.0, "duration_s": 1.0}, "duration"),
        ({"impedance": 100.0, "correction_rad_s": 6.0}, "no estimate of a model corrects"),
    ]:
        with pytest.raises(torsio.UsageError, match=message):
            torsio.track_impedance(**arguments)


def test_the_bandwidth_of_a_correction_is_checked(dataset):
    call = {"actuator": "dfki-50", "impedance": 20.0, "damping_Nms_rad": 2.0, "duration_s": 10.0}
    network = torsio.fit(dataset, "mlp", inputs="spring_deflection_rad", epochs=2)
    for impossible in (float("nan"), 0.0, -1.0, float("inf"), 101.0):
        with pytest.raises(torsio.UsageError, match="bandwidth of the correction"):
            torsio.track_impedance(models={"net": network}, correction_rad_s=impossible, **call)
    inverse = torsio.fit(dataset, "linear", inputs="spring_deflection_rad")
    with pytest.raises(torsio.UsageError, match="no estimate of a model corrects"):
        torsio.track_impedance(models={"line": inverse}, correction_rad_s=6.0, **call)
    runs = torsio.track_impedance(models={"net": network}, correction_rad_s=2.0, **call).runs
    assert [run["correction_rad_s"] for run in runs] == [None, 2.0]
