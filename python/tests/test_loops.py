import numpy as np
import pytest
from program import document, needs_program, run

import torsio


@pytest.fixture(scope="module")
def schedule(tmp_path_factory):
    path = tmp_path_factory.mktemp("faults") / "faults.yaml"
    path.write_text("faults:\n  - {sensor: gear_angle_rad, fault: freeze, at: 2s, for: 1s}\n")
    return path


@needs_program
def test_track_with_faults_and_limits_is_that_of_the_program(tmp_path, schedule):
    mine = torsio.track(
        "dfki-50", reference="steps", duration_s=4.0, lowest_rad=-0.4, highest_rad=0.3, speed_rad_s=1.0, friction=0.5,
        faults=schedule, seeds=(3, 4),
    )  # fmt: skip
    theirs = document(
        tmp_path, "track", "--actuator", "dfki-50", "--reference", "steps", "--duration", "4s",
        "--limits", "position=-0.4rad..0.3rad,speed=1rad_s", "--friction", "0.5", "--faults", str(schedule),
        "--seed", "3", "--seeds", "2",
    )  # fmt: skip
    assert mine.document == theirs
    assert mine["results"][0]["drive"]["limits"]["lowest_rad"] == -0.4
    assert mine["results"][0]["faults"][0]["start_s"] == 2.0
    assert len(mine.to_pandas()) == 2 and "linear" in repr(mine)


@needs_program
def test_a_loop_on_the_velocity_with_a_free_output_is_that_of_the_program(tmp_path):
    mine = torsio.track(
        "dfki-50", reference="steps", duration_s=4.0, is_free=True, lever_m=0.5, amplitude_Nm=4.0,
        acts_on="velocity", velocity_bandwidth_rad_s=150.0, bandwidth_rad_s=30.0,
    )  # fmt: skip
    theirs = document(
        tmp_path, "track", "--actuator", "dfki-50", "--reference", "steps", "--duration", "4s", "--joint-output", "free",
        "--lever", "0.5m", "--amplitude", "4Nm", "--acts-on", "velocity", "--velocity-bandwidth", "150rad_s",
        "--bandwidth", "30rad_s",
    )  # fmt: skip
    assert mine.document == theirs and mine["results"][0]["acts_on"] == "velocity"


@needs_program
def test_the_record_of_a_replay_is_that_of_the_program(tmp_path, dataset):
    model = torsio.fit(dataset, "linear", inputs="spring_deflection_rad")
    model.save(tmp_path / "m.safetensors")
    source = torsio.track("dfki-50", reference="steps", duration_s=3.0, amplitude_Nm=5.0, record=True).record
    source.write_csv(tmp_path / "source.csv")
    [recorded] = torsio.read(tmp_path / "source.csv")
    mine = torsio.track("dfki-50", {"m.safetensors": model}, "replay", recorded=recorded, record=True)
    theirs = document(
        tmp_path, "track", "--actuator", "dfki-50", "--reference", "replay", "--replay", "source.csv",
        "--model", "m.safetensors", "--record", "record.csv",
    )  # fmt: skip
    assert mine.document == theirs
    [written] = torsio.read(tmp_path / "record.csv")
    assert set(written.channels) == set(mine.record.channels)
    np.testing.assert_allclose(written["proportional_current_A"], mine.record["proportional_current_A"], rtol=1e-12)


def test_faults_are_a_schedule_or_texts():
    texts = torsio.track("dfki-50", reference="steps", duration_s=3.0, faults=["gear_angle=freeze@1s..2s"])
    assert texts["results"][0]["faults"][0]["fault"] == "gear_angle_rad freeze"
    with pytest.raises(torsio.UsageError, match="a list of texts"):
        torsio.track("dfki-50", faults="gear_angle=freeze@1s..2s")


def test_what_has_no_effect_or_contradicts_itself_is_refused(sweep):
    for arguments, message in [
        ({"lever_m": 0.5}, "locked"),
        ({"velocity_bandwidth_rad_s": 50.0}, "acts on the current"),
        ({"acts_on": "velocity", "feed_forward": True}, "feed_forward"),
        ({"acts_on": "torque"}, "current"),
        ({"lowest_rad": 0.1}, "lowest_rad"),
        ({"speed_rad_s": 0.0}, "speed_rad_s"),
        ({"speed_rad_s": -1e-9}, "found -1e-09"),
        ({"friction": 2.0}, "0 to 1"),
        ({"recorded": sweep}, "replay"),
        ({"reference": "replay"}, "replay"),
        ({"faults": ["oil=1@2s"]}, "oil"),
    ]:
        with pytest.raises(torsio.UsageError, match=message):
            torsio.track("dfki-50", **arguments)


@needs_program
def test_an_unknown_reference_has_the_message_of_the_program(tmp_path):
    with pytest.raises(torsio.UsageError, match="random-walk"):
        torsio.track("dfki-50", reference="walk")
    with pytest.raises(AssertionError, match="random-walk"):
        run(tmp_path, "track", "--actuator", "dfki-50", "--reference", "walk")
