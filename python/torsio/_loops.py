"""Loops on simulated joints: `torsio track` and `torsio tune-loop` as functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any, Union

from . import _core
from ._core import Model, Recording, UsageError
from ._progress import Listener, shown
from ._results import Document, Margins, _data_frame, _document, _number, _table_html, _table_text

#: A YAML schedule of faults (docs/simulation/faults.md), or texts such as "gear_angle=freeze@2s..4s", "kt=-20%@3s".
Faults = Union[str, "PathLike[str]", Sequence[str], None]


def split_faults(faults: Faults) -> tuple[str, list[str]]:
    """The path of a schedule and the faults as texts, of which one is empty."""
    if faults is None:
        return "", []
    if isinstance(faults, (str, PathLike)):
        path = fspath(faults)
        if "=" in path and "@" in path:
            raise UsageError(f"faults: expected a YAML file or a list of texts, found {path!r}: write [{path!r}]")
        return path, []
    return "", list(faults)


_COLUMNS = ("actuator", "output", "reference", "model", "seed", "rmse", "max_abs", "bandwidth_Hz", "status")


@dataclass(frozen=True, repr=False)
class Tracking(Document):
    """What `track` found: a row for each model and seed under `results`."""

    #: Of the first seed with the only model (or the line): sensors, every term of the command, `truth_` channels.
    record: Recording | None = None

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        rows = self.document[self.table]
        return _COLUMNS, [[row[name] for name in _COLUMNS] for row in rows], self.table


def track(
    actuator: str,
    models: Mapping[str, Model] | None = None,
    reference: str = "chirp",
    *,
    recorded: Recording | None = None,
    amplitude_Nm: float | None = None,
    duration_s: float | None = None,
    bandwidth_rad_s: float = 50.0,
    damping: float = 0.9,
    is_free: bool = False,
    lever_m: float | None = None,
    friction: float = 0.0,
    observer_Hz: float | None = None,
    feed_forward: bool = False,
    lowest_rad: float | None = None,
    highest_rad: float | None = None,
    speed_rad_s: float | None = None,
    acts_on: str = "current",
    velocity_bandwidth_rad_s: float | None = None,
    faults: Faults = None,
    seeds: Sequence[int] = (1,),
    record: bool = False,
    progress: Listener | None = None,
) -> Tracking:
    """A torque loop on a simulated joint, with a line from sweeps and with each model (docs/simulation/tracking.md).

    reference: chirp, random-walk, steps, sweep, or replay with recorded=, whose torque_Nm is followed.
    is_free: the lever (lever_m, 0.8 m without it) moves with 9 kg; else the output is locked.
    friction: share of the drive's friction that is compensated, 0 to 1. observer_Hz: of a disturbance observer.
    feed_forward: the rate of the reference is fed forward.
    lowest_rad, highest_rad, speed_rad_s: limits of the rotor's angle and speed over the gear ratio, which override
    the loop. acts_on: "current", or "velocity" for a velocity loop.
    faults: a schedule or texts; each is reported in the rows.
    record: also the signals of the first run. Equal arguments give equal results.
    Errors: UsageError before the first run for a call that is not possible; a run that fails is a row with the
    status "failed" and the reason.
    """
    if acts_on not in ("current", "velocity"):
        raise UsageError(f'acts_on: expected "current" or "velocity", found {acts_on!r}')
    call = _core.TrackCall()
    call.reference = reference
    call.recorded = recorded
    call.amplitude_Nm, call.duration_s = amplitude_Nm, duration_s
    call.bandwidth_rad_s, call.damping = bandwidth_rad_s, damping
    call.is_free, call.lever_m = is_free, lever_m
    call.friction_share, call.observer_Hz, call.feeds_forward = friction, observer_Hz, feed_forward
    call.lowest_rad, call.highest_rad, call.speed_rad_s = lowest_rad, highest_rad, speed_rad_s
    call.acts_on_velocity = acts_on == "velocity"
    call.velocity_rad_s = velocity_bandwidth_rad_s
    call.schedule, call.injections = split_faults(faults)
    with shown(progress):
        text, signals = _core.track(actuator, list((models or {}).items()), call, list(seeds), record)
    document = Document.from_json(text, "results")
    return Tracking(document.document, document.table, signals)


@dataclass(frozen=True, repr=False)
class ImpedanceTracking:
    """What `track_impedance` found: a run without a model and one with each."""

    document: dict[str, Any]  #: of `torsio track --impedance --json`
    records: list[Recording]  #: of each run the motion of a hand, with the `truth_` channels

    @property
    def runs(self) -> list[dict[str, Any]]:
        """Of each run: model, gains, passive_to_Hz, largest_passive_stiffness_Nm_rad, frequencies, hand."""
        runs: list[dict[str, Any]] = self.document.get("runs", [self.document])
        return runs

    def _rows(self) -> list[dict[str, Any]]:
        rows = []
        for run in self.runs:
            for point in run["frequencies"]:
                row = {"model": run["model"] or "none", "frequency_Hz": point["frequency_Hz"]}
                for each in ("wanted", "linear", "rendered"):
                    row[f"{each}_Nm_rad"] = point[each]["magnitude_Nm_rad"]
                    row[f"{each}_phase_deg"] = _number(point[each]["phase_deg"])
                rows.append(row)
        return rows

    def to_pandas(self) -> Any:
        """A DataFrame with a row for each run and frequency: sizes and phases of torque over angle."""
        return _data_frame(self._rows())

    def _cells(self) -> tuple[Sequence[str], list[list[Any]], str]:
        rows = self._rows()
        return list(rows[0]), [list(row.values()) for row in rows], "impedance"

    def __repr__(self) -> str:
        return _table_text(*self._cells())

    def _repr_html_(self) -> str:
        return _table_html(*self._cells())


def track_impedance(
    actuator: str = "harmonic-drive",
    impedance: str | float = "high",
    models: Mapping[str, Model] | None = None,
    *,
    damping_Nms_rad: float = 0.0,
    torque_gain_Nm_rad: float | None = None,
    bandwidth_rad_s: float | None = None,
    loop_damping: float | None = None,
    correction_rad_s: float | None = None,
    amplitude_Nm: float | None = None,
    duration_s: float = 60.0,
    seed: int = 1,
    progress: Listener | None = None,
) -> ImpedanceTracking:
    """A stiffness and a damping at the output of a simulated joint, tau = K q + D dq/dt (docs/simulation/tracking.md).

    impedance: K in Nm/rad, with damping_Nms_rad; "zero", or for harmonic-drive "high" (gains of paper 004).
    models: each is the inverse of the spring in a run of its own, or, where it has none, its estimate corrects the
    torque within correction_rad_s (6 by default; refused where no estimate corrects). Without models there is one run.
    torque_gain_Nm_rad: K_tp of the inner loop, only with a torsion tube (harmonic-drive).
    bandwidth_rad_s, loop_damping: of the torque loop through the spring, without a torsion tube.
    amplitude_Nm: of the sines at the output. duration_s: of the motion of a hand, 10 to 3600.
    Errors: UsageError for an impedance that is unstable, or with a torsion tube not passive up to 10 Hz: the message
    states the largest stiffness or the fastest correction that is. Equal arguments give equal results.
    """
    with shown(progress):
        text, records = _core.track_impedance(
            actuator,
            impedance,
            list((models or {}).items()),
            damping_Nms_rad,
            torque_gain_Nm_rad,
            bandwidth_rad_s,
            loop_damping,
            correction_rad_s,
            amplitude_Nm,
            duration_s,
            seed,
        )
    return ImpedanceTracking(_document(text), records)


def margins(
    actuator: str, *, bandwidth_rad_s: float = 50.0, damping: float = 0.9, load_inertia_kg_m2: float = 0.0
) -> list[Margins]:
    """Stability margins of the deflection control at 1 kHz on the data sheet of an actuator, locked and free."""
    return [Margins(*row) for row in _core.margins(actuator, bandwidth_rad_s, damping, load_inertia_kg_m2)]
