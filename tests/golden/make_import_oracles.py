#!/usr/bin/python3
"""Networks as other programs write them, with the outputs that PyTorch computes, for import_golden_test.cpp: the folder `import`
with weights as JSON, ONNX graphs of PyTorch's exporter, and graphs built by hand as Keras' exporter (tf2onnx) builds them.
`./run oracles` runs this in its own folder.

Outputs are those of float64; the networks are small, so that all of it is a few ten kilobytes.
"""

import json
import os
import warnings

import numpy
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

STEPS = 40
FOLDER = "import"

warnings.filterwarnings("ignore")
torch.set_num_threads(1)
os.makedirs(FOLDER, exist_ok=True)
cases = []


def rounded(tensor, digits=9):
    return [float(f"{value:.{digits}g}") for value in torch.as_tensor(tensor).detach().flatten().tolist()]


def signal(inputs, seed):
    generator = torch.Generator().manual_seed(seed)
    return torch.round(torch.randn(STEPS, inputs, generator=generator) * 1000) / 1000


def add_case(file, family, inputs, outputs, **more):
    cases.append({"file": file, "family": family, "input_count": inputs.shape[1], "inputs": rounded(inputs),
                  "outputs": rounded(outputs), **more})


def settle(network, seed):
    """Weights of three digits, biases included."""
    torch.manual_seed(seed)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(torch.round(torch.randn_like(parameter) * 400) / 1000)
    return network.eval()


class Dense(torch.nn.Module):
    def __init__(self, sizes, activation, gain=None, output_gain=None):
        super().__init__()
        self.layers = torch.nn.ModuleList(torch.nn.Linear(a, b) for a, b in zip(sizes, sizes[1:]))
        self.activation, self.gain, self.output_gain = activation, gain, output_gain

    def forward(self, x):
        if self.gain is not None:
            x = x * torch.tensor(self.gain, dtype=x.dtype) - 0.25
        for layer in self.layers[:-1]:
            x = self.activation(layer(x))
        x = self.layers[-1](x)
        return x if self.output_gain is None else x / self.output_gain + 1.5


class Memory(torch.nn.Module):
    """Recurrent layers, then a dense one; `last`: only the window's last sample; `states`: in and out."""

    def __init__(self, cell, inputs, units, layers=1, batch_first=True, last=False, states=False, gains=None):
        super().__init__()
        self.memory = cell(inputs, units, num_layers=layers, batch_first=batch_first)
        self.head = torch.nn.Linear(units, 1)
        self.last, self.states, self.gains, self.batch_first = last, states, gains, batch_first

    def forward(self, x, *states):
        if self.gains is not None:
            x = x * torch.tensor(self.gains[0], dtype=x.dtype)
        if self.states:
            h, after = self.memory(x, states[0] if len(states) == 1 else states)
        else:
            h, after = self.memory(x)
        if self.last:
            h = h[:, -1] if self.batch_first else h[-1]
        y = self.head(h)
        if self.gains is not None:
            y = y * self.gains[1]
        return (y, after) if self.states else y


def stream(network, inputs):
    """From the zero state over all samples, in float64."""
    network = network.double()
    x = inputs.double()
    if isinstance(network, Memory):
        h, _ = network.memory(x[None] * (torch.tensor(network.gains[0]) if network.gains else 1)
                              if network.batch_first else x[:, None])
        y = network.head(h.reshape(STEPS, -1)) * (network.gains[1] if network.gains else 1)
    else:
        y = network(x)
    return y


def export(name, network, example, family, seed, dynamic=None, opset=13, inputs=None, **more):
    file = f"{name}.onnx"
    names = more.pop("names", (["x"], ["y"]))
    torch.onnx.export(network, example, f"{FOLDER}/{file}", opset_version=opset, input_names=names[0],
                      output_names=names[1], dynamic_axes=dynamic)
    features = (example[0] if isinstance(example, tuple) else example).shape[-1]
    inputs = signal(features, seed)
    add_case(file, family, inputs, stream(network, inputs), **more)


