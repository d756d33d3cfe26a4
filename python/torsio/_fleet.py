"""Studies, the registry of devices, and fleets: `torsio search`, `torsio store` and `torsio fleet` as functions."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

from . import _core
from ._core import Model
from ._progress import Listener, shown
from ._results import _data_frame, _document, _number, _table_html, _table_text

Path = str | PathLike[str]


def _store(store: Path | None) -> str:
    return "" if store is None else fspath(store)


class Study:
    """A study that a store keeps: trials, their states and their results (docs/search.md).

    store: SQLite file or postgresql:// URL. name: of the study, as `torsio search --study` has it.
    Errors: UsageError if there is no store, or no study of that name in it.
    """

    def __init__(self, store: Path, name: str) -> None:
        self.store = _store(store)
        self.name = name
        self._trials()

    @staticmethod
    def all(store: Path) -> Any:
        """A DataFrame with a row for each study of a store: name, kind, waiting, running, finished, torsio_version."""
        return _data_frame(json.loads(_core.study_list(_store(store))))

    @staticmethod
    def search(
        recordings: Path | Sequence[Path],
        *,
        store: Path | None = None,
        name: str = "search",
        mapping: Path = "",
        rate_Hz: float = 0.0,
        target: str = "",
        inputs: Sequence[str] = (),
        models: str = "search",
        folds: int = 3,
        seed: int = 1,
        threads: int = 0,
        progress: Listener | None = None,
    ) -> dict[str, Any]:
        """Searches for the best model by cross-validation, as `torsio search`; the document is that of its --json.

        With a store the study is kept: the same call after a stop continues, and `torsio work` on other machines
        takes part. threads: 0 for one for each core. rate_Hz: 0 for that of the logs.
        """
        files = [recordings] if isinstance(recordings, (str, PathLike)) else list(recordings)
        with shown(progress):
            text = _core.study_search(
                [fspath(file) for file in files],
                fspath(mapping),
                rate_Hz,
                target,
                list(inputs),
                models,
                folds,
                seed,
                _store(store),
                name,
                threads,
            )
        return _document(text)

    def _trials(self) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = json.loads(_core.study_trials(self.store, self.name))
        for row in rows:
            row["value"] = _number(row["value"])
            row["seconds"] = _number(row["seconds"])
        return rows

    def trials(self) -> Any:
        """A DataFrame with a row for each trial: key, group, device, step, state, attempts, value, seconds, reason."""
        return _data_frame(self._trials())

    def best(self, count: int = 10) -> Any:
        """A DataFrame of the trials with the lowest values."""
        rows = [row for row in self._trials() if row["state"] == "done" and row["value"] == row["value"]]
        return _data_frame(sorted(rows, key=lambda row: (row["value"], row["trial"]))[:count])

    @property
    def counts(self) -> dict[str, int]:
        """Number of trials by state."""
        counts: dict[str, int] = {}
        for row in self._trials():
            counts[row["state"]] = counts.get(row["state"], 0) + 1
        return counts

    def work(self, *, threads: int = 0, progress: Listener | None = None) -> int:
        """Runs waiting trials until all have finished, as `torsio work`. Returns how many this process finished."""
        with shown(progress):
            finished, _ = _core.study_work(self.store, self.name, threads)
        return finished

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {state}" for state, count in self.counts.items())
        return f"<Study {self.name!r} in {self.store}: {counts}>"


class Registry:
    """Devices with their models and their drift, as `torsio store` shows them (docs/fleet.md).

    store: SQLite file or postgresql:// URL. A model is served only to its own device.
    Errors: UsageError if there is no store; `calibrate_fleet` and `torsio store add` begin one.
    """

    def __init__(self, store: Path) -> None:
        self.store = _store(store)
        self.devices()

    def devices(self) -> Any:
        """A DataFrame with a row for each device: serial, type, current model, family, models, recordings, drift."""
        return _data_frame(json.loads(_core.registry_devices(self.store)))

    def models(self, serial: str = "") -> Any:
        """A DataFrame with a row for each model of a device, or of all."""
        rows = json.loads(_core.registry_models(self.store, serial))
        for row in rows:
            row["rmse"] = _number(row["rmse"])
        return _data_frame(rows)

    def drift(self, serial: str) -> Any:
        """A DataFrame with a row for each comparison of a device with its model, the oldest first."""
        rows = json.loads(_core.registry_drift(self.store, serial))
        return _data_frame([{key: _number(value) if value is None else value for key, value in row.items()} for row in rows])

    def load(self, serial: str, model: int | None = None) -> Model:
        """The current model of a device, or the one of its models with that number."""
        return _core.registry_model(self.store, serial, model)

    def promote(self, serial: str, model: int, reason: str = "") -> bool:
        """Makes a model the current one of its device. Returns whether it was another one before."""
        return _core.registry_promote(self.store, serial, model, reason)

    def roll_back(self, serial: str, reason: str = "") -> int:
        """Makes the model current that was so before the current one was promoted. Returns its number."""
        return _core.registry_roll_back(self.store, serial, reason)


@dataclass(frozen=True, repr=False)
class Fleet:
    """The joints of a calibration, and those that differ from the others (docs/fleet.md)."""

    document: dict[str, Any]  #: of `torsio fleet calibrate --json`

    def joints(self) -> Any:
        """A DataFrame with a row for each joint: serial, type, chosen, test_rmse, failure, and its traits."""
        return _data_frame(
            [
                {
                    "serial": joint["serial"],
                    "type": joint["type"],
                    "chosen": joint["chosen"],
                    "test_rmse": _number(joint["test_rmse"]),
                    "failure": joint["failure"],
                    **{trait["name"]: _number(trait["value"]) for trait in joint["traits"]},
                }
                for joint in self.document["joints"]
            ]
        )

    def outliers(self) -> Any:
        """A DataFrame with a row for each joint that differs: serial, kind, value, median, expected, others."""
        return _data_frame(self.document["outliers"])

    def _cells(self) -> tuple[list[str], list[list[Any]], str]:
        columns = ["serial", "kind", "value", "median", "expected"]
        rows = [[_number(row[key]) if row[key] is None else row[key] for key in columns] for row in self.document["outliers"]]
        return columns, rows, f"{len(rows)} of {len(self.document['joints'])} joints differ"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


def calibrate_fleet(
    joints: Path = "",
    *,
    specimens: str = "",
    faults: int = 0,
    base: Path = "",
    model: str = "",
    seed: int = 1,
    store: Path | None = None,
    study: str = "calibrate",
    promote: bool = False,
    threads: int = 0,
    progress: Listener | None = None,
) -> Fleet:
    """Checks, compares, fits and evaluates each joint of a list, as `torsio fleet calibrate`.

    joints: list of joints with their recordings. specimens: simulated ones in its place, "dfki-50#0001..#1000", of
    which `faults` get a fault of production. store: keeps the study, and the models in its registry.
    promote: makes the models current of joints that do not differ.
    """
    if bool(fspath(joints)) == bool(specimens):
        raise _core.UsageError("calibrate_fleet: give either a list of joints or specimens")
    with shown(progress):
        text = _core.calibrate_fleet(
            fspath(joints), specimens, faults, fspath(base), model, seed, _store(store), study, promote, threads
        )
    return Fleet(_document(text))


def watch_fleet(store: Path, joints: Path = "", *, threads: int = 0, progress: Listener | None = None) -> Any:
    """A DataFrame of the joints of a registry, the largest drift first, as `torsio fleet watch`.

    joints: list with recordings of today, which are compared first. threads: 0 for one for each core.
    Joints of the list that could not be compared are in `.attrs["failures"]`, each with the reason; a UserWarning has
    the same texts. A row of such a joint is that of its last comparison before.
    Errors: UsageError if there is no store.
    """
    with shown(progress):
        document = json.loads(_core.watch_fleet(fspath(joints), _store(store), threads))
    for row in document["joints"]:
        for key in ("severity", "severity_before"):
            row[key] = _number(row[key])
    frame = _data_frame(document["joints"])
    failures = document["failures"]
    frame.attrs["failures"] = failures
    if failures:
        warnings.warn(f"joints that could not be compared: {len(failures)}\n" + "\n".join(failures), stacklevel=2)
    return frame
