import os
import pathlib
import subprocess
import time

import numpy as np
import pytest

import torsio
from torsio import link

SERVE = os.environ.get("TORSIO_SERVE_JOINT", "")

pytestmark = pytest.mark.skipif(not SERVE, reason="TORSIO_SERVE_JOINT names the program that serves a joint")


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "joint"
    serving = subprocess.Popen([SERVE, path], stdin=subprocess.PIPE)
    while not path.exists():
        time.sleep(0.01)
    yield path
    serving.stdin.close()
    serving.wait()


@pytest.fixture
def joint(path):
    with link.RemoteJoint(1, unix=path, timeout_s=0.2) as joint:
        yield joint


def test_registers_are_read_and_written_by_name(joint):
    assert joint.information["actuator"] == "dfki-50"
    assert [each["name"] for each in joint.registers] == ["gain", "ratio"]
    assert joint.registers[0]["highest"] == 9.0
    joint["gain"] = 3
    joint["ratio"] = 160
    assert joint["gain"] == 3.0 and isinstance(joint["ratio"], int)


def test_mistakes_state_the_reason(joint, path):
    with pytest.raises(torsio.Error, match="gain = 12; expected 0 to 9, found out_of_range"):
        joint["gain"] = 12.0
    with pytest.raises(torsio.Error, match="Did you mean 'gain'"):
        joint["gian"]
    with pytest.raises(torsio.UsageError, match="impedance"):
        joint.send("speed", velocity_rad_s=1.0)
    with pytest.raises(torsio.UsageError, match="1 to 254"):
        link.RemoteJoint(300, unix=path)
    joint.close()
    with pytest.raises(torsio.UsageError, match="closed"):
        joint.enable()


def test_telemetry_is_an_array(joint):
    channels, rate_Hz = joint.subscribe(["torque_Nm", "current_A"], rate_Hz=500)
    assert channels == ["torque_Nm", "current_A"] and rate_Hz == 500.0
    time_s, values = joint.poll(0.5)
    assert values.shape == (len(time_s), 2) and values.dtype == np.float32 and len(time_s) > 100
    np.testing.assert_allclose(np.median(np.diff(time_s)), 0.002, rtol=1e-6)
    np.testing.assert_array_equal(values[0], [1.5, 2.5])
    recording = joint.record(0.3, rate_Hz=1000)
    assert recording.channels == ["angle_rad", "torque_Nm", "current_A"]
    assert recording.sample_rate_Hz == 1000.0 and np.nanmax(recording["torque_Nm"]) == 1.5


def test_references_are_sent_while_the_joint_is_enabled(joint):
    joint.enable()
    for torque_Nm in (0.0, 5.0, 60.0):
        joint.send("torque", torque_Nm=torque_Nm, valid_s=1.0)
        joint.poll(0.05)
    assert joint.information["state"] == "enabled"
    assert joint.counts["references"] == 3 and joint.counts["refused"] == {"out_of_range": 1}
    joint.stop(2)
    assert joint.information["state"] == "stop"
    joint.disable()
    assert joint.information["state"] == "ready"


def test_joints_are_found(path):
    assert link.find_joints(unix=path, wait_s=0.2) == [1]
    assert link.find_joints(unix=pathlib.Path(f"{path}_of_nobody"), wait_s=0.01) == []
