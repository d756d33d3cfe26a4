"""Estimators as PyTorch modules: batches of joints, differentiable, saved as TorchScript.

    module = torsio.torch.estimator(torsio.load("joint.safetensors"))
    state = module.zero_state(4096)
    value, std_dev, fault, state = module(inputs, state)      # inputs: (4096, len(module.raw_inputs)), SI
    torsio.torch.save(model, "joint.pt")                      # torch.jit.load needs no torsio

    python3 -m torsio.torch joint.safetensors -o joint.pt

One call is one tick at the sample rate of the model. Documentation: docs/robot/simulators.md.
"""

import argparse
import os
import sys
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

try:
    import torch
    from torch import Tensor, nn
except ModuleNotFoundError as error:
    if error.name != "torch":
        raise
    raise ImportError("torsio.torch needs PyTorch. Debian: apt install python3-torch", name="torch") from error

from . import _core
from ._core import Model, UsageError
from ._faults import Fault

_UNARY = {
    "negate": torch.neg,
    "absolute": torch.abs,
    "sign": torch.sign,
    "square_root": torch.sqrt,
    "exponential": torch.exp,
    "tangent": torch.tanh,
    "sigmoid": torch.sigmoid,
    "sine": torch.sin,
    "cosine": torch.cos,
    "arc_tangent": torch.atan,
    "is_not": torch.logical_not,
}
_BINARY = {
    "add": torch.add,
    "subtract": torch.sub,
    "multiply": torch.mul,
    "divide": torch.div,
    "minimum": torch.minimum,
    "maximum": torch.maximum,
    "power": torch.pow,
    "less": torch.lt,
    "less_or_equal": torch.le,
    "both": torch.logical_and,
    "either": torch.logical_or,
}
# The numbers of model and guards, and those of inputs, state and features.
_TYPES = {
    "double": (torch.float64, torch.float64),
    "mixed": (torch.float32, torch.float64),
    "float": (torch.float32, torch.float32),
}
_LAYOUTS = ("estimator", "isaaclab")


_Tick = Tuple[Tensor, Tensor, Tensor, Tensor]


def _check_shapes(inputs: Tensor, state: Tensor, raw_inputs: int, state_width: int) -> None:
    if inputs.dim() != 2 or inputs.shape[1] != raw_inputs:
        raise ValueError(f"inputs: expected (joints, {raw_inputs}), found {list(inputs.shape)}")
    if state.dim() != 2 or state.shape[0] != inputs.shape[0] or state.shape[1] != state_width:
        raise ValueError(f"state: expected ({inputs.shape[0]}, {state_width}), found {list(state.shape)}")


