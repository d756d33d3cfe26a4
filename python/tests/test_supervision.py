import json

import numpy as np
import pytest
from program import document, needs_program, run

import torsio

CURRENT_INPUTS = [
    "lowpass(motor_current_A, 20Hz)",
    "tanh(lowpass(rate(motor_angle_rad), 20Hz) / 2)",
    "lowpass(rate(motor_angle_rad), 20Hz)",
]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Three recordings, two models that agree in them, and a monitor of both."""
    folder = tmp_path_factory.mktemp("monitor")
    for name, seed, lever_m in [("a", 1, 0.24), ("b", 2, 0.2), ("c", 3, 0.2)]:
        log = torsio.simulate("dfki-50", "sweep", seed=seed, duration_s=60.0, lever_m=lever_m)
        log.write_csv(folder / f"{name}.csv")
    logs = [folder / "a.csv", folder / "b.csv"]
    torsio.fit(logs, "grey_box", residual="none").save(folder / "spring.safetensors")
    torsio.fit(logs, "linear", rates=True, inputs=CURRENT_INPUTS).save(folder / "current.safetensors")
    sources = {
        "spring": torsio.MonitorSource(folder / "spring.safetensors", ["gear_encoder", "joint_encoder"]),
        "current": torsio.MonitorSource(folder / "current.safetensors", ["current_sensor"]),
    }
    limits = torsio.calibrate_monitor(
        folder / "j.monitor.json",
        [folder / "b.csv", folder / "c.csv"],
        sources,
        serial="J-07",
        false_alarms_per_hour=200.0,
        required_Nm=60.0,
        persistence_s=0.008,
    )
    return folder, limits


@pytest.fixture
def faulty(bench):
    """The recording c, whose gear angle jumps by 0.05 rad at 10 s."""
    folder, _ = bench
    [sound] = torsio.read(folder / "c.csv")
    frame = sound.to_pandas()
    frame.loc[frame.index >= 10.0, "gear_angle_rad"] += 0.05
    return torsio.Recording.from_pandas(frame, name="c")


@needs_program
def test_the_calibration_is_that_of_the_program(bench):
    folder, limits = bench
    theirs = document(
        folder, "monitor", "--calibrate", "b.csv", "c.csv", "-o", "theirs.monitor.json",
        "--source", "spring=spring.safetensors:gear_encoder+joint_encoder",
        "--source", "current=current.safetensors:current_sensor", "--device-serial", "J-07",
        "--false-alarms-per-hour", "200", "--required", "60Nm", "--persistence", "8ms",
    )  # fmt: skip
    assert limits.document == theirs
    assert len(limits.to_pandas()) == 1
    written = [json.loads((folder / f"{name}.monitor.json").read_text()) for name in ("j", "theirs")]
    for each in written:
        each["recordings"] = [recording["sha256"] for recording in each["recordings"]]  # paths differ
    assert written[0] == written[1]


@needs_program
def test_a_replay_is_that_of_the_program(bench, faulty):
    folder, _ = bench
    faulty.write_csv(folder / "faulty.csv")
    mine = torsio.monitor(folder / "j.monitor.json", [folder / "c.csv", folder / "faulty.csv"], serial="J-07")
    theirs = document(folder, "monitor", "j.monitor.json", "c.csv", "faulty.csv", "-o", "torque.csv")
    assert mine.document == theirs
    assert np.isnan(mine.stopped_at_s[0]) and 10.0 <= mine.stopped_at_s[1] < 10.1
    run(folder, "monitor", "j.monitor.json", "faulty.csv", "-o", "torque.csv")
    [written] = torsio.read(folder / "torque.csv")
    for channel in ("estimated_torque_Nm", "monitor_state_1", "fault_1"):
        np.testing.assert_allclose(written[channel], mine.torques[1][channel], rtol=1e-9, atol=1e-12)


def test_a_report_has_tables(bench, faulty):
    folder, _ = bench
    report = torsio.monitor(folder / "j.monitor.json", faulty)
    assert "stopped_at_s" in repr(report) and "<table>" in report._repr_html_()
    findings = report.to_pandas()
    assert len(findings) == len(report.document["recordings"][0]["events"]) and (findings["recording"] == "c").all()
    assert 0.0 < report.watching_from_s[0] < report.stopped_at_s[0]
    assert report.torques[0]["monitor_state_1"].max() == 3.0


def test_one_name_is_not_a_list_of_letters(bench):
    folder, _ = bench
    sources = {
        "spring": torsio.MonitorSource(folder / "spring.safetensors", "gear_encoder"),
        "current": torsio.MonitorSource(folder / "current.safetensors", "current_sensor"),
    }
    torsio.calibrate_monitor(
        folder / "one.monitor.json", [folder / "b.csv", folder / "c.csv"], sources, signals="gear_angle_rad",
        false_alarms_per_hour=200.0,
    )  # fmt: skip
    written = json.loads((folder / "one.monitor.json").read_text())
    assert "gear_encoder" in json.dumps(written) and '"g"' not in json.dumps(written)


def test_what_does_not_belong_together_is_refused(bench, faulty):
    folder, _ = bench
    monitor = folder / "j.monitor.json"
    spring = torsio.MonitorSource(folder / "spring.safetensors")
    for call, message in [
        (lambda: torsio.monitor(monitor, faulty, serial="J-08"), "J-07"),
        (lambda: torsio.monitor(monitor, []), "recordings"),
        (lambda: torsio.monitor(monitor, torsio.Recording.from_dict({"t_s": [0, 1e-3], "a_rad": [1, 2]})), "channel"),
        (lambda: torsio.calibrate_monitor(folder / "x.json", faulty, {"spring": spring}), "at least two"),
        (
            lambda: torsio.calibrate_monitor(folder / "x.json", faulty, {"spring": spring, "again": spring}),
            "the same model for spring and again",
        ),
        (
            lambda: torsio.calibrate_monitor(folder / "x.json", faulty, {}, valid_until="2020-01-01"),
            "valid_until",
        ),
    ]:
        with pytest.raises(torsio.Error, match=message):
            call()
    assert not (folder / "x.json").exists()


@needs_program
def test_an_adaptation_is_that_of_the_program(bench):
    folder, _ = bench
    model = torsio.load(folder / "spring.safetensors")
    adapted, scores = torsio.adapt(model, folder / "c.csv", held_out=0.25, embargo_s=0.5, serial="J-07")
    theirs = document(
        folder, "adapt", "spring.safetensors", "c.csv", "--held-out", "0.25", "--embargo", "0.5s", "--device-serial", "J-07",
        "-o", "adapted.safetensors",
    )  # fmt: skip
    assert theirs.pop("model") == "spring.safetensors" and scores.document.pop("model") == ""
    assert scores.document == theirs
    written = torsio.load(folder / "adapted.safetensors")
    [log] = torsio.read(folder / "c.csv")
    np.testing.assert_array_equal(torsio.estimate(written, log).value, torsio.estimate(adapted, log).value)
    assert np.abs(torsio.estimate(adapted, log).value - torsio.estimate(model, log).value).max() > 1e-3
    assert written.serial == adapted.serial == "J-07"
    assert list(scores.to_pandas()["recording"]) == ["c", "all"] and "rmse_adapted" in repr(scores)


def test_an_adaptation_takes_settings_and_test_recordings(bench):
    folder, _ = bench
    model = torsio.load(folder / "spring.safetensors")
    _, scores = torsio.adapt(model, folder / "b.csv", test=folder / "c.csv", method="rls", comparison_s=5)
    assert [row["recording"] for row in scores["held_out"]] == ["c", None] and scores["method"] == "rls"
    for arguments, message in [({"method": "magic"}, "magic"), ({"stepsize": 1}, "stepsize")]:
        with pytest.raises(torsio.UsageError, match=message):
            torsio.adapt(model, folder / "b.csv", **arguments)


@needs_program
def test_a_simulated_joint_that_its_monitor_stops_is_that_of_the_program(bench):
    folder, _ = bench
    sources = {
        "spring": torsio.MonitorSource(folder / "spring.safetensors", ["gear_encoder", "joint_encoder"]),
        "current": torsio.MonitorSource(folder / "current.safetensors", ["current_sensor"]),
    }
    logs = [folder / "b.csv", folder / "c.csv"]
    torsio.calibrate_monitor(
        folder / "dfki.monitor.json", logs, sources, serial="dfki-50", false_alarms_per_hour=200.0
    )
    mine = torsio.monitor_simulated(
        "dfki-50", folder / "dfki.monitor.json", faults=["gear_angle=5deg@3s"], duration_s=6.0, seed=2
    )
    theirs = document(
        folder, "monitor", "dfki.monitor.json", "--actuator", "dfki-50", "--inject", "gear_angle=5deg@3s", "--duration",
        "6s", "--seed", "2",
    )  # fmt: skip
    assert mine.document == theirs
    [recording] = mine.document["recordings"]
    assert recording["injections"][0]["start_s"] == 3.0
    assert len(mine.torques[0]) == 6000
