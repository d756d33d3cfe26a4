"""Motor, friction and spring of a joint without a torque sensor: `torsio identify` as a function."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral
from os import PathLike
from typing import TYPE_CHECKING, Any, Union, cast

from . import _core
from ._core import Load, Recording, UsageError
from ._progress import Listener, shown
from ._results import _data_frame, _document, _number, _table_html

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

#: Recordings, paths of logs or manifests, or lists of them.
Recordings = Union[Recording, str, "PathLike[str]", Sequence[Any]]


def _refuse(place: str, expected: str, value: object) -> None:
    raise UsageError(f"{place}: expected {expected}, found {'None' if value is None else type(value).__name__}")


def _require_text(place: str, value: object, expected: str = "a str") -> None:
    if not isinstance(value, str):
        _refuse(place, expected, value)


def _require_count(place: str, value: object, lowest: int) -> None:
    if not isinstance(value, Integral) or isinstance(value, bool):
        _refuse(place, f"a whole number from {lowest}", value)
    elif int(value) < lowest:
        raise UsageError(f"{place}: expected a whole number from {lowest}, found {value}")


def _require_flag(place: str, value: object) -> None:
    if type(value).__name__ not in ("bool", "bool_"):  # numpy has one of its own
        _refuse(place, "True or False", value)


def _require_path(place: str, value: object, or_else: str = "") -> None:
    if not isinstance(value, (str, PathLike)):
        _refuse(place, f"{or_else}a str or a path", value)


def _require_load(load: object) -> None:
    if not isinstance(load, Load):
        _require_path("load", load, "a load file (docs/use/known_load.md): a torsio.Load, ")


def _names_of(terms: object) -> list[str] | None:
    expected = '"auto" or names: ["delay", "load_friction"]'
    if not isinstance(terms, (str, Iterable)):
        _refuse("terms", expected, terms)
    names = terms.split(",") if isinstance(terms, str) else list(cast("Iterable[Any]", terms))
    for name in names:
        _require_text("terms", name, expected)
    return None if names == ["auto"] else [name.strip() for name in names]


@dataclass(frozen=True)
class DriveParameter:
    """A number of an identified drive, in the SI unit that its name ends in; all are after the gear."""

    name: str
    value: float
    standard_error: float  #: NaN with fewer than three recordings
    lowest_95: float  #: ends of the 95 % interval; NaN with fewer than three recordings
    highest_95: float
    standard_error_from_load: float  #: the part of it that the load's errors cause
    #: The interval spans less than a factor of 10, or less than half of the range of a number that may be negative; None
    #: without standard errors: not known.
    is_determined: bool | None
    is_at_bound: bool


class IdentifiedDrive:
    """What `identify` found, or what `read_drive` read. Never changed."""

    def __init__(
        self, core: _core.IdentifiedDrive, recordings: Recordings | None = None, group_by: str = ""
    ) -> None:
        self._core = core
        self._recordings = recordings
        self._group_by = group_by
        self._document = _document(core.document_json())

    @property
    def terms(self) -> list[str]:
        """The terms of the model beyond the base (docs/use/identify.md)."""
        text = str(self._document["terms"])
        return [] if text == "none" else text.split(", ")

    @property
    def parameters(self) -> dict[str, DriveParameter]:
        """By name: value, standard error and 95 % interval."""
        rows = {}
        for row in self._document["parameters"]:
            numbers = {key: _number(value) for key, value in row.items() if key not in _NOT_NUMBERS}
            rows[row["name"]] = DriveParameter(
                name=row["name"],
                is_determined=row["is_determined"],
                is_at_bound=row["is_at_bound"],
                **numbers,
            )
        return rows

    @property
    def mae_rad(self) -> float:
        """Mean |measured - simulated angle| over the recordings, in free runs from the command alone."""
        return _number(self._document["mae_rad"])

    @property
    def held_out_mae_rad(self) -> float:
        """The same of recordings whose group the fit did not have; NaN with one group."""
        return _number(self._document["held_out_mae_rad"])

    @property
    def nested_mae_rad(self) -> float:
        """The same where the terms were chosen without the group, too; NaN with stated terms."""
        return _number(self._document["nested_mae_rad"])

    @property
    def recordings(self) -> list[dict[str, Any]]:
        """Of each recording: recording, group, mae_rad, held_out_mae_rad, nested_mae_rad."""
        return [
            {key: _number(value) if key.endswith("_rad") else value for key, value in row.items()}
            for row in self._document["recordings"]
        ]

    @property
    def findings(self) -> list[dict[str, str]]:
        """What the recordings lack or what is conspicuous: status, subject, text."""
        return list(self._document["findings"])

    @property
    def advice(self) -> list[dict[str, Any]]:
        """Recordings to make next: recording, parameter, and the ratio of its standard error after to before."""
        return list(self._document.get("advice", []))

    def simulate(self, recording: Recording) -> dict[str, npt.NDArray[np.float64]]:
        """A free run through a recording, from its command alone.

        Arrays of shape (samples,): measured_rad and angle_rad of the encoder that was fitted, joint_angle_rad,
        joint_torque_Nm.
        """
        if not isinstance(recording, Recording):
            _refuse("simulate", "one Recording, such as an item of the list of torsio.read", recording)
        return self._core.simulate(recording)

    def evaluate(
        self,
        recordings: Recordings,
        *,
        load: Load | str | PathLike[str] | None = None,
        group_by: str = "",
    ) -> IdentifiedDrive:
        """The same drive with the errors of its free runs through other recordings; nothing is fitted.

        load: that of these recordings, if it is another one (docs/use/known_load.md).
        group_by: as in `identify`, for a later `write`.
        """
        if load is not None:
            _require_load(load)
        _require_text("group_by", group_by)
        core = self._core.evaluate(recordings, load, group_by)
        return IdentifiedDrive(core, recordings, group_by)

    def write(
        self,
        target: str,
        path: str | PathLike[str],
        *,
        recordings: Recordings | None = None,
        name: str = "servo",
        group_by: str | None = None,
        starts: int = 3,
    ) -> float:
        """Writes the drive for another program, refitted in its equations; returns the error there in rad.

        target: bam, mjcf or isaaclab.
        recordings: to which it is fitted; without them those of `identify` or `evaluate`.
        group_by: as in `identify`, by default as there: what bam's model is chosen by.
        """
        _require_text("target", target, "bam, mjcf or isaaclab")
        _require_path("path", path)
        _require_text("name", name)
        _require_count("starts", starts, 1)
        if group_by is not None:
            _require_text("group_by", group_by)
        groups = self._group_by if group_by is None else group_by
        used = self._recordings if recordings is None else recordings
        if used is None:
            raise UsageError("write: a drive that was read from a file needs recordings=, to which it is refitted")
        return self._core.write(target, path, used, name, groups, starts)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes a file for `read_drive` and `torsio identify --from`."""
        self._core.save(path)

    def to_json(self) -> str:
        """The document of `torsio identify --json`, which `save` writes."""
        return self._core.document_json()

    def to_pandas(self) -> Any:
        """A DataFrame with a row for each parameter."""
        return _data_frame([vars(row) for row in self.parameters.values()])

    def __repr__(self) -> str:
        error = self.mae_rad if math.isnan(self.held_out_mae_rad) else self.held_out_mae_rad
        return f"<IdentifiedDrive: {self._document['law']}, {len(self.parameters)} parameters, {error:.4f} rad>"

    def __str__(self) -> str:
        return self._core.text()

    def _repr_html_(self) -> str:
        columns = ["name", "value", "standard_error", "lowest_95", "highest_95"]
        rows = [[getattr(row, column) for column in columns] for row in self.parameters.values()]
        return _table_html(columns, rows, repr(self))