class Estimator(nn.Module):
    """A tick of an estimator for a batch of joints, as `torsio.Estimator.step` has it.

    Guards, fallback, error bar and fault are those of the estimator, without the rule of jumps; a tick without inputs is a
    long gap. Weights of networks are parameters, all other numbers are buffers.
    """

    state_width: int
    raw_inputs: List[str]

    def __init__(self, model: Model, *, precision: str = "mixed", guards: bool = True) -> None:
        super().__init__()
        if not isinstance(model, Model):
            raise UsageError(f"model: expected a torsio.Model, as torsio.load(path) returns it, found {type(model).__name__}")
        graph: Dict[str, Any] = _core.step_graph(model, precision=precision, guards=guards)
        real, state = _TYPES[precision]
        self._types = {"real": real, "wide": state, "single": torch.float32, "truth": torch.bool}
        self.dtype = state
        self.period_s = 1.0 / model.sample_rate_Hz
        self._nodes = graph["nodes"]
        self._outputs = [graph[name] for name in ("value", "std_dev", "fault", "next_state")]
        self.state_width = graph["state_width"]
        self.raw_inputs = list(graph["raw_inputs"])
        self.zeroed_channels = list(model.zeroed_channels)  # the caller subtracts their zeros
        self._names: List[str] = [""] * len(self._nodes)
        for index, node in enumerate(self._nodes):
            self._add_constants(index, node)

    def zero_state(self, joints: int, device: Optional[torch.device] = None) -> Tensor:
        """The state after a reset: (joints, state_width). Set rows to 0 to reset single joints."""
        # One column after the other in memory: each is read by itself.
        return torch.zeros(self.state_width, joints, dtype=self.dtype, device=device).t()

    def forward(self, inputs: Tensor, state: Tensor, timestep_s: Optional[float] = None) -> _Tick:
        """Value, error bar (NaN: none), fault (int32, `torsio.Fault`), each (joints, 1), and the next state.

        timestep_s: the time between two calls; another one than the period of a model that depends on time is `wrong_rate`.
        """
        period_s = self.period_s if timestep_s is None else timestep_s
        _check_shapes(inputs, state, len(self.raw_inputs), self.state_width)
        return self._tick(inputs, state, torch.full((1, 1), period_s, dtype=state.dtype, device=state.device))

    def _tick(self, inputs: Tensor, state: Tensor, timestep_s: Tensor) -> _Tick:
        # Columns are rows here: (quantities, joints), so that each is contiguous.
        rows: List[Tensor] = []
        for index, node in enumerate(self._nodes):
            rows.append(timestep_s if node[0] == "timestep" else self._computed(index, node, rows, inputs, state))
        joints = inputs.shape[0]

        def full(index: int) -> Tensor:
            return rows[index].expand(self._nodes[index][2], joints)

        value, std_dev, fault, next_state = (full(index).t() for index in self._outputs)
        return value, std_dev, fault.to(torch.int32), next_state

    def _add_constants(self, index: int, node: Tuple[Any, ...]) -> None:
        operation, kind, _, operands, _, _, values = node
        if operation in ("interpolation", "held_interpolation"):
            knots = self._nodes[operands[1]][6][0]
            table = self._nodes[operands[2]][6]
            per_width = 1.0 / np.diff(knots)
            cells = np.column_stack([knots[:-1], per_width, table[:-1], np.diff(table, axis=0)])
            self._add_buffer(index, np.ascontiguousarray(cells.T), self._types[kind])
            self.register_buffer(f"_knots_{index}", torch.tensor(knots[1:-1], dtype=self._types[kind]))
        elif operation == "constant":
            dtype = self._types[kind]
            array = np.ascontiguousarray(values.T)  # (columns, rows): rows of a matrix are its inputs
            is_weight = kind == "single" and array.size > 1
            self._add_buffer(index, array, dtype, is_weight)

    def _add_buffer(self, index: int, array: Any, dtype: torch.dtype, is_weight: bool = False) -> None:
        self._names[index] = f"_constant_{index}"
        tensor = torch.tensor(array, dtype=dtype)
        if is_weight:
            self.register_parameter(self._names[index], nn.Parameter(tensor))
        else:
            self.register_buffer(self._names[index], tensor)

    def _computed(self, index: int, node: Tuple[Any, ...], rows: List[Tensor], inputs: Tensor, state: Tensor) -> Tensor:
        operation, kind, width, operands, first, _, _ = node
        if operation == "input":
            return inputs.t().contiguous()
        if operation == "state":
            return state.t()
        if operation == "constant":
            return getattr(self, self._names[index])
        a = rows[operands[0]]
        if operation == "maximum":
            inner = self._nodes[operands[0]]
            if inner[0] == "minimum" and self._is_constant(operands[1]) and self._is_constant(inner[3][1]):
                return torch.clamp(rows[inner[3][0]], rows[operands[1]], rows[inner[3][1]])
        if operation == "tangent" and kind == "single":
            # 2.4 times faster than torch.tanh on a CPU, and within 2e-7 of it.
            return torch.sigmoid(a + a) * 2.0 - 1.0
        if operation in _UNARY:
            return _UNARY[operation](a)
        if operation in _BINARY:
            return _BINARY[operation](a, rows[operands[1]])
        if operation == "select":
            return torch.where(a, rows[operands[1]], rows[operands[2]])
        if operation == "product":
            return torch.mm(rows[operands[1]], a)
        if operation == "sum":
            return a.sum(0, keepdim=True)
        if operation == "largest":
            return a.amax(0, keepdim=True)
        if operation == "part":
            return a.narrow(0, first, width)
        if operation == "joined":
            joints = inputs.shape[0]
            return torch.cat([rows[i].expand(self._nodes[i][2], joints) for i in operands], 0)
        if operation in ("to_real", "to_wide", "to_single"):
            return a.to(self._types[kind])
        return self._interpolated(index, operation == "held_interpolation", a, width)

    def _is_constant(self, index: int) -> bool:
        return bool(self._nodes[index][0] == "constant")

    def _interpolated(self, index: int, is_held: bool, x: Tensor, width: int) -> Tensor:
        cell = torch.bucketize(x[0], getattr(self, f"_knots_{index}"), right=True)
        of_cell = getattr(self, self._names[index]).index_select(1, cell)
        share = (x - of_cell.narrow(0, 0, 1)) * of_cell.narrow(0, 1, 1)
        if is_held:
            share = share.clamp(0.0, 1.0)
        return torch.addcmul(of_cell.narrow(0, 2, width), of_cell.narrow(0, 2 + width, width), share)


