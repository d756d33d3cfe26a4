"""Plots on matplotlib axes; each function returns the axes that it draws on."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._core import Model, Recording, estimate
from ._results import Estimates


def _axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    import matplotlib.pyplot as pyplot

    return pyplot.subplots()[1]


def _unit(channel: str) -> str:
    return channel.rpartition("_")[2]


def _deflection(recording: Recording) -> tuple[Any, str]:
    if "spring_deflection_rad" in recording:
        return recording["spring_deflection_rad"], "spring deflection [rad]"
    return recording["gear_angle_rad"] - recording["joint_angle_rad"], "spring deflection [rad]"


def loop(
    recording: Recording,
    model: Model | Estimates | None = None,
    *,
    x: str | None = None,
    target: str = "torque_Nm",
    axes: Any = None,
) -> Any:
    """The target over the deflection of the spring (or the channel x): the hysteresis, and that of a model."""
    values, label = _deflection(recording) if x is None else (recording[x], x)
    axes = _axes(axes)
    if target in recording:
        axes.plot(values, recording[target], label="measured", linewidth=0.8)
    if model is not None:
        estimates = estimate(model, recording) if isinstance(model, Model) else model
        usable = np.where(estimates.is_usable, estimates.value, np.nan)
        axes.plot(values, usable, label="model", linewidth=0.8)
    axes.set_xlabel(label)
    axes.set_ylabel(f"{target} [{_unit(target)}]")
    axes.legend()
    return axes


def series(recording: Recording, model: Model | Estimates, *, target: str = "torque_Nm", axes: Any = None) -> Any:
    """Target and estimate over the time, with two error bars on either side; samples with a fault are left out."""
    estimates = estimate(model, recording) if isinstance(model, Model) else model
    t_s = recording.time_s
    usable = np.where(estimates.is_usable, estimates.value, np.nan)
    spread = 2.0 * np.nan_to_num(estimates.std_dev)
    axes = _axes(axes)
    if target in recording:
        axes.plot(t_s, recording[target], label="measured", linewidth=0.8)
    axes.plot(t_s, usable, label="model", linewidth=0.8)
    axes.fill_between(t_s, usable - spread, usable + spread, alpha=0.3, label="2 standard deviations")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{target} [{_unit(target)}]")
    axes.legend()
    return axes


def residuals(recording: Recording, model: Model | Estimates, *, target: str = "torque_Nm", axes: Any = None) -> Any:
    """Error of the estimate over the time, where there is no fault, and two error bars on either side of 0."""
    estimates = estimate(model, recording) if isinstance(model, Model) else model
    t_s = recording.time_s
    error = np.where(estimates.is_usable, estimates.value - recording[target], np.nan)
    spread = 2.0 * np.nan_to_num(estimates.std_dev)
    axes = _axes(axes)
    axes.plot(t_s, error, label="model - measured", linewidth=0.8)
    axes.fill_between(t_s, -spread, spread, alpha=0.3, label="2 standard deviations")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"error of {target} [{_unit(target)}]")
    axes.legend()
    return axes
