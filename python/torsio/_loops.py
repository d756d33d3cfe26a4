"""Loops on simulated joints: `torsio track` and `torsio tune-loop` as functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any, Union

from . import _core
from ._core import Model, Recording, UsageError
from ._progress import Listener, shown
from ._results import Document, Margins

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


def margins(
    actuator: str, *, bandwidth_rad_s: float = 50.0, damping: float = 0.9, load_inertia_kg_m2: float = 0.0
) -> list[Margins]:
    """Stability margins of the deflection control at 1 kHz on the data sheet of an actuator, locked and free."""
    return [Margins(*row) for row in _core.margins(actuator, bandwidth_rad_s, damping, load_inertia_kg_m2)]