def estimator(model: Model, *, precision: str = "mixed", guards: bool = True) -> Estimator:
    """The estimator of a model as a module.

    precision: "mixed" has 64 bits for inputs, state and features, and 32 for model and guards; "float" has 32 for all, which
        do not resolve the difference of two angles well; "double" has 64.
    guards: False gives the value of the model alone, with its own error bar and fault.
    """
    return Estimator(model, precision=precision, guards=guards)


class _Traced(nn.Module):
    """A tick whose operations were recorded, with the interface of `Estimator`."""

    def __init__(self, module: Estimator) -> None:
        super().__init__()
        self.period_s = module.period_s
        self.state_width = module.state_width
        self.raw_inputs: List[str] = list(module.raw_inputs)
        self.register_buffer("_zero", torch.zeros(1, dtype=module.dtype), persistent=False)
        inputs = torch.zeros(2, len(module.raw_inputs), dtype=module.dtype)
        timestep_s = torch.full((1, 1), module.period_s, dtype=module.dtype)
        example = {"_tick": (inputs, module.zero_state(2), timestep_s)}
        self.tick = torch.jit.trace_module(module, example, check_trace=False)

    def forward(self, inputs: Tensor, state: Tensor, timestep_s: Optional[float] = None) -> _Tick:
        period_s = self.period_s
        if timestep_s is not None:
            period_s = timestep_s
        _check_shapes(inputs, state, len(self.raw_inputs), self.state_width)
        return self.tick._tick(inputs, state, torch.full((1, 1), period_s, dtype=state.dtype, device=state.device))


    @torch.jit.export
    def zero_state(self, joints: int) -> Tensor:
        return self._zero.new_zeros([self.state_width, joints]).t()


def script(module: Estimator) -> torch.jit.ScriptModule:
    """The module as TorchScript, for any number of joints."""
    return torch.jit.script(_Traced(module))


class ActuatorNet(nn.Module):
    """An mlp as Isaac Lab's ActuatorNetMLP calls it: (joints, 2 lags) -> (joints, 1), position errors first."""

    def __init__(self, layers: nn.Module) -> None:
        super().__init__()
        self.layers = layers

    def forward(self, x: Tensor) -> Tensor:
        return self.layers(x)


class ActuatorNetLstm(nn.Module):
    """An lstm as Isaac Lab's ActuatorNetLSTM calls it: net(x (joints, 1, 2), (h, c)) -> torque, (h, c)."""

    def __init__(self, lstm: nn.LSTM, head: nn.Module) -> None:
        super().__init__()
        self.lstm = lstm
        self.head = head

    def forward(self, x: Tensor, hidden: Tuple[Tensor, Tensor]) -> Tuple[Tensor, Tuple[Tensor, Tensor]]:
        y, after = self.lstm(x, hidden)
        return self.head(y[:, -1, :]), after


_ACTIVATIONS = {"relu": nn.ReLU, "tanh": nn.Tanh, "softsign": nn.Softsign, "elu": nn.ELU}


def _dense(layers: List[Any], *, scale: float, centre: float) -> nn.Sequential:
    """Dense layers, the last of which gives the target in its unit."""
    modules: List[nn.Module] = []
    for number, (weights, bias, activation) in enumerate(layers):
        linear = nn.Linear(weights.shape[1], weights.shape[0])
        is_last = number + 1 == len(layers)
        factor, offset = (scale, centre) if is_last else (1.0, 0.0)
        with torch.no_grad():
            linear.weight.copy_(torch.tensor(weights.astype(np.float64) * factor))
            linear.bias.copy_(torch.tensor(bias.astype(np.float64) * factor + offset))
        modules.append(linear)
        if activation != "linear":
            modules.append(_ACTIVATIONS[activation]())
    return nn.Sequential(*modules)


def _folded(weights: Any, bias: Any, network: Dict[str, Any]) -> Tuple[Any, Any]:
    """Centres and scales of the inputs within the weights, position errors before speeds."""
    order = list(network["position_errors"]) + list(network["speeds"])
    folded = weights.astype(np.float64)[:, order] / network["scale"][order]
    return folded, bias.astype(np.float64) - folded @ network["centre"][order]


