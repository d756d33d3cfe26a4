"""What the functions of torsio return: dataclasses that become pandas DataFrames and HTML tables."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import Model
from ._faults import Fault

if TYPE_CHECKING:
    import numpy.typing as npt

_SCHEMA_VERSION = 1


def _document(text: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(text)
    if document.get("schema_version") != _SCHEMA_VERSION:
        raise ValueError(
            f"result: expected schema_version {_SCHEMA_VERSION}, found {document.get('schema_version')}"
        )
    return document


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.4g}"
    return str(value)


def _table_html(columns: Sequence[str], rows: Sequence[Sequence[Any]], caption: str) -> str:
    def cells(kind: str, values: Sequence[Any]) -> str:
        return "".join(f"<{kind}>{html.escape(_text(value))}</{kind}>" for value in values)

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f"<table><caption>{html.escape(caption)}</caption>"
        f"<thead><tr>{cells('th', columns)}</tr></thead><tbody>{body}</tbody></table>"
    )


def _table_text(columns: Sequence[str], rows: Sequence[Sequence[Any]], caption: str) -> str:
    cells = [list(columns)] + [[_text(value) for value in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in cells]
    return "\n".join([caption, *lines])


def _data_frame(rows: Sequence[Mapping[str, Any]]) -> Any:
    import pandas

    return pandas.DataFrame(list(rows))


@dataclass(frozen=True, repr=False)
class Estimates:
    """Estimates of consecutive samples, or of the rows of a batch; all arrays have shape (rows,)."""

    value: npt.NDArray[np.float64]  #: in the unit of the target; finite in every case
    std_dev: npt.NDArray[np.float64]  #: one standard deviation, NaN without evidence
    novelty: npt.NDArray[np.float64]  #: larger: less like the training data; NaN if unknown
    fault: npt.NDArray[np.uint8]  #: `Fault` as a number; 0: the value may be used

    def __len__(self) -> int:
        return len(self.value)

    @property
    def is_usable(self) -> npt.NDArray[np.bool_]:
        """True where there is no fault."""
        usable: npt.NDArray[np.bool_] = self.fault == 0
        return usable

    def to_pandas(self) -> Any:
        """A DataFrame with the columns value, std_dev, novelty and fault (by name)."""
        names = np.array([fault.name for fault in Fault])
        return _data_frame_of(self, names)

    def __repr__(self) -> str:
        count = int(np.count_nonzero(self.fault == 0))
        return f"<Estimates: {len(self)} rows, {count} without a fault>"


def _data_frame_of(estimates: Estimates, names: npt.NDArray[Any]) -> Any:
    import pandas

    return pandas.DataFrame(
        {
            "value": estimates.value,
            "std_dev": estimates.std_dev,
            "novelty": estimates.novelty,
            "fault": pandas.Categorical.from_codes(estimates.fault, categories=list(names)),
        }
    )


@dataclass(frozen=True)
class Score:
    """One model on one recording, or on a whole split (recording is None), in free run.

    Errors are in the unit of the target.
    """

    family: str
    variant: str
    split: str
    recording: str | None
    rmse: float
    mad: float
    max_abs: float
    fit_percent: float
    samples: int
    guarded_samples: int
    within_std_dev: float
    within_2_std_dev: float
    step_ns_p50: float
    fit_seconds: float
    parameter_count: int
    status: str
    reason: str
    mode: str = "free_run"
    fold: str = ""
    mean_std_dev: float = math.nan  #: mean error bar of the samples that have one
    without_std_dev: float = math.nan  #: share of the samples without an error bar
    common_rmse: float = math.nan  #: on the samples that no compared model guarded; ranks


_TABLE = ("family", "variant", "split", "recording", "rmse", "mad", "max_abs", "fit_percent", "status")


def _score(row: Mapping[str, Any]) -> Score:
    values: dict[str, Any] = {}
    for each in fields(Score):
        value = row.get(each.name)
        if each.type == "float":
            value = _number(value)
        elif each.type == "int":
            value = int(value or 0)
        elif each.type == "str":
            value = value or ""
        values[each.name] = value
    return Score(**values)


@dataclass(frozen=True, repr=False)
class Results:
    """Scores of one or several models; iterate over them, or `to_pandas()`."""

    target: str
    unit: str
    inputs: list[str]
    rows: list[Score]
    document: dict[str, Any] = field(compare=False)  #: as docs/use/json.md describes it

    @classmethod
    def from_json(cls, text: str) -> Results:
        document = _document(text)
        return cls(
            target=document["target"],
            unit=document["unit"],
            inputs=list(document["inputs"]),
            rows=[_score(row) for row in document["results"]],
            document=document,
        )

    def __iter__(self) -> Iterator[Score]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def together(self, split: str = "test") -> list[Score]:
        """The scores of whole splits, best first: by `common_rmse` where the models were ranked."""
        chosen = [
            row for row in self.rows if row.split == split and row.recording is None and row.mode == "free_run"
        ]

        def rank(row: Score) -> tuple[bool, float]:
            error = row.rmse if math.isnan(row.common_rmse) else row.common_rmse
            return (math.isnan(error), error)

        return sorted(chosen, key=rank)

    def to_pandas(self) -> Any:
        """A DataFrame with one row for each score."""
        return _data_frame([vars(row) for row in self.rows])

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        rows = [[getattr(row, name) or "" for name in _TABLE] for row in self.rows]
        return _TABLE, rows, f"errors of {self.target} in {self.unit}"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


@dataclass(frozen=True, repr=False)
class Comparison:
    """Several models on the same samples."""

    results: Results
    best: Model | None  #: the first of the ranking; None if every fit failed or no ranking is possible

    def to_pandas(self) -> Any:
        """The scores as a DataFrame."""
        return self.results.to_pandas()

    def __repr__(self) -> str:
        return repr(self.results)

    def _repr_html_(self) -> str:
        return self.results._repr_html_()


@dataclass(frozen=True)
class FoldSummary:
    """One model over all folds: means and standard deviations of one fold."""

    family: str
    variant: str
    folds: int
    failed_folds: int
    rmse_mean: float
    rmse_std: float
    common_rmse_mean: float
    common_rmse_std: float
    worst_fold: str
    status: str
    reason: str


@dataclass(frozen=True, repr=False)
class CrossValidation:
    """Every model on every fold; `summary` has the best first."""

    results: Results
    summary: list[FoldSummary]

    @classmethod
    def from_json(cls, text: str) -> CrossValidation:
        results = Results.from_json(text)
        summary = []
        for row in results.document["summary"]:
            values: dict[str, Any] = {
                each.name: _number(row.get(each.name)) if each.type == "float" else row.get(each.name) or ""
                for each in fields(FoldSummary)
                if each.type != "int"
            }
            summary.append(FoldSummary(folds=row["folds"], failed_folds=row["failed_folds"], **values))
        return cls(results, summary)

    def to_pandas(self) -> Any:
        """The summary as a DataFrame, one row for each model."""
        return _data_frame([vars(row) for row in self.summary])

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        columns = [each.name for each in fields(FoldSummary)]
        rows = [[getattr(row, name) for name in columns] for row in self.summary]
        return columns, rows, f"errors of {self.results.target} in {self.results.unit}, mean over the folds"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


@dataclass(frozen=True)
class Finding:
    """The result of one check for one recording, or for all of them together (recording is None)."""

    verdict: str  #: pass, warn or fail
    check: str
    recording: str | None
    message: str
    advice: str


@dataclass(frozen=True, repr=False)
class CheckReport:
    """What `check` found in the recordings."""

    verdict: str  #: the most severe of all findings
    findings: list[Finding]
    document: dict[str, Any] = field(compare=False)

    @classmethod
    def from_json(cls, text: str) -> CheckReport:
        document = _document(text)
        return cls(document["verdict"], [Finding(**row) for row in document["findings"]], document)

    def to_pandas(self) -> Any:
        """One row for each finding."""
        return _data_frame([vars(row) for row in self.findings])

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        columns = [each.name for each in fields(Finding)]
        rows = [[getattr(row, name) or "" for name in columns] for row in self.findings]
        return columns, rows, f"check: {self.verdict}"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


@dataclass(frozen=True)
class Margins:
    """Stability margins of a torque loop whose output is locked or free (docs/robot/control.md)."""

    output: str  #: locked or free
    is_stable: bool
    phase_rad: float  #: the least over all frequencies of gain 1; infinite if there is none
    crossover_rad_s: float
    gain: float  #: the least factor above 1 that makes the loop unstable; infinite if none
    gain_rad_s: float
    least_gain: float  #: the largest factor below 1 that makes the loop unstable; 0 if none


@dataclass(frozen=True, repr=False)
class Document:
    """A result as the JSON document of the program (docs/use/json.md), with one of its lists as a table."""

    document: dict[str, Any]
    table: str  #: key of that list

    @classmethod
    def from_json(cls, text: str, table: str) -> Document:
        return cls(_document(text), table)

    def __getitem__(self, key: str) -> Any:
        return self.document[key]

    def to_pandas(self) -> Any:
        """The table as a DataFrame."""
        return _data_frame(self.document[self.table])

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        rows = self.document[self.table]
        columns = list(rows[0]) if rows else []
        return columns, [[row.get(name, "") for name in columns] for row in rows], self.table

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())