_NOT_NUMBERS = ("name", "is_determined", "is_at_bound")


def identify(
    recordings: Recordings,
    *,
    load: Load | str | PathLike[str],
    drive: str | PathLike[str] | None = None,
    terms: str | Sequence[str] = "auto",
    spring: bool = False,
    group_by: str = "",
    starts: int = 3,
    seed: int = 1,
    standard_errors: bool = True,
    nested: bool = True,
    progress: Listener | None = None,
) -> IdentifiedDrive:
    """Finds motor, friction and spring of a joint from its command, one angle and a known load (docs/use/identify.md).

    load: load file, which gives the torque its scale (docs/use/known_load.md).
    drive: drive file with the law; without it the channels suggest one.
    terms: "auto" (chosen by recordings that are left out), or names: ["delay", "load_friction"].
    spring: "auto" begins with a second mass and its spring.
    group_by: condition whose equal values are left out together, or "recording".
    standard_errors, nested: without them the fits that these need are saved.
    progress: True for a line on standard error, or a function of (fraction, text) (`torsio.progress`).
    Equal arguments give equal results. Ctrl-C stops it.
    """
    _require_load(load)
    if drive is not None:
        _require_path("drive", drive, "a drive file (docs/use/identify.md): ")
    chosen = _names_of(terms)
    _require_text("group_by", group_by)
    _require_count("starts", starts, 1)
    _require_count("seed", seed, 0)
    for place, flag in (("spring", spring), ("standard_errors", standard_errors), ("nested", nested)):
        _require_flag(place, flag)
    with shown(progress):
        core = _core.identify(
            recordings, load, drive, chosen, spring, group_by, starts, seed, standard_errors, nested
        )
    return IdentifiedDrive(core, recordings, group_by)


def read_drive(path: str | PathLike[str]) -> IdentifiedDrive:
    """A drive from the file of `IdentifiedDrive.save` or `torsio identify -o`."""
    return IdentifiedDrive(_core.read_drive(path))
