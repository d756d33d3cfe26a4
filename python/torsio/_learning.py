"""The verbs of the program `torsio` as functions."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any, Union

from . import _core
from ._core import Dataset, Load, Model, Recording, UsageError
from ._progress import Listener, shown
from ._results import CheckReport, Comparison, CrossValidation, Document, Results

#: A dataset, or recordings (of the role that the function needs), or paths of logs or manifests.
Data = Union[Dataset, Recording, str, "PathLike[str]", Sequence[Any]]


#: A load file or its path (docs/use/known_load.md).
KnownLoad = Union[Load, str, "PathLike[str]"]


def _dataset(
    data: Data, role: str, target: str = "", load: KnownLoad | None = None, fitted_by: Model | None = None
) -> Dataset:
    if isinstance(data, Dataset):
        if load is not None:
            raise UsageError("load: a Dataset has its target already; give the load to it, Dataset(..., load=...)")
        return data
    if role == "train":
        return Dataset(train=data, target=target, load=load)
    return Dataset(test=data, target=target, load=load, fitted_by=fitted_by)


def _names(names: str | Sequence[str] | None) -> list[str]:
    """One name or several: a str is a sequence, of letters."""
    if names is None:
        return []
    return [names] if isinstance(names, str) else list(names)


def _option(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def check(
    data: Data,
    *,
    inputs: str | Sequence[str] | None = None,
    advise: bool = False,
    load: KnownLoad | None = None,
) -> CheckReport:
    """Looks for errors in recordings before a fit: clock, units, signs, delay, range, ... (docs/use/check.md).

    advise: also propose which recording to make next, in `report.document["advice"]`.
    load: the target is the torque of this known load (docs/use/known_load.md).
    """
    return CheckReport.from_json(_core.check(_dataset(data, "train", load=load), _names(inputs), advise))


def fit(
    data: Data,
    family: str,
    *,
    inputs: str | Sequence[str] | None = None,
    seed: int = 1,
    allow_leak: bool = False,
    serial: str = "",
    load: KnownLoad | None = None,
    progress: Listener | None = None,
    **options: Any,
) -> Model:
    """Trains one model on the recordings with the role train; equal arguments give equal models.

    inputs: expressions of channels (docs/use/expressions.md); without them, the deflection of the spring, its
    rate and the speed of the joint, as far as they are there.
    load: the target is the torque of this known load instead of that of a sensor (docs/use/known_load.md).
    progress: True for a line on standard error, or a function of (fraction, text) (`torsio.progress`).
    options: those of the family (`torsio.families()`), as layers="64", branch=True.
    Ctrl-C stops it.
    """
    given = {name: _option(value) for name, value in options.items()}
    with shown(progress):
        dataset = _dataset(data, "train", load=load)
        return _core.fit(dataset, family, given, _names(inputs), seed, allow_leak, serial)


def evaluate(
    model: Model, data: Data, *, target: str | None = None, load: KnownLoad | None = None
) -> Results:
    """Scores a model in free run on every role of the data; recordings without a role are tests.

    target: channel to compare with, in the unit of the model's target, which is the default.
    load: compare with the torque of this known load (docs/use/known_load.md).
    """
    wanted = model.target if target is None else target
    return Results.from_json(_core.evaluate(model, _dataset(data, "test", wanted, load, model), wanted))


def compare(
    data: Data,
    models: str | Sequence[str] = "all",
    *,
    inputs: str | Sequence[str] | None = None,
    seed: int = 1,
    allow_leak: bool = False,
    progress: Listener | None = None,
) -> Comparison:
    """Trains several families and ranks them on the held-out recordings (docs/use/evaluation.md).

    models: "all", or families with options after colons: "linear,polynomial:degree=7".
    progress: as for `fit`.
    """
    names = models if isinstance(models, str) else ",".join(models)
    with shown(progress):
        text, best = _core.compare(_dataset(data, "train"), names, _names(inputs), seed, allow_leak)
    return Comparison(Results.from_json(text), best)


def crossvalidate(
    data: Data,
    models: str | Sequence[str] = "all",
    *,
    inputs: str | Sequence[str] | None = None,
    folds: int = 5,
    by: str = "",
    embargo_s: float = 1.0,
    seed: int = 1,
    allow_leak: bool = False,
    progress: Listener | None = None,
) -> CrossValidation:
    """Trains every model on each fold's rest and scores it on the fold.

    by: "record" for one fold a recording, or a condition, each value of which is a fold.
    progress: as for `fit`.
    """
    names = models if isinstance(models, str) else ",".join(models)
    with shown(progress):
        text = _core.crossvalidate(
            _dataset(data, "train"), names, _names(inputs), folds, by, embargo_s, seed, allow_leak
        )
    return CrossValidation.from_json(text)


def attribute(
    model: Model,
    data: Data,
    *,
    windows: int = 200,
    background: int = 50,
    window_samples: int = 0,
    repeats: int = 5,
    seed: int = 1,
) -> Document:
    """How much a model uses each input: Shapley values and permutation importance (docs/use/evaluation.md).

    window_samples: 0 for the memory of the model.
    """
    dataset = _dataset(data, "test", model.target)
    text = _core.attribute(model, dataset, windows, background, window_samples, repeats, seed)
    return Document.from_json(text, "results")


def drift(model: Model, data: Data, *, reference: Model | None = None, seed: int = 1) -> Document:
    """What has changed in a joint since the calibration of its model (docs/robot/drift.md)."""
    text = _core.drift(model, _dataset(data, "test", model.target), reference, seed)
    return Document.from_json(text, "quantities")


def transfer(
    base: Model, data: Data, *, use_s: float = 10.0, method: str = "auto", seed: int = 1
) -> tuple[Model, Document]:
    """A model of one joint for another one, from the first use_s seconds of its recordings (docs/robot/transfer.md).

    Returns the model and the scores of all methods, on test recordings or on what follows the used part.
    """
    text, model = _core.transfer(base, _dataset(data, "train", base.target), use_s, method, seed)
    return model, Document.from_json(text, "methods")


def import_network(
    path: str | PathLike[str],
    inputs: str | Sequence[str],
    rate_Hz: float,
    *,
    target: str = "torque_Nm",
    input_scale: Sequence[float] = (),
    output_scale: float = 1.0,
    activation: str = "",
    output_name: str = "",
    warm_up_samples: int | None = None,
    fold_biases: bool = False,
    guards: Data | None = None,
    serial: str = "",
) -> Model:
    """A network that another program trained, as a model (docs/models/import.md).

    path: an ONNX graph, or PyTorch weights by name as JSON.
    inputs: one expression of channels for each input of the network, in its order. rate_Hz: of its training.
    input_scale, output_scale: factors by which its program multiplied inputs and output, 1 without them.
    activation: of the hidden dense layers of JSON weights: linear, relu, tanh, softsign or elu.
    output_name: the output of an ONNX graph that estimates the target; its first without it.
    warm_up_samples: after a reset, until a network with memory is valid; without it the graph's window, else 0.
    guards: recordings from which range guard, fallback and error bar are computed; `model.notes` states what is
    missing without them.
    """
    dataset = None if guards is None else _dataset(guards, "train", target)
    return _core.import_network(
        path,
        _names(inputs),
        rate_Hz,
        target,
        list(input_scale),
        output_scale,
        activation,
        output_name,
        warm_up_samples,
        fold_biases,
        dataset,
        serial,
    )