def export_weights(name, network, family, seed, scales=(None, None), **more):
    tensors = {key: {"shape": list(value.shape), "data": rounded(value)}
               for key, value in network.state_dict().items()}
    features = network.memory.input_size if isinstance(network, Memory) else network.layers[0].in_features
    inputs = signal(features, seed)
    if scales[0] is not None:
        tensors["in_scale"] = {"shape": [1, 1, features], "data": scales[0]}
        tensors["out_scale"] = {"shape": [1], "data": [scales[1]]}
        network.gains = scales
    with open(f"{FOLDER}/{name}.json", "w", encoding="ascii") as file:
        json.dump({"tensors": tensors}, file)
        file.write("\n")
    add_case(f"{name}.json", family, inputs, stream(network, inputs), **more)


softsign = torch.nn.functional.softsign
export_weights("weights_lstm", settle(Memory(torch.nn.LSTM, 2, 5, layers=2), 11), "lstm", 21, ([2.0, 0.25], 20.0))
export_weights("weights_gru", settle(Memory(torch.nn.GRU, 3, 4), 12), "gru", 22)
export_weights("weights_mlp", settle(Dense([3] + [4] * 11 + [1], softsign), 13), "mlp", 23, activation="softsign")

batch = {"x": {0: "n"}, "y": {0: "n"}}
window = {"x": {0: "n", 1: "t"}, "y": {0: "n", 1: "t"}}
export("torch_softsign", settle(Dense([6, 8, 8, 1], softsign), 31), torch.randn(1, 6), "mlp", 41, batch)
export("torch_relu", settle(Dense([3, 8, 4, 1], torch.relu), 32), torch.randn(5, 3), "mlp", 42, opset=9)
export("torch_tanh_scaled", settle(Dense([2, 6, 1], torch.tanh, [3.0, -0.5], -4.0), 33), torch.randn(1, 2), "mlp", 43,
       opset=17)
export("torch_elu_over_time", settle(Dense([2, 6, 1], torch.nn.functional.elu), 34), torch.randn(1, 7, 2), "mlp", 44,
       window)
export("torch_lstm", settle(Memory(torch.nn.LSTM, 2, 5, layers=2, gains=([2.0, 0.25], 20.0)), 35), torch.randn(2, 9, 2),
       "lstm", 45, window)
export("torch_lstm_fixed_window", settle(Memory(torch.nn.LSTM, 2, 5, last=True), 36), torch.randn(1, 9, 2), "lstm", 46,
       window=9)
states = torch.zeros(2, 1, 4)
export("torch_lstm_states", settle(Memory(torch.nn.LSTM, 2, 4, layers=2, states=True), 37),
       (torch.randn(1, 1, 2), states, states), "lstm", 47, opset=11,
       names=(["x", "h0", "c0"], ["y", "h1", "c1"]))
export("torch_gru", settle(Memory(torch.nn.GRU, 3, 4, layers=2, batch_first=False), 38), torch.randn(9, 1, 3), "gru", 48,
       {"x": {0: "t", 1: "n"}, "y": {0: "t", 1: "n"}}, opset=14)
export("torch_gru_last", settle(Memory(torch.nn.GRU, 2, 4, batch_first=False, last=True), 39), torch.randn(9, 1, 2),
       "gru", 49, {"x": {0: "t"}})


def gates(tensor, order):
    """PyTorch's rows (LSTM i, f, g, o; GRU r, z, n) in ONNX's order."""
    blocks = tensor.detach().numpy().astype(numpy.float32)
    blocks = blocks.reshape(len(order), -1, *blocks.shape[1:])
    return numpy.concatenate([blocks[k] for k in order])[None]


def constant(name, values, kind=numpy.int64):
    return numpy_helper.from_array(numpy.array(values, dtype=kind), name)


def save(name, nodes, initializers, shape_in, shape_out, opset=13):
    graph = helper.make_graph(nodes, name, [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape_in)],
                              [helper.make_tensor_value_info("y", TensorProto.FLOAT, shape_out)], initializers)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], producer_name="built by hand")
    model.ir_version = 7
    onnx.checker.check_model(model)
    onnx.save(model, f"{FOLDER}/{name}.onnx")


def recurrent_tensors(memory, order):
    bias = numpy.concatenate([gates(memory.bias_ih_l0, order), gates(memory.bias_hh_l0, order)], axis=1)
    return [constant("W", gates(memory.weight_ih_l0, order), numpy.float32),
            constant("R", gates(memory.weight_hh_l0, order), numpy.float32), constant("B", bias, numpy.float32)]


