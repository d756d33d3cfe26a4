import os
import pickle
import signal
import threading
import time

import numpy as np
import pandas as pd
import pytest

import torsio


def test_evaluate_gives_scores_with_tables(model, dataset):
    results = torsio.evaluate(model, dataset)
    assert results.target == "torque_Nm" and results.unit == "Nm"
    (test,) = results.together("test")
    assert 0.0 < test.rmse < 5.0 and test.samples > 1000 and test.status == "ok"
    table = results.to_pandas()
    assert isinstance(table, pd.DataFrame) and len(table) == len(results)
    assert "<table>" in results._repr_html_() and "maxwell_slip" in repr(results)


def test_the_score_is_that_of_the_estimates(model, other_sweep):
    estimates = torsio.estimate(model, other_sweep)
    score = torsio.evaluate(model, other_sweep).together()[0]
    chosen = other_sweep.fresh("torque_Nm")
    error = (estimates.value - other_sweep["torque_Nm"])[chosen]
    assert np.sqrt(np.mean(error[-score.samples :] ** 2)) == pytest.approx(score.rmse, rel=0.05)


def test_linear_agrees_with_scikit_learn(sweep):
    linear_model = pytest.importorskip("sklearn.linear_model")
    deflection = sweep["gear_angle_rad"] - sweep["joint_angle_rad"]
    model = torsio.fit(sweep, "linear", inputs="gear_angle_rad - joint_angle_rad")
    fresh = sweep.fresh("torque_Nm")
    peer = linear_model.LinearRegression().fit(deflection[fresh, None], sweep["torque_Nm"][fresh])
    mine = torsio.estimate(model, sweep)
    np.testing.assert_allclose(mine.value, peer.predict(deflection[:, None]), atol=1e-6)


def test_fits_are_repeatable_and_take_options(dataset):
    first = torsio.fit(dataset, "polynomial", degree=3, branch=True, seed=4, serial="elbow-7")
    again = torsio.fit(dataset, "polynomial", degree=3, branch=True, seed=4, serial="elbow-7")
    assert first.to_bytes() == again.to_bytes()
    assert first.options["degree"] == "3" and first.options["branch"] == "true" and first.seed == 4
    assert first.serial == "elbow-7" and first.metrics["rmse"] > 0.0


def test_compare_ranks_and_returns_the_best(dataset):
    comparison = torsio.compare(dataset, ["linear", "polynomial:degree=3"])
    ranked = comparison.results.together()
    assert [row.family for row in ranked] == sorted([row.family for row in ranked], key=lambda f: f == "linear")
    assert comparison.best.family == ranked[0].family
    assert "rmse" in comparison.to_pandas() and "<table>" in comparison._repr_html_()


def test_crossvalidate_summarises_the_folds(dataset):
    validation = torsio.crossvalidate(dataset, "linear,polynomial:branch=false", folds=3)
    assert {row.family for row in validation.summary} == {"linear", "polynomial"}
    assert all(row.folds == 3 and row.rmse_mean > 0.0 for row in validation.summary)
    assert len(validation.to_pandas()) == 2 and "<table>" in validation._repr_html_()


def test_check_finds_a_wrong_sign(sweep):
    report = torsio.check(sweep)
    assert report.verdict in ("PASS", "pass", "WARN", "warn")
    flipped = sweep.to_pandas()
    flipped["torque_Nm"] *= -1.0
    wrong = torsio.check(torsio.Recording.from_pandas(flipped))
    assert any(finding.check == "sign" and finding.verdict.lower() != "pass" for finding in wrong.findings)
    assert len(wrong.to_pandas()) == len(wrong.findings)


def test_attribute_drift_and_transfer_return_their_documents(model, dataset, other_sweep):
    attribution = torsio.attribute(model, other_sweep, windows=5, background=5, window_samples=20, repeats=2)
    assert set(attribution.to_pandas()["input"]) == set(model.inputs)
    drift = torsio.drift(model, other_sweep)
    assert drift["joint"] in ("changed", "not_changed", "cannot be determined") and "verdict" in drift.to_pandas()
    base = torsio.fit(dataset, "linear")
    moved, scores = torsio.transfer(base, dataset, use_s=10.0, method="offset")
    assert moved.family == "linear" and "rmse" in scores.to_pandas()
    with pytest.raises(torsio.UsageError, match="gain_offset"):
        torsio.transfer(base, dataset, method="magic")


