import pathlib

import numpy as np
import pytest

import torsio


def short_sweep(seed: int, lever_m: float = 0.17) -> torsio.Recording:
    return torsio.simulate("dfki-50", "sweep", seed=seed, duration_s=20.0, lever_m=lever_m)


@pytest.fixture(scope="session")
def sweep() -> torsio.Recording:
    return short_sweep(1)


@pytest.fixture(scope="session")
def other_sweep() -> torsio.Recording:
    return short_sweep(2, 0.2)


@pytest.fixture(scope="session")
def dataset(sweep, other_sweep) -> torsio.Dataset:
    return torsio.Dataset(train=sweep, test=other_sweep)


@pytest.fixture(scope="session")
def model(dataset) -> torsio.Model:
    return torsio.fit(dataset, "maxwell_slip", seed=1)


@pytest.fixture(scope="session")
def network(dataset) -> torsio.Model:
    return torsio.fit(dataset, "lstm", seed=1, layers="8", epochs=2)


@pytest.fixture
def inputs(other_sweep, model) -> np.ndarray:
    """Rows for the model's estimator, shape (samples, channels)."""
    return np.column_stack([other_sweep[channel] for channel in model.estimator().raw_inputs])


@pytest.fixture(scope="session")
def pendulum_file(tmp_path_factory) -> pathlib.Path:
    """The load file of simulated recordings in the air."""
    path = tmp_path_factory.mktemp("load") / "load.yaml"
    path.write_text("load: {pendulum: {mass: mass_kg, length: lever_m}}\n")
    return path
