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


def hold(simulation: torsio.ArmSimulation, ticks: int, **step) -> dict[str, np.ndarray]:
    start = np.tile(np.deg2rad([0, -60, 100, 0, 40, 0]), (len(simulation), 1))
    for _ in range(ticks):
        state = simulation.step(position_rad=start, **step)
    return state


def test_a_row_is_an_arm_of_its_own():
    both = hold(torsio.ArmSimulation("arm6", rows=2, seed=5), 50)
    assert both["joint_angle_rad"].shape == (2, 6) and both["is_stopped"].shape == (2,)
    second = hold(torsio.ArmSimulation("arm6", rows=1, seed=6), 50)
    for name in both:
        np.testing.assert_array_equal(both[name][1], second[name][0], err_msg=name)
    assert not np.array_equal(both["torque_Nm"][0], both["torque_Nm"][1])


def test_a_force_on_the_flange_is_an_external_torque(arm):
    simulation = torsio.ArmSimulation("arm6", rows=1)
    before = hold(simulation, 500)
    after = hold(simulation, 500, force_N=[[0.0, 0.0, -40.0]])
    jacobian = arm.jacobian(after["joint_angle_rad"][0])
    expected = jacobian[:3].T @ [0.0, 0.0, -40.0]
    np.testing.assert_allclose(after["truth_external_torque_Nm"][0], expected, atol=0.2)
    change = after["external_torque_Nm"][0] - before["external_torque_Nm"][0]
    assert change[1] == pytest.approx(expected[1], rel=0.3)
    assert not after["is_stopped"].any() and not after["is_contact"].any()
    assert np.isnan(after["external_torque_std_dev_Nm"]).all()  # no contacts are looked for


def test_an_arm_is_guided_driven_by_torques_and_reset():
    simulation = torsio.ArmSimulation("arm6", rows=2)
    hold(simulation, 20)
    start = hold(simulation, 1)["joint_angle_rad"]
    for _ in range(300):
        guided = simulation.step(guided=True, force_N=[[0.0, 40.0, 0.0], [0.0, 0.0, 0.0]])
    assert abs(guided["joint_angle_rad"] - start)[0].max() > 0.01
    assert abs(guided["joint_angle_rad"] - start)[1].max() < 0.01
    simulation.reset(np.array([True, False]))
    again = simulation.step(guided=True)["joint_angle_rad"]
    assert abs(again - start)[0].max() < 1e-3
    weight = torsio.Arm("arm6").gravity(again)
    driven = simulation.step(torque_Nm=weight)
    assert np.isfinite(driven["torque_Nm"]).all()
    simulation.end_reaction()


@pytest.mark.parametrize(
    "call",
    [
        lambda of: of.step(),
        lambda of: of.step(guided=True, torque_Nm=np.zeros((1, 6))),
        lambda of: of.step(position_rad=np.zeros(6)),
        lambda of: of.step(position_rad=np.zeros((2, 6))),
        lambda of: of.step(guided=True, force_N=np.zeros((1, 6))),
        lambda of: of.reset([True, False]),
        lambda of: torsio.ArmSimulation("arm6", rows=0),
        lambda of: torsio.ArmSimulation("arm6", reaction="jump"),
        lambda of: torsio.ArmSimulation("arm6", reaction="stop"),
        lambda of: torsio.ArmSimulation("arm6", start_rad=[0.0]),
    ],
)
def test_a_simulation_refuses_what_does_not_fit(call):
    with pytest.raises(torsio.UsageError):
        call(torsio.ArmSimulation("arm6"))


def test_references_that_are_not_finite_hold_the_arm():
    simulation = torsio.ArmSimulation("arm6")
    state = hold(simulation, 20)
    for _ in range(50):
        other = simulation.step(position_rad=np.full((1, 6), np.nan))
    assert abs(other["joint_angle_rad"] - state["joint_angle_rad"]).max() < 0.01