def test_wrong_calls_are_refused(dataset, model, sweep):
    for call, message in [
        (lambda: torsio.fit(dataset, "griddy_box"), "grey_box"),
        (lambda: torsio.fit(dataset, "polynomial", degre=3), "degree"),
        (lambda: torsio.fit(dataset, "polynomial", degree="many"), "degree"),
        (lambda: torsio.fit(dataset, "linear", inputs="oil_K"), "oil_K"),
        (lambda: torsio.fit(dataset, "linear", inputs="torque_Nm"), "torque_Nm"),
        (lambda: torsio.compare(sweep), "test"),
        (lambda: torsio.evaluate(model, torsio.Recording.from_dict({"t_s": [0, 1, 2], "a_rad": [1, 2, 3]})), "torque"),
    ]:
        with pytest.raises(torsio.Error, match=message):
            call()


def test_a_model_is_saved_loaded_and_pickled(tmp_path, model, other_sweep):
    model.with_serial("elbow-7").save(tmp_path / "joint.safetensors")
    loaded = torsio.load(tmp_path / "joint.safetensors", serial="elbow-7")
    for other in (loaded, pickle.loads(pickle.dumps(model)), torsio.Model.from_bytes(model.to_bytes())):
        np.testing.assert_array_equal(
            torsio.estimate(other, other_sweep).value, torsio.estimate(model, other_sweep).value
        )
    with pytest.raises(torsio.Error, match="knee-1"):
        torsio.load(tmp_path / "joint.safetensors", serial="knee-1")
    with pytest.raises(torsio.Error):
        torsio.Model.from_bytes(b"junk")
    (tmp_path / "junk.safetensors").write_bytes(os.urandom(1000))
    with pytest.raises(torsio.Error, match="junk.safetensors"):
        torsio.load(tmp_path / "junk.safetensors")


def test_a_pickle_of_a_later_release_is_refused(model):
    for state in [(99, b"", [], [], 0.0), (1,), ("x",), ()]:
        with pytest.raises(torsio.Error, match="pickle of a Model"):
            torsio.Model.__new__(torsio.Model).__setstate__(state)


def test_ctrl_c_stops_a_fit(dataset):
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        torsio.fit(dataset, "lstm", layers="64", epochs=1000)
    assert time.monotonic() - start < 10.0


def test_other_threads_run_during_a_fit(dataset):
    ticks = 0
    done = threading.Event()

    def count():
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    counter = threading.Thread(target=count)
    counter.start()
    torsio.fit(dataset, "lstm", layers="8", epochs=2)
    done.set()
    counter.join()
    assert ticks > 20


def test_families_lists_options():
    names = {name for name, _, _ in torsio.families()}
    assert {"grey_box", "linear", "lstm"} <= names


def test_plots(model, other_sweep):
    matplotlib = pytest.importorskip("matplotlib")

    matplotlib.use("Agg")
    assert torsio.plot.loop(other_sweep, model).get_xlabel() == "spring deflection [rad]"
    assert torsio.plot.series(other_sweep, torsio.estimate(model, other_sweep)).get_ylabel() == "torque_Nm [Nm]"
    assert torsio.plot.residuals(other_sweep, model).get_xlabel() == "time [s]"


def test_track_and_margins(dataset):
    model = torsio.fit(dataset, "linear", inputs="spring_deflection_rad")
    rows = torsio.track("dfki-50", {"mine": model}, "steps", duration_s=4.0).to_pandas()
    assert set(rows["model"]) == {"linear", "mine"} and (rows["status"] == "ok").all()
    locked, free = torsio.margins("dfki-50", bandwidth_rad_s=30.0)
    assert locked.output == "locked" and locked.is_stable and free.gain > 1.0
    for call, message in [
        (lambda: torsio.track("dfki-50", {}, "walk"), "chirp"),
        (lambda: torsio.track("dfki-51", {}), "dfki-5"),
        (lambda: torsio.track("dfki-50", {}, seeds=()), "seeds"),
        (lambda: torsio.margins("dfki-50", load_inertia_kg_m2=-1.0), "load_inertia_kg_m2"),
    ]:
        with pytest.raises(torsio.UsageError, match=message):
            call()


def test_junk_models_are_refused_by_a_text_never_a_crash(model):
    data = model.to_bytes()
    random = np.random.default_rng(1)
    for _ in range(300):
        junk = bytearray(data)
        for place in random.integers(0, len(junk), 3):
            junk[place] = int(random.integers(0, 256))
        try:
            torsio.Model.from_bytes(bytes(junk)).estimator().step(0.0, 0.0)
        except torsio.Error as error:
            assert str(error)
