"""A joint of MuJoCo 3 whose spring is a model of torsio, through libtorsio.so by ctypes (docs/robot/c.md).

    torsio export joint.safetensors --mjcf -o elbow.xml
    python3 step_mujoco_joint.py LIBTORSIO joint.safetensors elbow.xml

Not tested with MuJoCo 3, which Debian 12 has no package of: tests/mujoco runs it with a substitute for the package `mujoco`.
In C++ torsio::MujocoSprings does the same, without Python in the loop, for several springs and for RK4.
"""

import ctypes
import sys

import mujoco
import numpy


class Estimate(ctypes.Structure):
    _fields_ = [
        ("value", ctypes.c_double),
        ("std_dev", ctypes.c_double),
        ("novelty", ctypes.c_double),
        ("fault", ctypes.c_int32),
        ("reserved", ctypes.c_int32),
    ]


def load_library(path: str) -> ctypes.CDLL:
    library = ctypes.CDLL(path)
    pointer, size, text = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p
    for name, result, arguments in [
        ("torsio_last_error", text, []),
        ("torsio_fault_name", text, [ctypes.c_int32]),
        ("torsio_load_at_rate", pointer, [text, text, ctypes.c_double]),
        ("torsio_input_count", size, [pointer]),
        ("torsio_input_name", text, [pointer, size]),
        ("torsio_unset_zero", text, [pointer, size]),
        ("torsio_set_zero", ctypes.c_int, [pointer, text, ctypes.c_double]),
        ("torsio_reset", None, [pointer]),
        ("torsio_step", Estimate, [pointer, ctypes.POINTER(ctypes.c_double), size]),
        ("torsio_state_size", size, [pointer]),
        ("torsio_state_save", ctypes.c_int, [pointer, pointer, size]),
        ("torsio_state_load", ctypes.c_int, [pointer, pointer, size]),
    ]:
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class Spring:
    """The actuator `<prefix>_spring` of a file of torsio export --mjcf, whose bias is the torque on the joint.

    The state before a tick and the one after it are in data.userdata, so that copies of `data` are branches of the
    simulation. The callback steps from the state before; `commit`, once after each mj_step, replaces it.
    """

    HAS_BEFORE, HAS_AFTER, TIME, PLACES = 0, 1, 2, 3

    def __init__(self, library: ctypes.CDLL, path: str, model, prefix: str, gear_ratio: float):
        if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise ValueError("RK4 evaluates several times per step: use torsio::MujocoSprings, or another integrator")
        self.torsio = library
        self.spring = library.torsio_load_at_rate(path.encode(), None, 1.0 / model.opt.timestep)
        if not self.spring:
            raise ValueError(library.torsio_last_error().decode())
        while name := library.torsio_unset_zero(self.spring, 0):
            library.torsio_set_zero(self.spring, name, 0.0)
        self.actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, f"{prefix}_spring")
        gear = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{prefix}_gear")
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{prefix}_joint")
        if min(self.actuator, gear, joint) < 0:
            raise ValueError(f"no {prefix}_spring, {prefix}_gear or {prefix}_joint")
        self.position = [model.jnt_qposadr[gear], model.jnt_qposadr[joint]]
        known = {
            "gear_angle_rad": (1.0, 0.0),
            "joint_angle_rad": (0.0, 1.0),
            "spring_deflection_rad": (1.0, -1.0),
            "motor_angle_rad": (gear_ratio, 0.0),
        }
        names = [library.torsio_input_name(self.spring, i).decode() for i in range(library.torsio_input_count(self.spring))]
        for name in names:
            if name not in known:
                raise ValueError(f"the channel {name} of the model: expected one of {', '.join(known)}")
        self.factors = [known[name] for name in names]
        self.raw = (ctypes.c_double * len(names))()
        self.bytes = library.torsio_state_size(self.spring)
        self.numbers = -(-self.bytes // 8)
        needed = self.PLACES + 2 * self.numbers
        if model.nuserdata < needed:
            raise ValueError(f'expected <size nuserdata="{needed}"/> or more, found {model.nuserdata}')
        self.estimate = Estimate()

    def state(self, data, is_after: bool):
        begin = self.PLACES + (self.numbers if is_after else 0)
        return data.userdata[begin : begin + self.numbers]

    def step_from(self, data, has_state: bool, is_after: bool) -> Estimate:
        address = self.state(data, is_after).ctypes.data
        if not has_state or self.torsio.torsio_state_load(self.spring, address, self.bytes) != 0:
            self.torsio.torsio_reset(self.spring)
        gear, joint = (float(data.qpos[address]) for address in self.position)
        self.raw[:] = [of_gear * gear + of_joint * joint for of_gear, of_joint in self.factors]
        return self.torsio.torsio_step(self.spring, self.raw, len(self.raw))

    def bias(self, model, data, actuator: int) -> float:
        if actuator != self.actuator:
            return 0.0
        record = data.userdata
        if record[self.HAS_AFTER] == 1.0 and data.time > record[self.TIME]:
            return self.step_from(data, True, True).value  # of the next tick, whose step has not begun
        self.estimate = self.step_from(data, record[self.HAS_BEFORE] == 1.0, False)
        self.torsio.torsio_state_save(self.spring, self.state(data, True).ctypes.data, self.bytes)
        record[self.HAS_AFTER], record[self.TIME] = 1.0, data.time
        return self.estimate.value

    def commit(self, data) -> None:
        record = data.userdata
        if record[self.HAS_AFTER] == 1.0 and data.time > record[self.TIME]:
            self.state(data, False)[:] = self.state(data, True)
            record[self.HAS_BEFORE], record[self.HAS_AFTER] = 1.0, 0.0


def main(library_path: str, model_path: str, xml_path: str) -> int:
    torsio = load_library(library_path)
    model = mujoco.MjModel.from_xml_path(xml_path)
    data = mujoco.MjData(model)
    spring = Spring(torsio, model_path, model, "elbow", gear_ratio=120.0)
    mujoco.set_mjcb_act_bias(spring.bias)
    for step in range(1000):
        data.ctrl[0] = 2e-3 * step  # A
        mujoco.mj_step(model, data)
        spring.commit(data)
        if step % 100 == 99:
            fault = torsio.torsio_fault_name(spring.estimate.fault).decode()
            print(f"{data.time:.1f} s: {numpy.round(data.qpos, 4)} rad, {spring.estimate.value:.6f} Nm, {fault}")
    mujoco.set_mjcb_act_bias(None)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
