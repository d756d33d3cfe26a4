#!/usr/bin/python3
"""Golden values of PyTorch for network_golden_test.cpp: outputs, one gradient, and the loss over 50 updates from the
same weights. `./run oracles` runs this in its own folder.

PyTorch keeps two biases a gate and trains both; torsio keeps one, so the second stays 0 here (but for the GRU's n).
Weight decay leaves biases alone. Numbers are rounded so that every machine writes the same bytes.
"""

import json

import torch

UPDATES = 50
RATE = 1e-2
DECAY = 0.05
CLIP = 1.0

torch.set_num_threads(1)
torch.set_default_dtype(torch.float64)


def rounded(tensor, digits=8):
    return [float(f"{value:.{digits}g}") for value in tensor.detach().flatten().tolist()]


class Network(torch.nn.Module):
    def __init__(self, kind, inputs, units, hidden, activation):
        super().__init__()
        self.kind = kind
        cell = {"lstm": torch.nn.LSTM, "gru": torch.nn.GRU}.get(kind)
        self.memory = torch.nn.ModuleList()
        for size in units:
            self.memory.append(cell(inputs, size))
            inputs = size
        self.dense = torch.nn.ModuleList()
        for size in hidden + [1]:
            self.dense.append(torch.nn.Linear(inputs, size))
            inputs = size
        self.activation = {"relu": torch.relu, "tanh": torch.tanh, "elu": torch.nn.functional.elu,
                           "softsign": torch.nn.functional.softsign}[activation]

    def forward(self, x):
        for cell in self.memory:
            x = cell(x)[0]
        for layer in self.dense[:-1]:
            x = self.activation(layer(x))
        return self.dense[-1](x)[..., 0]


def freeze_second_biases(network):
    for cell in network.memory:
        bias, size = cell.bias_hh_l0, cell.hidden_size
        mask = torch.zeros_like(bias)
        if network.kind == "gru":
            mask[2 * size:] = 1
        with torch.no_grad():
            bias *= mask
        bias.register_hook(lambda gradient, mask=mask: gradient * mask)


def loss_of(network, x, y, mask):
    return ((network(x) - y) ** 2 * mask).sum() / mask.sum()


def curve(initial, make_optimiser, x, y, mask):
    network = Network(**initial["shape"])
    network.load_state_dict(initial["state"])
    freeze_second_biases(network)
    biases = [p for name, p in network.named_parameters() if "bias" in name]
    weights = [p for name, p in network.named_parameters() if "bias" not in name]
    optimiser = make_optimiser([{"params": biases, "weight_decay": 0.0}, {"params": weights}])
    losses = []
    for _ in range(UPDATES):
        optimiser.zero_grad()
        loss = loss_of(network, x, y, mask)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), CLIP)
        optimiser.step()
        losses.append(loss)
    return rounded(torch.stack(losses))


def case(seed, steps, rows, burn_in, **shape):
    torch.manual_seed(seed)
    network = Network(**shape)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(torch.round(parameter * 1000) / 1000)
    freeze_second_biases(network)
    x = torch.round(torch.randn(steps, rows, shape["inputs"]) * 1000) / 1000
    y = torch.round(torch.randn(steps, rows) * 1000) / 1000
    mask = (torch.rand(steps, rows) < 0.8).double()
    mask[:burn_in] = 0
    state = {name: value.clone() for name, value in network.state_dict().items()}
    output = network(x)
    loss_of(network, x, y, mask).backward()
    optimisers = {
        "adam": lambda groups: torch.optim.Adam(groups, lr=RATE),
        "adam_with_penalty": lambda groups: torch.optim.Adam(groups, lr=RATE, weight_decay=DECAY),
        "adamw": lambda groups: torch.optim.AdamW(groups, lr=RATE, weight_decay=DECAY),
    }
    initial = {"shape": shape, "state": state}
    return {
        "shape": shape, "steps": steps, "rows": rows, "burn_in": burn_in, "rate": RATE, "decay": DECAY, "clip": CLIP,
        "x": rounded(x), "y": rounded(y), "mask": [int(value) for value in mask.flatten().tolist()],
        "parameters": {name: {"value": rounded(state[name]), "gradient": rounded(parameter.grad)}
                       for name, parameter in network.named_parameters()},
        "output": rounded(output),
        "losses": {name: curve(initial, make, x, y, mask) for name, make in optimisers.items()},
    }


cases = [
    case(1, 1, 24, 0, kind="mlp", inputs=3, units=[], hidden=[6, 4], activation="relu"),
    case(2, 1, 16, 0, kind="mlp", inputs=2, units=[], hidden=[5], activation="softsign"),
    case(3, 1, 16, 0, kind="mlp", inputs=2, units=[], hidden=[5], activation="elu"),
    case(4, 9, 5, 2, kind="lstm", inputs=2, units=[4], hidden=[], activation="tanh"),
    case(5, 6, 4, 1, kind="lstm", inputs=2, units=[3, 4], hidden=[3], activation="tanh"),
    case(6, 9, 5, 2, kind="gru", inputs=2, units=[4], hidden=[], activation="tanh"),
    case(7, 6, 4, 1, kind="gru", inputs=2, units=[3, 4], hidden=[3], activation="relu"),
]
with open("networks.json", "w", encoding="ascii") as file:
    json.dump(cases, file)
    file.write("\n")
