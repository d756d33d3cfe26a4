"""Monitor and adaptation: `torsio monitor` and `torsio adapt` as functions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

from . import _core
from ._core import Dataset, Model, Recording
from ._drives import Recordings
from ._loops import Faults, split_faults
from ._learning import Data, _names, _option
from ._progress import Listener, shown
from ._results import Document, _data_frame, _document, _number, _table_html, _table_text


@dataclass(frozen=True, repr=False)
class MonitorReport:
    """What a monitor reports of recordings (docs/robot/safety.md)."""

    document: dict[str, Any]  #: of `torsio monitor --json`
    #: Of each recording, on its clock: the raw inputs, estimated_torque_Nm with torque_std_dev_Nm, the torque and the
    #: fault of each source, monitor_state_1 (0 unproven, 1 ready, 2 watching, 3 stopped) and fault_1 (`Fault`).
    torques: list[Recording]

    @property
    def stopped_at_s(self) -> list[float]:
        """Of each recording, when the monitor stopped; NaN: it did not."""
        return [_number(row["stopped_at_s"]) for row in self.document["recordings"]]

    @property
    def watching_from_s(self) -> list[float]:
        """Of each recording, from when on it was watched; NaN: never."""
        return [_number(row["watching_from_s"]) for row in self.document["recordings"]]

    def to_pandas(self) -> Any:
        """A DataFrame with a row for each finding: recording, and what `--json` writes of it."""
        return _data_frame(
            [
                {"recording": each["recording"], **event}
                for each in self.document["recordings"]
                for event in each["events"]
            ]
        )

    def _cells(self) -> tuple[list[str], list[list[Any]], str]:
        columns = ["recording", "watching_from_s", "stopped_at_s"]
        rows = [
            [each["recording"], _number(each["watching_from_s"]), _number(each["stopped_at_s"])]
            for each in self.document["recordings"]
        ]
        return columns, rows, "monitor"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


def monitor(
    path: str | PathLike[str],
    recordings: Recordings,
    *,
    serial: str = "",
    mapping: str | PathLike[str] | None = None,
    rate_Hz: float | None = None,
    progress: Listener | None = None,
) -> MonitorReport:
    """Streams recordings through the monitor of a file, as a loop would (docs/robot/safety.md).

    path: monitor file of `torsio monitor --calibrate` or `calibrate_simulated_monitor`; its models lie beside it.
    recordings: with the channels of its sources, at its rate. serial: a monitor of another joint is refused.
    mapping: for paths; without it that of the monitor's models.
    Errors: Error for a missing channel, another rate, or a model that has changed since the calibration.
    """
    with shown(progress):
        text, torques = _core.monitor(path, recordings, serial, mapping, rate_Hz)
    return MonitorReport(_document(text), torques)


@dataclass(frozen=True)
class MonitorSource:
    """A source of the torque for `calibrate_monitor`."""

    model: str | PathLike[str]  #: model file that estimates the torque
    depends_on: str | Sequence[str] = ()  #: parts whose fault changes it, such as "gear_encoder"
    friction: str | PathLike[str] | None = None  #: model file of the drive's friction, which is added


def calibrate_monitor(
    path: str | PathLike[str],
    recordings: Recordings,
    sources: Mapping[str, MonitorSource],
    *,
    signals: str | Sequence[str] = (),
    serial: str = "",
    valid_until: str = "",
    false_alarms_per_hour: float = 1.0,
    extrapolate: bool = False,
    least_threshold_Nm: float = 0.0,
    required_Nm: float = math.inf,
    persistence_s: float | None = None,
    mapping: str | PathLike[str] | None = None,
    rate_Hz: float | None = None,
    progress: Listener | None = None,
) -> Document:
    """Chooses the limits of a monitor from recordings without a fault and writes its file (docs/robot/safety.md).

    sources: two or more by name; the file names their models relative to its folder.
    signals: channels or expressions to watch, or "A moves with B"; without them every channel of the sources, each
    angle with the one before it in the drive, and the deflection.
    false_alarms_per_hour: T hours of recordings support 3 / T or more; extrapolate permits less.
    least_threshold_Nm: no pair of sources has a smaller one. required_Nm: a disagreement that has to be found.
    persistence_s: how long a difference must exceed its threshold; 5 ms without it. valid_until: as "2027-11-22".
    mapping, rate_Hz: for paths; without them as the models were trained.
    Returns the limits of each pair. Errors: Error for recordings that lack a channel or are too short.
    """
    rows = [(name, each.model, each.friction, _names(each.depends_on)) for name, each in sources.items()]
    with shown(progress):
        text = _core.calibrate_monitor(
            path,
            recordings,
            rows,
            _names(signals),
            serial,
            valid_until,
            false_alarms_per_hour,
            extrapolate,
            least_threshold_Nm,
            required_Nm,
            persistence_s,
            mapping,
            rate_Hz,
        )
    return Document.from_json(text, "pairs")


def monitor_simulated(
    actuator: str,
    path: str | PathLike[str],
    *,
    faults: Faults = None,
    duration_s: float = 20.0,
    seed: int = 1,
    progress: Listener | None = None,
) -> MonitorReport:
    """A simulated joint at random work, stopped by its monitor where that finds a fault.

    path: monitor file of this actuator (`calibrate_simulated_monitor`).
    faults: a YAML schedule, or texts such as "kt=-20%@3s" (docs/simulation/faults.md).
    Equal arguments give equal results.
    """
    schedule, injections = split_faults(faults)
    with shown(progress):
        text, torques = _core.monitor_simulated(actuator, path, injections, schedule, duration_s, seed)
    return MonitorReport(_document(text), torques)


def calibrate_simulated_monitor(
    actuator: str,
    path: str | PathLike[str],
    *,
    fault_free_hours: float = 4.0,
    false_alarms_per_hour: float = 1e-4,
    progress: Listener | None = None,
) -> Document:
    """Trains the sources of a simulated joint, chooses their limits, and writes the monitor file with its models.

    Takes minutes. Returns the limits of each pair of sources.
    """
    with shown(progress):
        text = _core.calibrate_simulated_monitor(actuator, path, fault_free_hours, false_alarms_per_hour)
    return Document.from_json(text, "pairs")


@dataclass(frozen=True, repr=False)
class Adaptation(Document):
    """Scores of the frozen and the adapted model: `as_it_ran` and `held_out`, which is the table."""

    def _rows(self) -> list[dict[str, Any]]:
        rows = []
        for score in self.document[self.table]:
            row = {"recording": score["recording"] or "all", "samples": score["samples"]}
            for name in ("rmse", "mad", "max_abs"):
                for model in ("frozen", "adapted"):
                    row[f"{name}_{model}"] = score[model][name]
            rows.append(row)
        return rows

    def to_pandas(self) -> Any:
        """A DataFrame with a row for each recording and one for all."""
        return _data_frame(self._rows())

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        rows = self._rows()
        return list(rows[0]), [list(row.values()) for row in rows], self.table


def adapt(
    model: Model,
    data: Data,
    *,
    test: Any = None,
    held_out: float = 0.3,
    embargo_s: float = 1.0,
    method: str = "auto",
    serial: str = "",
    progress: Listener | None = None,
    **settings: Any,
) -> tuple[Model, Adaptation]:
    """Adapts a model to recordings, streamed in their order as on a robot (docs/robot/adaptation.md).

    model: an mlp, lstm, gru, dgmm or grey_box. data: recordings to adapt to, or a Dataset with roles.
    test: recordings for the scores only; without them the last share held_out of each recording, embargo_s apart.
    method: nlms, rls, em, or auto. settings: those of `torsio adapt --set`, as step_size=0.1.
    Returns the adapted model, and the scores of the frozen and the adapted one; its table is `held_out`.
    """
    dataset = data if isinstance(data, Dataset) else Dataset(train=data, test=test, target=model.target)
    given = {name: _option(value) for name, value in settings.items()}
    with shown(progress):
        text, adapted = _core.adapt(model, dataset, held_out, embargo_s, method, given, serial)
    return adapted, Adaptation(_document(text), "held_out")
