"""python_example_test.py TORSIO LIBTORSIO: runs python/examples/step_mujoco_joint.py with a substitute for the package mujoco (two
bodies, semi-implicit integration), and compares the torque with that of libtorsio on the logged angles."""
import ctypes
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import types

try:
    import numpy
except ImportError:
    sys.exit(77)

INERTIA_KG_M2 = (0.874, 0.15)
TORQUE_PER_CURRENT_NM_A = 12.48
callback = None


class Data:
    def __init__(self, model):
        self.userdata = numpy.zeros(model.nuserdata)
        self.qpos, self.qvel, self.ctrl, self.time = numpy.zeros(2), numpy.zeros(2), numpy.zeros(2), 0.0


def step(model, data, log=None):
    callback(model, data, 1)  # a repeated evaluation, as of mj_forward
    torque = callback(model, data, 1)
    assert callback(model, data, 0) == 0.0
    if log is not None:
        log.append((data.qpos.copy(), torque))
    forces = (TORQUE_PER_CURRENT_NM_A * data.ctrl[0] - torque - 10.0 * data.qvel[0], torque - 20.0 * data.qvel[1])
    data.qvel += model.opt.timestep * numpy.array(forces) / INERTIA_KG_M2
    data.qpos += model.opt.timestep * data.qvel
    data.time += model.opt.timestep


def set_callback(function):
    global callback
    callback = function


def substitute(nuserdata):
    names = {"elbow_motor": 0, "elbow_spring": 1, "elbow_gear": 0, "elbow_joint": 1}
    model = types.SimpleNamespace(
        opt=types.SimpleNamespace(integrator=0, timestep=0.001), nuserdata=nuserdata, jnt_qposadr=[0, 1])
    module = types.ModuleType("mujoco")
    module.mjtIntegrator = types.SimpleNamespace(mjINT_RK4=1)
    module.mjtObj = types.SimpleNamespace(mjOBJ_ACTUATOR=0, mjOBJ_JOINT=1)
    module.mj_name2id = lambda _model, _kind, name: names.get(name, -1)
    module.MjModel = types.SimpleNamespace(from_xml_path=lambda _path: model)
    module.MjData, module.mj_step, module.set_mjcb_act_bias = Data, step, set_callback
    return module, model


def refusal(make):
    try:
        make()
    except ValueError as error:
        return str(error)
    return ""


torsio, library = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    def run(*arguments):
        subprocess.run([torsio, *arguments], cwd=folder, check=True, capture_output=True)

    run("simulate", "dfki-50", "sweep", "--duration", "30s", "-o", "a.csv")
    run("fit", "a.csv", "--model", "maxwell_slip", "-o", "joint.safetensors")
    run("export", "joint.safetensors", "--mjcf", "-o", "elbow.xml")
    xml = pathlib.Path(folder, "elbow.xml").read_text()
    nuserdata = int(xml.split('nuserdata="')[1].split('"')[0])
    sys.modules["mujoco"], model = substitute(nuserdata)
    sys.dont_write_bytecode = True
    source = pathlib.Path(__file__).parents[2] / "python/examples/step_mujoco_joint.py"
    spec = importlib.util.spec_from_file_location("example", source)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    path = str(pathlib.Path(folder, "joint.safetensors"))
    assert example.main(library, path, "elbow.xml") == 0

    api = example.load_library(library)
    spring = example.Spring(api, path, model, "elbow", 120.0)
    set_callback(spring.bias)
    data, log = Data(model), []
    for tick in range(500):
        data.ctrl[0] = 1.5 * numpy.sin(0.02 * tick)
        step(model, data, log)
        spring.commit(data)
    alone = example.Spring(api, path, model, "elbow", 120.0).spring
    for angles, torque in log:
        raw = (ctypes.c_double * len(spring.factors))(*[g * angles[0] + j * angles[1] for g, j in spring.factors])
        assert api.torsio_step(alone, raw, len(raw)).value == torque
    assert max(abs(torque) for _, torque in log) > 1.0

    model.nuserdata = 5
    assert "nuserdata=" in refusal(lambda: example.Spring(api, path, model, "elbow", 120.0))
    model.opt.integrator = 1
    assert "RK4" in refusal(lambda: example.Spring(api, path, model, "elbow", 120.0))