def head_tensors(network):
    return [constant("head_W", network.head.weight.detach().numpy().T, numpy.float32),
            constant("head_b", network.head.bias.detach().numpy(), numpy.float32)]


node = helper.make_node
LSTM_ORDER, GRU_ORDER = (0, 3, 1, 2), (1, 0, 2)

# LSTM(return_sequences=False) -> Dense: the initial state is made of the batch's size.
network = settle(Memory(torch.nn.LSTM, 2, 5), 51)
save("keras_lstm", [
    node("Shape", ["x"], ["shape"]), node("Slice", ["shape", "zero", "one"], ["n"]),
    node("Concat", ["n", "units"], ["state_shape"], axis=0), node("Expand", ["nought", "state_shape"], ["state"]),
    node("Unsqueeze", ["state", "zero"], ["h0"]), node("Transpose", ["x"], ["x_t"], perm=[1, 0, 2]),
    node("LSTM", ["x_t", "W", "R", "B", "", "h0", "h0"], ["Y", "Y_h"], name="lstm", hidden_size=5, direction="forward",
         activations=["Sigmoid", "Tanh", "Tanh"]),
    node("Squeeze", ["Y_h", "zero"], ["h"]), node("MatMul", ["h", "head_W"], ["product"]),
    node("Add", ["product", "head_b"], ["y"])],
    recurrent_tensors(network.memory, LSTM_ORDER) + head_tensors(network) +
    [constant("zero", [0]), constant("one", [1]), constant("units", [5]), constant("nought", [0.0], numpy.float32)],
    ["n", "t", 2], ["n", 1])
inputs = signal(2, 61)
add_case("keras_lstm.onnx", "lstm", inputs, stream(network, inputs))

# GRU(return_sequences=True) -> TimeDistributed(Dense), which reshapes samples into rows and back.
network = settle(Memory(torch.nn.GRU, 3, 4), 52)
save("keras_gru", [
    node("Transpose", ["x"], ["x_t"], perm=[1, 0, 2]),
    node("GRU", ["x_t", "W", "R", "B"], ["Y"], name="gru", hidden_size=4, linear_before_reset=1),
    node("Squeeze", ["Y", "one"], ["h_t"]), node("Transpose", ["h_t"], ["h"], perm=[1, 0, 2]),
    node("Reshape", ["h", "rows"], ["flat"]), node("MatMul", ["flat", "head_W"], ["product"]),
    node("Add", ["product", "head_b"], ["sum"]), node("Reshape", ["sum", "back"], ["y"])],
    recurrent_tensors(network.memory, GRU_ORDER) + head_tensors(network) +
    [constant("one", [1]), constant("rows", [-1, 4]), constant("back", [-1, 12, 1])], ["n", 12, 3], ["n", 12, 1])
inputs = signal(3, 62)
add_case("keras_gru.onnx", "gru", inputs, stream(network, inputs), window=12)

# The batch in front (layout 1, since opset 14), biases left out, no time axis after a Gather.
network = settle(Memory(torch.nn.LSTM, 2, 3), 53)
with torch.no_grad():
    network.memory.bias_ih_l0.zero_()
    network.memory.bias_hh_l0.zero_()
save("batch_first_lstm", [
    node("LSTM", ["x", "W", "R"], ["Y"], name="lstm", hidden_size=3, layout=1), node("Squeeze", ["Y", "two"], ["h"]),
    node("Gather", ["h", "last"], ["h_last"], axis=1),
    node("Gemm", ["h_last", "head_W", "head_b"], ["y"], alpha=0.5, beta=2.0)],
    recurrent_tensors(network.memory, LSTM_ORDER)[:2] + head_tensors(network) +
    [constant("two", [2]), constant("last", -1)], ["n", "t", 2], ["n", 1], opset=14)
with torch.no_grad():
    network.head.weight *= 0.5
    network.head.bias *= 2.0
inputs = signal(2, 63)
add_case("batch_first_lstm.onnx", "lstm", inputs, stream(network, inputs))

with open(f"{FOLDER}/cases.json", "w", encoding="ascii") as file:
    json.dump(cases, file)
    file.write("\n")
