"""Estimators as modules of PyTorch, against torsio's own step."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import torsio

torch = pytest.importorskip("torch")
import torsio.torch  # noqa: E402

FAMILIES = {
    "grey_box": {},
    "linear": {},
    "linear_coulomb": {},
    "polynomial": {},
    "maxwell_slip": {},
    "prandtl_ishlinskii": {},
    "mlp": {"layers": "8", "epochs": "60"},
    "gru": {"layers": "8", "epochs": "2"},
    "lstm": {"layers": "8", "epochs": "2"},
    "parametric_gp": {},
    "viscoelastic": {},
    "hammerstein_wiener": {"structure": "given", "input_degree": "1", "output_degree": "2"},
}
# Largest error of the value as a share of its range, and of the error bar as a share of itself: at most ten times what
# was measured.
BOUNDS = {"double": (1e-6, 1e-6), "mixed": (1e-5, 1e-5), "float": (1e-4, 1e-5)}
OTHER_BOUNDS = {
    ("parametric_gp", "float"): (2e-4, 5e-2),
    ("hammerstein_wiener", "float"): (5e-2, 1e-5),
}
TICKS = 400


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope="module")
def fitted(dataset):
    """Models by family, each fitted once."""
    models = {}

    def of(family):
        if family not in models:
            models[family] = torsio.fit(dataset, family, seed=1, **FAMILIES[family])
        return models[family]

    return of


@pytest.fixture(scope="module")
def rows(other_sweep) -> np.ndarray:
    """Parts of a recording, one for each joint: (ticks, joints, inputs)."""
    whole = np.column_stack([other_sweep[c] for c in ("gear_angle_rad", "joint_angle_rad")])
    starts = np.linspace(0, len(whole) - TICKS, 8).astype(int)
    return np.stack([whole[start : start + TICKS] for start in starts], axis=1)


def run(module, rows, state):
    """Values, error bars and faults of ticks, each (ticks, joints)."""
    out = ([], [], [])
    with torch.no_grad():
        for row in rows:
            *estimate, state = module(torch.as_tensor(row, dtype=state.dtype), state)
            for values, value in zip(out, estimate):
                values.append(value[:, 0].numpy())
    return tuple(np.array(values) for values in out)


def run_module(model, rows, precision="mixed"):
    module = torsio.torch.estimator(model, precision=precision)
    return run(module, rows, module.zero_state(rows.shape[1]))


@pytest.mark.parametrize("precision", ["double", "mixed", "float"])
@pytest.mark.parametrize("family", FAMILIES)
def test_a_module_is_the_estimator(fitted, rows, family, precision):
    model = fitted(family)
    assert model.estimator().raw_inputs == ["gear_angle_rad", "joint_angle_rad"]
    value, std_dev, fault = run_module(model, rows, precision)
    of_value, of_bar = OTHER_BOUNDS.get((family, precision), BOUNDS[precision])
    used = 0
    for joint in range(rows.shape[1]):
        expected = model.estimator().run(rows[:, joint])
        assert np.abs(value[:, joint] - expected.value).max() < of_value * np.ptp(value)
        np.testing.assert_array_equal(fault[:, joint], expected.fault)
        np.testing.assert_allclose(std_dev[:, joint], expected.std_dev, rtol=of_bar)
        used += (expected.fault == torsio.Fault.none).sum()
    assert used > value.size // 4


def test_a_saved_module_needs_no_torsio(fitted, rows, tmp_path):
    model = fitted("grey_box")
    file = tmp_path / "joint.pt"
    torsio.torch.save(model, file)
    extra = {"metadata.json": ""}
    loaded = torch.jit.load(str(file), _extra_files=extra)
    metadata = json.loads(extra["metadata.json"])
    assert metadata["inputs"] == ["gear_angle_rad", "joint_angle_rad"]
    assert metadata["sample_rate_Hz"] == model.sample_rate_Hz
    assert metadata["faults"][metadata["faults"].index("none")] == torsio.Fault.none.name
    state = torch.zeros(rows.shape[1], metadata["state_width"], dtype=torch.float64)
    for own, of_file in zip(run_module(model, rows), run(loaded, rows, state)):
        np.testing.assert_array_equal(own, of_file)
    code = (
        "import sys, torch\n"
        f"module = torch.jit.load({str(file)!r})\n"
        f"module(torch.zeros(3, 2, dtype=torch.float64), torch.zeros(3, {metadata['state_width']}, dtype=torch.float64))\n"
        "assert 'torsio' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("family", ["grey_box", "gru"])
def test_a_batch_is_its_joints(fitted, rows, family):
    model = fitted(family)
    some = np.tile(rows[:200], (1, 8, 1))
    some[:, 40] *= 3.0
    some[100, 41] = np.nan
    batch = run_module(model, some)
    for joint in (0, 1, 7, 40, 41, 63):
        alone = run_module(model, some[:, joint : joint + 1])
        for of_batch, single in zip(batch, alone):
            np.testing.assert_allclose(of_batch[:, joint], single[:, 0], rtol=1e-5, atol=1e-6)


def test_rows_of_the_state_are_reset_alone(fitted, rows):
    module = torsio.torch.estimator(fitted("maxwell_slip"))
    state = module.zero_state(4)
    with torch.no_grad():
        for row in rows[:300]:
            state = module(torch.as_tensor(row[:4]), state)[3]
        fresh = module(torch.as_tensor(rows[300][:4]), module.zero_state(4))
        kept = module(torch.as_tensor(rows[300][:4]), state)
        state[2] = 0.0
        mixed = module(torch.as_tensor(rows[300][:4]), state)
    for of_mixed, of_fresh, of_kept in zip(mixed, fresh, kept):
        torch.testing.assert_close(of_mixed[2], of_fresh[2], rtol=0, atol=0, equal_nan=True)
        for joint in (0, 1, 3):
            torch.testing.assert_close(of_mixed[joint], of_kept[joint], rtol=0, atol=0, equal_nan=True)


@pytest.mark.parametrize("family", ["grey_box", "lstm", "gru", "mlp"])
def test_gradients_are_those_of_finite_differences(fitted, rows, family):
    module = torsio.torch.estimator(fitted(family), precision="double", guards=False)
    state = module.zero_state(1)
    with torch.no_grad():
        for row in rows[:300, 1:2]:
            state = module(torch.as_tensor(row), state)[3]
    inputs = torch.tensor(rows[300, 1:2], requires_grad=True)
    weights = [parameter for parameter in module.parameters() if parameter.numel() > 1]
    assert bool(weights) == (family != "grey_box")
    module(inputs, state)[0].sum().backward()

    def value(at):
        with torch.no_grad():
            return module(at, state)[0].item()

    for column in range(2):
        gradient = inputs.grad[0, column].item()
        # A network has numbers of 32 bits.
        step = 1e-5 if weights else 1e-8
        plus, minus = inputs.detach().clone(), inputs.detach().clone()
        plus[0, column] += step
        minus[0, column] -= step
        own = value(inputs)
        # A spring with friction has a kink where its motion turns: there the gradient is one of the two or between.
        sides = sorted([(value(plus) - own) / step, (own - value(minus)) / step])
        margin = 2e-2 * max(abs(side) for side in sides) + 1e-3 * abs(inputs.grad).max().item()
        assert sides[0] - margin < gradient < sides[1] + margin
    for weight in weights[:2]:
        assert torch.isfinite(weight.grad).all()
        place = np.unravel_index(int(weight.grad.abs().argmax()), weight.shape)
        step = 1e-2
        with torch.no_grad():
            weight[place] += step
            plus = value(inputs)
            weight[place] -= 2.0 * step
            minus = value(inputs)
            weight[place] += step
        assert weight.grad[place].item() == pytest.approx((plus - minus) / (2.0 * step), rel=2e-2)


def test_a_module_moves_to_a_device(fitted):
    if not torch.cuda.is_available():
        pytest.skip("no CUDA device")
    model = fitted("lstm")
    inputs = torch.full((64, 2), 0.01, dtype=torch.float64)
    own = torsio.torch.estimator(model)
    moved = torsio.torch.estimator(model).to("cuda")
    state = moved.zero_state(64, device=torch.device("cuda"))
    for of_device, of_host in zip(moved(inputs.cuda(), state), own(inputs, own.zero_state(64))):
        assert of_device.is_cuda
        torch.testing.assert_close(of_device.cpu(), of_host, equal_nan=True)


def test_every_number_of_a_module_is_a_buffer_or_parameter(fitted):
    # What is neither stays on the processor when the module moves.
    module = torsio.torch.estimator(fitted("grey_box")).to("meta")
    assert all(tensor.device.type == "meta" for tensor in (*module.buffers(), *module.parameters()))
    assert not [name for name, value in vars(module).items() if isinstance(value, torch.Tensor)]
    assert module.zero_state(3, device=torch.device("meta")).device.type == "meta"


@pytest.fixture(scope="module")
def drive(sweep) -> torsio.Recording:
    """A joint that follows a position, from which an actuator network is trained."""
    rng = np.random.default_rng(1)
    target = np.cumsum(rng.normal(0.0, 0.02, 4000)) * 0.1
    angle = np.zeros_like(target)
    for n in range(1, len(target)):
        angle[n] = angle[n - 1] + 0.05 * (target[n - 1] - angle[n - 1])
    speed = np.gradient(angle) * 200.0
    return torsio.Recording.from_dict(
        {
            "joint_target_rad": target,
            "joint_angle_rad": angle,
            "joint_speed_rad_s": speed,
            "torque_Nm": 40.0 * (target - angle) - 2.0 * speed + rng.normal(0.0, 0.05, len(target)),
        },
        rate_Hz=200.0,
        name="drive",
    )


ERROR, SPEED = "joint_target_rad - joint_angle_rad", "joint_speed_rad_s"
LAGGED = [f"lag({SPEED}, 2)", ERROR, SPEED, f"lag({ERROR}, 2)"]


def features(drive) -> tuple:
    return drive["joint_target_rad"] - drive["joint_angle_rad"], drive["joint_speed_rad_s"]


def test_isaac_lab_calls_an_mlp(drive, tmp_path):
    model = torsio.fit(drive, "mlp", inputs=LAGGED, seed=1, layers="8", epochs="60", activation="elu")
    file = tmp_path / "mlp.pt"
    torsio.torch.save(model, file, layout="isaaclab")
    extra = {"metadata.json": ""}
    net = torch.jit.load(str(file), map_location="cpu", _extra_files=extra).eval()
    metadata = json.loads(extra["metadata.json"])
    assert (metadata["input_order"], metadata["input_idx"]) == ("pos_vel", [0, 2])
    error, speed = features(drive)
    # Newest first, position errors before speeds, as ActuatorNetMLP gathers its histories.
    x = np.column_stack([np.roll(error, lag) for lag in (0, 2)] + [np.roll(speed, lag) for lag in (0, 2)])[100:200]
    with torch.inference_mode():
        torque = net(torch.tensor(x, dtype=torch.float32))
    assert torque.shape == (100, 1) and torque.dtype == torch.float32
    np.testing.assert_allclose(torque[:, 0], alone(model, drive)[100:200], rtol=1e-4, atol=1e-4)


def test_isaac_lab_calls_an_lstm(drive, tmp_path):
    model = torsio.fit(drive, "lstm", inputs=[SPEED, ERROR], seed=1, layers="8-8", epochs="3")
    file = tmp_path / "lstm.pt"
    torsio.torch.save(model, file, layout="isaaclab")
    net = torch.jit.load(str(file), map_location="cpu").eval()
    # What ActuatorNetLSTM reads of it.
    layers = len(net.lstm.state_dict()) // 4
    hidden_size = net.lstm.state_dict()["weight_hh_l0"].shape[1]
    assert (layers, hidden_size) == (2, 8)
    assert (net.lstm.num_layers, net.lstm.hidden_size) == (2, 8)
    joints = 5
    hidden = torch.zeros(layers, joints, hidden_size)
    cell = torch.zeros(layers, joints, hidden_size)
    x = np.column_stack(features(drive)).astype(np.float32)
    found = []
    with torch.inference_mode():
        for row in x[:300]:
            torque, (hidden[:], cell[:]) = net(torch.tensor(row).expand(joints, 1, 2), (hidden, cell))
            assert torque.shape == (joints, 1)
            found.append(torque[:, 0].numpy())
    found = np.array(found)
    assert np.ptp(found, axis=1).max() < 1e-5
    np.testing.assert_allclose(found[:, 0], alone(model, drive)[:300], rtol=1e-4, atol=1e-4)


def alone(model, recording) -> np.ndarray:
    """The model without guards."""
    rows = np.column_stack([recording[c] for c in model.estimator().raw_inputs])
    module = torsio.torch.estimator(model, precision="double", guards=False)
    return run(module, rows[:, None], module.zero_state(1))[0][:, 0]


def test_isaac_lab_refuses_other_models(fitted, drive, tmp_path):
    file = tmp_path / "other.pt"
    with pytest.raises(torsio.UsageError, match="grey_box|joint_target_rad"):
        torsio.torch.save(fitted("grey_box"), file, layout="isaaclab")
    with pytest.raises(torsio.UsageError, match="joint_target_rad - joint_angle_rad"):
        torsio.torch.save(fitted("lstm"), file, layout="isaaclab")
    gru = torsio.fit(drive, "gru", inputs=[ERROR, SPEED], seed=1, layers="4", epochs="1")
    with pytest.raises(torsio.UsageError, match="gru"):
        torsio.torch.save(gru, file, layout="isaaclab")
    lagged = torsio.fit(drive, "lstm", inputs=LAGGED, seed=1, layers="4", epochs="1")
    with pytest.raises(torsio.UsageError, match="without lags"):
        torsio.torch.save(lagged, file, layout="isaaclab")
    assert os.listdir(tmp_path) == []


def test_wrong_calls_are_refused_by_name(fitted, dataset, tmp_path):
    model = fitted("linear")
    file = tmp_path / "joint.pt"
    with pytest.raises(torsio.UsageError, match="precision.*half"):
        torsio.torch.estimator(model, precision="half")
    with pytest.raises(torsio.UsageError, match="layout.*newton"):
        torsio.torch.save(model, file, layout="newton")
    with pytest.raises(torsio.UsageError, match="bouc_wen"):
        torsio.torch.save(torsio.fit(dataset, "bouc_wen", seed=1), file)
    assert os.listdir(tmp_path) == []
    file.write_text("mine")
    with pytest.raises(torsio.UsageError, match="joint.pt: the file exists"):
        torsio.torch.save(model, file)
    assert file.read_text() == "mine"
    torsio.torch.save(model, file, overwrite=True)
    torch.jit.load(str(file))


def test_no_half_of_a_file_is_left(fitted, tmp_path, monkeypatch):
    def fails(module, name, **_):
        with open(name, "w") as out:
            out.write("half")
        raise KeyboardInterrupt

    file = tmp_path / "joint.pt"
    file.write_text("mine")
    monkeypatch.setattr(torch.jit, "save", fails)
    with pytest.raises(KeyboardInterrupt):
        torsio.torch.save(fitted("linear"), file, overwrite=True)
    assert os.listdir(tmp_path) == ["joint.pt"] and file.read_text() == "mine"


def test_the_command_writes_a_module(fitted, tmp_path, monkeypatch, capsys):
    fitted("linear").save(tmp_path / "joint.safetensors")

    monkeypatch.chdir(tmp_path)
    arguments = ["joint.safetensors", "-o", "joint.pt", "--real", "double"]
    command = [sys.executable, "-m", "torsio.torch", *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "linear" in done.stdout and "1000 Hz" in done.stdout
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode == 1 and again.stderr.startswith("torsio.torch: joint.pt: the file exists")
    torch.jit.load(str(tmp_path / "joint.pt"))
    for arguments, code, message in (
        (("absent.safetensors", "-o", "new.pt"), 1, "absent.safetensors"),
        (("joint.pt", "-o", "new.pt"), 1, "joint.pt"),
        (("joint.safetensors", "-o", "folder/new.pt"), 1, "folder"),
        (("joint.safetensors", "-o", "new.pt", "--layout", "isaaclab"), 1, "isaaclab"),
        (("joint.safetensors", "-o", "new.pt", "--real", "half"), 2, "half"),
        (("joint.safetensors",), 2, "-o"),
    ):
        try:
            found = torsio.torch._main(list(arguments))
        except SystemExit as error:
            found = error.code
        assert found == code and message in capsys.readouterr().err
        assert not (tmp_path / "new.pt").exists()
    assert torsio.torch._main(["joint.safetensors", "-o", "joint.pt", "--overwrite", "--no-guards"]) == 0


def test_torsio_alone_does_not_import_torch(tmp_path):
    (tmp_path / "torch.py").write_text("raise ModuleNotFoundError(\"No module named 'torch'\", name='torch')\n")
    code = (
        "import sys, torsio\n"
        "assert 'torch' not in sys.modules\n"
        "try:\n"
        "    torsio.torch\n"
        "except ImportError as error:\n"
        "    assert 'python3-torch' in str(error), error\n"
        "else:\n"
        "    sys.exit(1)\n"
    )
    paths = os.pathsep.join([str(tmp_path), os.path.dirname(os.path.dirname(torsio.__file__))])
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": paths})
