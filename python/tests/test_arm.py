import pathlib

import numpy as np
import pytest

import torsio

URDF = pathlib.Path(__file__).parents[2] / "share" / "torsio" / "arm6.urdf"


@pytest.fixture
def arm() -> torsio.Arm:
    return torsio.Arm("arm6")


@pytest.fixture
def poses() -> np.ndarray:
    return np.random.default_rng(1).uniform(-2.5, 2.5, (50, 6))


def test_the_equation_of_motion_is_one(arm, poses):
    rng = np.random.default_rng(2)
    speed, acceleration = rng.normal(size=(2, 50, 6))
    torque = arm.inverse(poses, speed, acceleration)
    np.testing.assert_allclose(arm.forward(poses, speed, torque), acceleration, atol=1e-8)
    bias = arm.inverse(poses, speed, np.zeros_like(poses))
    inertia = np.einsum("nij,nj->ni", arm.mass_matrix(poses), acceleration)
    np.testing.assert_allclose(torque, bias + inertia, atol=1e-10)
    still = np.zeros_like(poses)
    np.testing.assert_allclose(arm.gravity(poses), arm.inverse(poses, still, still), atol=1e-12)


def test_the_jacobian_is_the_derivative_of_the_flange(arm, poses):
    step = 1e-6
    jacobian = arm.jacobian(poses)
    for joint in range(len(arm)):
        moved = poses.copy()
        moved[:, joint] += step
        difference = (arm.frame(moved) - arm.frame(poses))[:, :3, 3] / step
        np.testing.assert_allclose(jacobian[:, :3, joint], difference, atol=1e-5)


def test_leading_dimensions_stay(arm, poses):
    one = arm.gravity(poses[0])
    assert one.shape == (6,)
    cube = arm.gravity(poses.reshape(5, 10, 6))
    assert cube.shape == (5, 10, 6)
    np.testing.assert_array_equal(cube[0, 0], one)
    assert arm.mass_matrix(poses.reshape(5, 10, 6)).shape == (5, 10, 6, 6)
    np.testing.assert_array_equal(arm.gravity(np.asfortranarray(poses)), arm.gravity(poses))
    assert arm.gravity(np.empty((0, 6))).shape == (0, 6)


def test_a_payload_and_a_tilt_change_the_weight(arm):
    pose = np.zeros(6)
    arm.set_payload(0.0)
    without = arm.gravity(pose)
    arm.set_payload(2.0, (0.0, 0.0, 0.1))
    assert abs(arm.gravity(pose)[1]) > abs(without[1])
    arm.set_gravity((0.0, 0.0, 0.0))
    np.testing.assert_array_equal(arm.gravity(pose), np.zeros(6))
    arm.set_gravity((4.9, 0.0, -8.5))
    assert np.isfinite(arm.gravity(pose)).all()


def test_a_urdf_file_is_the_same_arm(arm, poses):
    other = torsio.Arm.from_urdf(URDF)
    assert other.joints == arm.joints == [f"joint{j}" for j in range(1, 7)]
    arm.set_payload(0.0)
    np.testing.assert_allclose(other.gravity(poses), arm.gravity(poses), atol=1e-12)
    assert (arm.lowest_rad < arm.highest_rad).all() and (arm.effort_Nm > 0).all()
    assert (arm.speed_rad_s > 0).all() and arm.name == "arm6"


def test_what_is_not_finite_is_not_a_number(arm, poses):
    poses[3, 2] = np.nan
    torque = arm.gravity(poses)
    assert np.isnan(torque[3]).any()
    assert np.isfinite(np.delete(torque, 3, axis=0)).all()


@pytest.mark.parametrize(
    "call",
    [
        lambda arm: arm.gravity(np.zeros(5)),
        lambda arm: arm.gravity(0.0),
        lambda arm: arm.gravity("six"),
        lambda arm: arm.gravity(None),
        lambda arm: arm.inverse(np.zeros((2, 6)), np.zeros((3, 6)), np.zeros((2, 6))),
        lambda arm: arm.frame(np.zeros(6), link=6),
        lambda arm: arm.set_payload(-1.0),
        lambda arm: arm.set_payload(np.nan),
        lambda arm: arm.set_payload(1.0, (0.0, 0.0)),
        lambda arm: arm.set_payload(1.0, (0.0, 0.0, 0.0), (1.0,)),
        lambda arm: arm.set_gravity((0.0, np.inf, 0.0)),
    ],
)
def test_what_does_not_fit_is_refused(arm, call):
    with pytest.raises(torsio.UsageError):
        call(arm)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(torsio.Error, match="nothing.yaml"):
        torsio.Arm(tmp_path / "nothing.yaml")
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot><link/></robot>")
    with pytest.raises(torsio.Error, match="broken.urdf"):
        torsio.Arm.from_urdf(broken)
