"""Studies, the registry and fleets."""

import math
import re

import pytest

import torsio


@pytest.fixture(scope="module")
def fleet_list(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    lines = ["joints:"]
    for serial in (3, 4):
        for seed, role in ((1, "train"), (2, "test")):
            recording = torsio.simulate(f"dfki-50#000{serial}", "sweep", seed=seed, duration_s=8.0)
            recording.write_csv(folder / f"{serial}-{role}.csv")
        lines.append(f"  - {{serial: J0{serial}, type: dfki-50, train: {serial}-train.csv, test: {serial}-test.csv}}")
    path = folder / "robot.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_each_joint_of_a_list_gets_a_model_in_the_registry(fleet_list, tmp_path):
    store = tmp_path / "robot.sqlite"
    fleet = torsio.calibrate_fleet(fleet_list, model="linear_coulomb", store=store, promote=True, threads=1)
    joints = fleet.joints()
    assert list(joints["serial"]) == ["J03", "J04"]
    assert (joints["test_rmse"] > 0.0).all()
    assert len(fleet.outliers()) == 0
    assert "0 of 2 joints differ" in repr(fleet)

    registry = torsio.Registry(store)
    assert list(registry.devices()["serial"]) == ["J03", "J04"]
    assert len(registry.models("J03")) == 1
    assert registry.load("J03").family == registry.models("J03")["family"][0]
    assert registry.promote("J03", int(registry.models("J03")["model"][0])) is False
    with pytest.raises(torsio.Error, match="(?i)no .*before|none"):
        registry.roll_back("J03")

    assert list(registry.models()["base_sha256"]) in ([None, None], [None, registry.models("J03")["sha256"][0]])
    ranked = torsio.watch_fleet(store, fleet_list, threads=2)
    assert list(ranked["comparisons"]) == [1, 1]
    assert ranked.attrs["failures"] == []
    assert len(registry.drift("J03")) == 1

    study = torsio.Study(store, "calibrate")
    assert study.counts == {"done": 2}
    assert study.work() == 0
    assert list(torsio.Study.all(store)["name"]) == ["calibrate"]


@pytest.mark.parametrize(
    "opened",
    [
        torsio.Registry,
        torsio.watch_fleet,
        torsio.Study.all,
        lambda store: torsio.Study(store, "calibrate"),
    ],
)
def test_a_store_that_does_not_exist_is_refused_and_not_created(opened, tmp_path):
    store = tmp_path / "misspelt.sqlite"
    with pytest.raises(torsio.UsageError, match=re.escape(f"{store}: there is no store")):
        opened(store)
    assert not store.exists()


def test_a_joint_that_could_not_be_compared_is_warned_of(fleet_list, tmp_path):
    store = tmp_path / "robot.sqlite"
    torsio.calibrate_fleet(fleet_list, model="linear_coulomb", store=store, threads=1)
    with pytest.warns(UserWarning, match="(?s)could not be compared: 2.*J03: .*J04: ") as caught:
        ranked = torsio.watch_fleet(store, fleet_list, threads=1)
    assert [warning.filename for warning in caught] == [__file__]
    assert [failure[:3] for failure in ranked.attrs["failures"]] == ["J03", "J04"]
    assert list(ranked["comparisons"]) == [0, 0]


def test_simulated_specimens_need_no_list():
    fleet = torsio.calibrate_fleet(specimens="dfki-50#0001..#0002", model="linear_coulomb", threads=1)
    assert len(fleet.joints()) == 2
    with pytest.raises(torsio.UsageError, match="either a list"):
        torsio.calibrate_fleet()


def test_a_search_is_a_study_with_trials(fleet_list, tmp_path):
    store = tmp_path / "search.sqlite"
    recordings = [fleet_list.parent / "3-train.csv", fleet_list.parent / "3-test.csv"]
    document = torsio.Study.search(
        recordings, store=store, name="elbow", models="linear,linear_coulomb", folds=2, threads=1
    )
    assert {row["family"] for row in document["summary"]} == {"linear", "linear_coulomb"}
    study = torsio.Study(store, "elbow")
    trials = study.trials()
    assert len(trials) == 4
    assert (trials["state"] == "done").all()
    best = study.best(1)
    assert best["value"][0] == trials["value"].min()
    assert not math.isnan(best["seconds"][0])


def test_an_unknown_study_lists_those_of_the_store(fleet_list, tmp_path):
    store = tmp_path / "search.sqlite"
    torsio.Study.search(fleet_list.parent / "3-train.csv", store=store, name="elbow", models="linear", threads=1)
    with pytest.raises(torsio.UsageError, match="one of elbow"):
        torsio.Study(store, "knee")
