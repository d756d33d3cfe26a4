"""Joint torque of series-elastic actuators: learned from recordings, estimated in real time.

    sweep = torsio.simulate("dfki-50", "sweep", seed=1)            # a Recording
    log = torsio.Recording.from_pandas(frame, rate_Hz=1000)        # or from_dict, or torsio.read("run.csv")
    model = torsio.fit([sweep, log], "grey_box")
    print(torsio.evaluate(model, torsio.read("other_lever.csv")))
    model.save("joint.safetensors")

    estimator = torsio.load("joint.safetensors").estimator(rate_Hz=1000.0)
    torque = estimator.step(gear_angle_rad, joint_angle_rad)       # torque.value, torque.std_dev, torque.fault

All quantities are in SI units, which the names end in. Errors are ValueErrors. Documentation: docs/use/python.md.
"""

from typing import TYPE_CHECKING, Any

from . import _core
from ._core import (
    Arm,
    ArmSimulation,
    Batch,
    Dataset,
    Error,
    Estimate,
    Estimator,
    Load,
    Model,
    Recording,
    UsageError,
    estimate,
    families,
    load,
    read,
    read_load,
    simulate,
    sweep_dataset,
)
from ._faults import Fault
from ._tables import recording_from_dict, recording_from_pandas, recording_to_pandas

if TYPE_CHECKING:
    from . import link, plot
    from ._drives import DriveParameter, IdentifiedDrive, identify, read_drive
    from ._fleet import Fleet, Registry, Study, calibrate_fleet, watch_fleet
    from ._learning import attribute, check, compare, crossvalidate, drift, evaluate, fit, import_network, transfer
    from ._loops import ImpedanceTracking, Tracking, margins, track, track_impedance
    from ._progress import progress
    from ._results import (
        CheckReport,
        Comparison,
        CrossValidation,
        Document,
        Estimates,
        Finding,
        FoldSummary,
        Margins,
        Results,
        Score,
    )
    from ._supervision import (
        Adaptation,
        MonitorReport,
        MonitorSource,
        adapt,
        calibrate_monitor,
        calibrate_simulated_monitor,
        monitor,
        monitor_simulated,
    )

# Their types are in _core.pyi.
setattr(Recording, "from_dict", staticmethod(recording_from_dict))
setattr(Recording, "from_pandas", staticmethod(recording_from_pandas))
setattr(Recording, "to_pandas", recording_to_pandas)

__version__ = _core.__version__

for _type in (Arm, ArmSimulation, Batch, Dataset, Estimate, Estimator, Load, Model, Recording):
    _type.__module__ = "torsio"
del _type

__all__ = [
    "Adaptation",
    "Arm",
    "ArmSimulation",
    "Batch",
    "CheckReport",
    "Comparison",
    "CrossValidation",
    "Dataset",
    "Document",
    "DriveParameter",
    "Error",
    "Estimate",
    "Estimates",
    "Estimator",
    "Fault",
    "Finding",
    "Fleet",
    "FoldSummary",
    "IdentifiedDrive",
    "ImpedanceTracking",
    "Load",
    "Margins",
    "Model",
    "MonitorReport",
    "MonitorSource",
    "Recording",
    "Registry",
    "Results",
    "Score",
    "Study",
    "Tracking",
    "UsageError",
    "adapt",
    "attribute",
    "calibrate_fleet",
    "calibrate_monitor",
    "calibrate_simulated_monitor",
    "check",
    "compare",
    "crossvalidate",
    "drift",
    "estimate",
    "evaluate",
    "families",
    "fit",
    "identify",
    "import_network",
    "link",
    "load",
    "margins",
    "monitor",
    "monitor_simulated",
    "plot",
    "progress",
    "read",
    "read_drive",
    "read_load",
    "simulate",
    "sweep_dataset",
    "track",
    "track_impedance",
    "transfer",
    "watch_fleet",
]


# Imported when they are first used: a loop that only loads a model starts sooner.
_LATER = {
    "_drives": "DriveParameter IdentifiedDrive identify read_drive",
    "_fleet": "Fleet Registry Study calibrate_fleet watch_fleet",
    "_learning": "attribute check compare crossvalidate drift evaluate fit import_network transfer",
    "_loops": "ImpedanceTracking Tracking margins track track_impedance",
    "_progress": "progress",
    "_results": "CheckReport Comparison CrossValidation Document Estimates Finding FoldSummary Margins Results Score",
    "_supervision": "Adaptation MonitorReport MonitorSource adapt calibrate_monitor calibrate_simulated_monitor"
    " monitor monitor_simulated",
}


def __getattr__(name: str) -> Any:
    import importlib

    if name in ("link", "plot", "torch"):
        return importlib.import_module(f"torsio.{name}")
    for module, names in _LATER.items():
        if name in names.split():
            value = getattr(importlib.import_module(f"torsio.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'torsio' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
