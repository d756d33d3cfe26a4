"""Recordings from tables in memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from typing import Any

import numpy as np

from . import _core
from ._core import Recording, UsageError


def _column(name: Any, values: Any) -> tuple[str, Any]:
    if not isinstance(name, str) or not name:
        raise UsageError(f"column {name!r}: expected a name with its unit, such as torque_Nm")
    # What is masked was not measured.
    array = np.ma.filled(np.ma.asarray(values, np.float64), np.nan) if np.ma.isMaskedArray(values) else np.asarray(values)
    if array.dtype.kind in "mM":
        raise UsageError(f"{name}: expected numbers, found {array.dtype}; give the time as t_s in seconds")
    if array.dtype.kind == "O":
        try:
            array = np.asarray([np.nan if each is None else each for each in array.ravel()], dtype=np.float64)
        except (TypeError, ValueError):
            bad = next(each for each in np.asarray(values).ravel() if not _is_number(each))
            raise UsageError(f"{name}: expected numbers, found {bad!r}") from None
    if array.dtype.kind not in "fiub":
        raise UsageError(f"{name}: expected numbers, found values of type {array.dtype}")
    if array.ndim != 1:
        raise UsageError(f"{name}: expected one value for each sample, found an array of shape {array.shape}")
    return name, np.ascontiguousarray(array, dtype=np.float64)


def _is_number(value: Any) -> bool:
    if value is None:
        return True
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return not isinstance(value, (str, bytes))


def _recordings(
    columns: Iterable[tuple[Any, Any]],
    rate_Hz: float | None,
    mapping: str | PathLike[str] | None,
    name: str,
) -> list[Recording]:
    table = [_column(*column) for column in columns]
    if not table:
        raise UsageError(f"{name}: expected at least one column, found none")
    names = [column[0] for column in table]
    for each in names:
        if names.count(each) > 1:
            raise UsageError(f"{name}: the column {each} occurs twice")
    lengths = {column[0]: len(column[1]) for column in table}
    if len(set(lengths.values())) > 1:
        raise UsageError(f"{name}: expected columns of one length, found {lengths}")
    if 0 in lengths.values():
        raise UsageError(f"{name}: expected at least one sample, found none")
    file = "" if mapping is None else fspath(mapping)
    return _core.recordings_from_columns(table, rate_Hz, file, name)


def _one(recordings: list[Recording], name: str) -> Recording:
    if len(recordings) != 1:
        raise UsageError(f"{name}: the mapping makes {len(recordings)} recordings of it; write it as CSV for read")
    return recordings[0]


def recording_from_dict(
    columns: Mapping[str, Any],
    *,
    rate_Hz: float | None = None,
    mapping: str | PathLike[str] | None = None,
    name: str = "recording",
) -> Recording:
    """A recording of columns of one length, with names as in a CSV file: torque_Nm, gear_angle_deg.

    The column t_s is the clock, which must be uniform; without it, rate_Hz is. A mapping (YAML file) names
    the columns of a foreign log. NaN and None are samples that were not measured.
    """
    return _one(_recordings(columns.items(), rate_Hz, mapping, name), name)


def recording_from_pandas(
    frame: Any,
    *,
    rate_Hz: float | None = None,
    mapping: str | PathLike[str] | None = None,
    name: str = "DataFrame",
) -> Recording:
    """A recording of a DataFrame; as from_dict. An index with the name t_s is the clock."""
    if not hasattr(frame, "items") or not hasattr(frame, "columns"):
        raise UsageError(f"from_pandas: expected a DataFrame, found {type(frame).__name__}")
    columns = list(frame.items())
    if getattr(frame.index, "name", None) in ("t_s", "time_s"):
        columns.insert(0, (frame.index.name, frame.index.to_numpy()))
    return _one(_recordings(columns, rate_Hz, mapping, name), name)


def recording_to_pandas(self: Recording) -> Any:
    """The channels as the columns of a DataFrame, with t_s as its index."""
    import pandas

    index = pandas.Index(self.time_s, name="t_s")
    return pandas.DataFrame({channel: self[channel] for channel in self.channels}, index=index)