def isaaclab(model: Model) -> torch.jit.ScriptModule:
    """An mlp or lstm of position errors and speeds as Isaac Lab loads actuator networks.

    Features: joint_target_rad - joint_angle_rad and joint_speed_rad_s, with equal lags (an lstm: none). Configure it with
    input_order "pos_vel", input_idx as in the attribute of the same name, and all scales 1. There are no guards.
    """
    network = _core.drive_network(model, "layout isaaclab")
    dense = list(network["dense"])
    scale = {"scale": network["target_scale"], "centre": network["target_centre"]}
    if not network["recurrent"]:
        weights, bias, activation = dense[0]
        dense[0] = (*_folded(weights, bias, network), activation)
        return torch.jit.script(ActuatorNet(_dense(dense, **scale)))
    if list(network["lags"]) != [0]:
        raise UsageError(f"layout isaaclab: expected an lstm without lags in its inputs, found lags {network['lags']}")
    units = {recurrent.shape[1] for _, recurrent, _ in network["recurrent"]}
    if len(units) != 1:
        raise UsageError(f"layout isaaclab: expected recurrent layers of one width, found {sorted(units)}")
    hidden = units.pop()
    lstm = nn.LSTM(2, hidden, num_layers=len(network["recurrent"]), batch_first=True)
    with torch.no_grad():
        for number, (weights, recurrent, bias) in enumerate(network["recurrent"]):
            own, second = (bias, np.zeros(4 * hidden)) if bias.size == 4 * hidden else np.split(bias, 2)
            if number == 0:
                weights, own = _folded(weights, own, network)
            for name, values in (("weight_ih", weights), ("weight_hh", recurrent), ("bias_ih", own), ("bias_hh", second)):
                getattr(lstm, f"{name}_l{number}").copy_(torch.tensor(np.asarray(values)))
    return torch.jit.script(ActuatorNetLstm(lstm, _dense(dense, **scale)))


def save(
    model: Model,
    path: Any,
    *,
    layout: str = "estimator",
    precision: str = "mixed",
    guards: bool = True,
    overwrite: bool = False,
) -> None:
    """Writes TorchScript. Metadata (inputs, sample rate, faults, ...) is in its extra file metadata.json."""
    import json

    if layout not in _LAYOUTS:
        raise UsageError(f"layout: expected {' or '.join(_LAYOUTS)}, found {layout!r}")
    file = os.fspath(path)
    if not file.endswith((".pt", ".pth")):
        raise UsageError(f"{file}: expected a name that ends in .pt or .pth")
    if os.path.exists(file) and not overwrite:
        raise UsageError(f"{file}: the file exists. Take another name, or overwrite it.")
    metadata: Dict[str, Any] = {"sample_rate_Hz": model.sample_rate_Hz, "target": model.target, "layout": layout}
    if layout == "isaaclab":
        scripted = isaaclab(model)
        network = _core.drive_network(model, "layout isaaclab")
        metadata.update(input_order="pos_vel", input_idx=list(network["lags"]), pos_scale=1.0, vel_scale=1.0, torque_scale=1.0)
        if network["recurrent"]:
            metadata.update(num_layers=len(network["recurrent"]), hidden_size=int(network["recurrent"][0][1].shape[1]))
    else:
        module = estimator(model, precision=precision, guards=guards)
        scripted = script(module)
        metadata.update(
            inputs=module.raw_inputs,
            zeroed_channels=list(model.zeroed_channels),
            state_width=module.state_width,
            precision=precision,
            faults=[fault.name for fault in Fault],
            guards=guards,
        )
    unfinished = f"{file}.unfinished"
    try:
        torch.jit.save(scripted, unfinished, _extra_files={"metadata.json": json.dumps(metadata)})
        os.replace(unfinished, file)
    except BaseException:
        if os.path.exists(unfinished):
            os.remove(unfinished)
        raise


def _main(arguments: Optional[List[str]] = None) -> int:
    parser = argparse.ArgumentParser(prog="python3 -m torsio.torch", description="Write a model as TorchScript.")
    parser.add_argument("model", help="model file written by torsio fit")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.pt")
    parser.add_argument("--layout", default="estimator", choices=_LAYOUTS)
    parser.add_argument("--real", default="mixed", choices=tuple(_TYPES), help="its numbers (default mixed)")
    parser.add_argument("--no-guards", action="store_true", help="the value of the model alone")
    parser.add_argument("--overwrite", action="store_true")
    flags = parser.parse_args(arguments)
    try:
        if flags.layout == "isaaclab" and (flags.no_guards or flags.real != "mixed"):
            raise UsageError("--layout isaaclab: a network alone has no guards and computes in float. Remove --no-guards and --real.")
        model = _core.load(flags.model)
        save(model, flags.output, layout=flags.layout, precision=flags.real, guards=not flags.no_guards, overwrite=flags.overwrite)
    except (_core.Error, OSError, RuntimeError) as error:
        print(f"torsio.torch: {error}", file=sys.stderr)
        return 1
    print(f"{flags.output} written: {model.family}, {flags.layout}, one tick at {model.sample_rate_Hz:g} Hz")
    return 0


if __name__ == "__main__":
    sys.exit(_main())
