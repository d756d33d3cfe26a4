import copy
import dataclasses
import multiprocessing
import pickle
import threading

import numpy as np
import pandas as pd
import pytest

import torsio


def same(a: torsio.Estimates, b: torsio.Estimates) -> None:
    for name in ("value", "std_dev", "novelty", "fault"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def of_steps(estimator: torsio.Estimator, rows: np.ndarray) -> torsio.Estimates:
    steps = [estimator.step(*row) for row in rows]
    return torsio.Estimates(
        np.array([s.value for s in steps]),
        np.array([s.std_dev for s in steps]),
        np.array([s.novelty for s in steps]),
        np.array([s.fault for s in steps], dtype=np.uint8),
    )


@pytest.fixture(params=["model", "network"])
def any_model(request) -> torsio.Model:
    return request.getfixturevalue(request.param)


def test_run_and_step_give_the_same_bits(any_model, inputs):
    same(any_model.estimator().run(inputs[:3000]), of_steps(any_model.estimator(), inputs[:3000]))


def test_run_gives_the_bits_of_estimate(any_model, inputs, other_sweep):
    same(any_model.estimator().run(inputs), torsio.estimate(any_model, other_sweep))


def test_run_takes_every_layout(model, inputs, other_sweep):
    expected = model.estimator().run(inputs)
    names = model.estimator().raw_inputs
    wide = np.zeros((len(inputs), 7))
    wide[:, 1 : 1 + 2 * inputs.shape[1] : 2] = inputs
    for other in (
        np.asfortranarray(inputs),
        wide[:, 1 : 1 + 2 * inputs.shape[1] : 2],
        inputs[::-1][::-1],
        inputs.astype(">f8"),
        inputs.tolist(),
        pd.DataFrame(inputs[:, ::-1], columns=names[::-1]),
        other_sweep.to_pandas(),
    ):
        same(model.estimator().run(other), expected)
    single = model.estimator().run(inputs.astype(np.float32))
    np.testing.assert_array_equal(single.value, model.estimator().run(inputs.astype(np.float32).astype(float)).value)


def test_step_takes_numbers_rows_and_names(model, inputs):
    names = model.estimator().raw_inputs
    row = inputs[100]
    expected = model.estimator().step(*row).value
    for call in (
        lambda e: e.step(list(row)),
        lambda e: e.step(tuple(row)),
        lambda e: e.step(row),
        lambda e: e.step(row.astype(np.float64)[::1]),
        lambda e: e.step(**dict(zip(names, row))),
    ):
        assert call(model.estimator()).value == expected


@pytest.mark.parametrize(
    "bad, message",
    [
        (np.zeros((5, 9)), r"\(5, 9\)"),
        (np.zeros(5), r"\(5,\)"),
        (np.zeros((2, 2, 2)), r"\(2, 2, 2\)"),
        (np.array([["a", "b"]]), "numbers of shape"),
        (np.zeros((3, 2), dtype=complex), "complex"),
        (np.array([[None, 1.0]], dtype=object), "object"),
        ("text", "numbers of shape"),
        (None, "numbers of shape"),
        (pd.DataFrame({"oil_K": [1.0]}), "without the column"),
        ([[1.0, 2.0], [3.0]], "numbers of shape"),
    ],
)
def test_run_refuses_what_is_no_table_of_its_channels(model, bad, message):
    with pytest.raises(torsio.Error, match=message):
        model.estimator().run(bad)


def test_step_refuses_wrong_arguments(model):
    estimator = model.estimator()
    for call in (
        lambda: estimator.step(),
        lambda: estimator.step(1.0),
        lambda: estimator.step(*range(9)),
        lambda: estimator.step("a", "b"),
        lambda: estimator.step([1.0, 2.0, 3.0, 4.0]),
        lambda: estimator.step(oil_K=1.0, gear_angle_rad=2.0),
        lambda: estimator.step(None, None),
        lambda: estimator.step(np.zeros((3, 3))),
    ):
        with pytest.raises(torsio.Error, match="step"):
            call()


def test_a_row_of_nan_is_a_fault_not_an_exception(model, inputs):
    rows = inputs[:1000].copy()
    rows[500] = np.nan
    out = model.estimator().run(rows)
    assert out.fault[500] == torsio.Fault.input_not_finite and np.isfinite(out.value).all()
    estimate = model.estimator().step(*[float("nan")] * rows.shape[1])
    assert estimate.fault is torsio.Fault.input_not_finite and estimate.fault
    assert len(out.to_pandas()) == 1000 and not out.is_usable[500]


def test_no_rows_give_no_estimates(model, inputs):
    assert len(model.estimator().run(inputs[:0])) == 0


def test_a_saved_state_continues_to_the_bit(any_model, inputs):
    estimator = any_model.estimator()
    estimator.run(inputs[:1500])
    state = estimator.save()
    twin = copy.copy(estimator)
    deep = copy.deepcopy(estimator)
    restored = pickle.loads(pickle.dumps(estimator))
    expected = estimator.run(inputs[1500:2500])
    estimator.run(inputs[:77])
    estimator.load(state)
    fresh = any_model.estimator()
    fresh.load(state)
    for each in (estimator, twin, deep, restored, fresh):
        same(each.run(inputs[1500:2500]), expected)


def test_junk_states_are_refused_and_change_nothing(any_model, inputs):
    estimator = any_model.estimator()
    estimator.run(inputs[:1000])
    state = estimator.save()
    for junk in (b"", state[:-1], state + b"x", bytes(len(state)), state[:40] + b"\xff" + state[41:]):
        with pytest.raises(torsio.Error):
            estimator.load(junk)
        assert estimator.save() == state
    for junk in (None, 3, "text", [1, 2]):
        with pytest.raises(torsio.UsageError):
            estimator.load(junk)


def test_zeros_are_kept_by_copies_and_pickles(model, inputs):
    estimator = model.estimator()
    estimator.set_zero(estimator.raw_inputs[0], 0.001)
    expected = copy.copy(estimator).run(inputs[:500])
    same(pickle.loads(pickle.dumps(estimator)).run(inputs[:500]), expected)
    assert (expected.value != model.estimator().run(inputs[:500]).value).any()
    with pytest.raises(torsio.UsageError, match="oil_K"):
        estimator.set_zero("oil_K", 1.0)


def test_a_pickle_of_a_later_release_is_refused():
    with pytest.raises(torsio.Error, match="pickle of a Estimator"):
        torsio.Estimator.__new__(torsio.Estimator).__setstate__((2, b"", 1.0, {}, b""))


def test_two_threads_on_one_estimator_never_mix(model, inputs):
    estimator = model.estimator()
    rows = np.tile(inputs, (20, 1))
    failures = []

    def use():
        for _ in range(20):
            try:
                estimator.run(rows)
            except torsio.UsageError as error:
                failures.append(str(error))

    threads = [threading.Thread(target=use) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all("another thread" in failure for failure in failures)


def test_a_state_is_not_read_while_it_changes(model, inputs):
    estimator = model.estimator()
    estimator.step(inputs[0])
    many = np.tile(inputs, (200, 1))
    thread = threading.Thread(target=estimator.run, args=(many,))
    thread.start()
    refused = {}
    while thread.is_alive():
        for name, read in (
            ("save", estimator.save),
            ("copy", lambda: copy.copy(estimator)),
            ("pickle", lambda: pickle.dumps(estimator)),
        ):
            try:
                read()
            except ValueError as error:
                refused[name] = str(error)
    thread.join()
    assert set(refused) == {"save", "copy", "pickle"}
    assert all("another thread" in text for text in refused.values())
    estimator.save()
    estimator.reset()
    same(estimator.run(inputs), model.estimator().run(inputs))


def run_in_child(estimator, rows):
    return estimator.run(rows).value


def test_estimators_travel_to_other_processes(model, inputs):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        value = pool.apply(run_in_child, (model.estimator(), inputs[:500]))
    np.testing.assert_array_equal(value, model.estimator().run(inputs[:500]).value)


def test_other_rates(model, network):
    assert model.estimator(rate_Hz=500.0).sample_rate_Hz == 500.0
    with pytest.raises(torsio.Error):
        network.estimator(rate_Hz=500.0)
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(torsio.UsageError, match="rate_Hz"):
            model.estimator(rate_Hz=rate)


def test_a_batch_gives_the_bits_of_single_estimators(any_model, inputs):
    rows = 5
    batch = any_model.batch(rows)
    singles = [any_model.estimator() for _ in range(rows)]
    shift = 400
    saved = None
    for n in range(600):
        row = np.stack([inputs[n + shift * k] for k in range(rows)])
        if n == 300:
            mask = np.array([True, False, True, False, False])
            batch.reset(mask)
            for k in np.flatnonzero(mask):
                singles[k].reset()
        if n == 500:
            saved = batch.save()
            after = [single.save() for single in singles]
            assert [saved[k].tobytes() for k in range(rows)] == after
        out = batch.step(row)
        for k in range(rows):
            expected = singles[k].step(*row[k])
            assert out.value[k] == expected.value and out.fault[k] == expected.fault
    batch.load(saved)
    assert (batch.save() == saved).all()


def test_a_batch_writes_into_the_arrays_of_out(model, inputs):
    batch, other = model.batch(3), model.batch(3)
    kept = batch.step(inputs[:3])
    first = other.step(inputs[:3])
    value = kept.value
    for n in range(1, 200):
        assert batch.step(inputs[n : n + 3], out=kept) is kept and kept.value is value
        expected = other.step(inputs[n : n + 3])
        for name in ("value", "std_dev", "novelty", "fault"):
            assert getattr(kept, name).tobytes() == getattr(expected, name).tobytes()
    assert kept.value.tobytes() != first.value.tobytes()


def test_a_batch_refuses_another_out_and_keeps_its_state(model, inputs):
    batch = model.batch(3)
    good = batch.step(inputs[:3])
    state = batch.save()
    read_only = np.zeros(3)
    read_only.flags.writeable = False
    for field, array in (
        ("value", np.zeros(2)),
        ("value", np.zeros(3, dtype=np.float32)),
        ("value", np.zeros((3, 1))),
        ("std_dev", np.zeros(6)[::2]),
        ("novelty", read_only),
        ("fault", np.zeros(3)),
        ("fault", None),
    ):
        with pytest.raises(torsio.UsageError, match=f"out.{field}"):
            batch.step(inputs[:3], out=dataclasses.replace(good, **{field: array}))
    with pytest.raises(torsio.UsageError, match="Estimates"):
        batch.step(inputs[:3], out=np.zeros(3))
    memory = np.zeros(5)
    for std_dev, fault in ((memory[2:], good.fault), (good.std_dev, memory[1:2].view(np.uint8)[:3])):
        with pytest.raises(torsio.UsageError, match="share no memory"):
            batch.step(
                inputs[:3], out=dataclasses.replace(good, value=memory[:3], std_dev=std_dev, fault=fault)
            )
    assert (batch.save() == state).all()


def test_a_batch_reads_its_inputs_before_it_writes(model, inputs):
    batch, other = model.batch(3), model.batch(3)
    kept = batch.step(inputs[:3])
    other.step(inputs[:3])
    columns = np.asfortranarray(inputs[1:4])
    kept = dataclasses.replace(kept, value=columns[:, 0])
    expected = other.step(inputs[1:4])
    assert batch.step(columns, out=kept).value.tobytes() == expected.value.tobytes()


def test_a_batch_refuses_bytes_that_are_no_state(model, inputs):
    batch = model.batch(3)
    batch.step(inputs[:3])
    state = batch.save()
    spoilt = state.copy()
    spoilt[2, -1] ^= 1
    with pytest.raises(torsio.Error, match="row 2") as caught:
        batch.load(spoilt)
    assert not isinstance(caught.value, torsio.UsageError)
    assert (batch.save() == state).all()


def test_a_batch_refuses_wrong_calls(model, inputs):
    batch = model.batch(3)
    width = inputs.shape[1]
    for call in (
        lambda: batch.step(np.zeros((2, width))),
        lambda: batch.step(np.zeros((3, width + 1))),
        lambda: batch.reset(np.zeros(3)),
        lambda: batch.reset(np.zeros(2, dtype=bool)),
        lambda: batch.load(np.zeros((3, 4), dtype=np.uint8)),
        lambda: batch.load(np.zeros_like(batch.save())),
        lambda: batch.load(b"junk"),
        lambda: model.batch(0),
    ):
        with pytest.raises(torsio.Error):
            call()


def test_fault_numbers_are_those_of_the_library(model):
    assert torsio.Fault.none == 0 and not torsio.Fault.none
    assert [fault.value for fault in torsio.Fault] == list(range(10))
