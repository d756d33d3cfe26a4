import gzip
import json
import pickle

import numpy as np
import pandas as pd
import pytest

import torsio


def frame(samples: int = 2000) -> pd.DataFrame:
    t = np.arange(samples) / 1000.0
    x = 0.1 * np.sin(2.0 * t)
    return pd.DataFrame(
        {"t_s": t, "gear_angle_deg": np.rad2deg(x), "joint_angle_deg": np.zeros(samples), "torque_Nm": 100.0 * x}
    )


def test_a_data_frame_is_read_as_a_csv_file_is(tmp_path):
    frame().to_csv(tmp_path / "run.csv", index=False)
    with gzip.open(tmp_path / "run.csv.gz", "wb") as file:
        file.write((tmp_path / "run.csv").read_bytes())
    of_file = torsio.read(tmp_path / "run.csv")[0]
    of_frame = torsio.Recording.from_pandas(frame())
    of_dict = torsio.Recording.from_dict({name: frame()[name].tolist() for name in frame()})
    assert of_file.channels == ["gear_angle_rad", "joint_angle_rad", "torque_Nm"]
    for other in (of_frame, of_dict, torsio.read(str(tmp_path / "run.csv.gz"))[0]):
        assert other.channels == of_file.channels
        assert other.sample_rate_Hz == of_file.sample_rate_Hz
        for channel in of_file.channels:
            np.testing.assert_array_equal(other[channel], of_file[channel])


def test_the_index_can_be_the_clock_and_a_rate_replaces_it():
    by_index = torsio.Recording.from_pandas(frame().set_index("t_s"))
    by_rate = torsio.Recording.from_pandas(frame().drop(columns="t_s"), rate_Hz=1000.0)
    assert by_index.sample_rate_Hz == by_rate.sample_rate_Hz == pytest.approx(1000.0)
    back = by_index.to_pandas()
    assert back.index.name == "t_s"
    np.testing.assert_array_equal(back["torque_Nm"], by_index["torque_Nm"])


def test_a_mapping_names_foreign_columns(tmp_path):
    (tmp_path / "bench.yaml").write_text(
        "channels:\n  gear_angle_rad: {from: q_out, unit: deg}\n  torque_Nm: {from: load, unit: Nm, sign: -1}\n"
    )
    foreign = pd.DataFrame({"t_s": frame()["t_s"], "q_out": frame()["gear_angle_deg"], "load": frame()["torque_Nm"]})
    recording = torsio.Recording.from_pandas(foreign, mapping=tmp_path / "bench.yaml")
    assert recording.channels == ["gear_angle_rad", "torque_Nm"]
    np.testing.assert_array_equal(recording["torque_Nm"], -foreign["load"])


def test_a_channel_is_a_read_only_view_that_outlives_the_name():
    recording = torsio.Recording.from_pandas(frame())
    view = recording["torque_Nm"]
    assert view.base is not None and np.shares_memory(view, recording["torque_Nm"])
    with pytest.raises(ValueError):
        view[0] = 1.0
    expected = view.copy()
    recording.add("oil_K", np.full(len(recording), 300.0))  # more channels move no values
    del recording
    np.testing.assert_array_equal(view, expected)


def test_gaps_in_the_clock_are_refused_with_the_line_that_helps():
    gap = frame().drop(index=range(500, 700))
    with pytest.raises(torsio.Error, match="row 500, t_s: 200 samples are missing"):
        torsio.Recording.from_pandas(gap)


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda f: f.assign(torque_Nm="strong"), "torque_Nm: expected numbers, found 'strong'"),
        (lambda f: f.assign(torque_Nm=pd.Timestamp("2026-01-01")), "torque_Nm: expected numbers"),
        (lambda f: f.assign(torque_Nm=1j), "torque_Nm: expected numbers, found values of type complex128"),
        (lambda f: f.rename(columns={"torque_Nm": "torque"}), "torque"),
        (lambda f: f.rename(columns={"torque_Nm": 7}), "column 7: expected a name"),
        (lambda f: f.iloc[:0], "at least one sample"),
        (lambda f: pd.concat([f, f["torque_Nm"]], axis=1), "torque_Nm occurs twice"),
    ],
)
def test_a_data_frame_that_cannot_be_used_is_refused(change, message):
    with pytest.raises(torsio.Error, match=message):
        torsio.Recording.from_pandas(change(frame()))


def test_other_wrong_calls_are_refused(tmp_path):
    for call, message in [
        (lambda: torsio.Recording.from_pandas([1, 2]), "expected a DataFrame"),
        (lambda: torsio.Recording.from_dict({}), "at least one column"),
        (lambda: torsio.Recording.from_dict({"a_rad": [1.0], "b_rad": [1.0, 2.0]}), "one length"),
        (lambda: torsio.Recording.from_dict({"a_rad": [[1.0]]}), "one value for each sample"),
        (lambda: torsio.read(tmp_path / "no.csv"), "no.csv"),
        (lambda: torsio.read(3), "expected a str or a path, found a int"),
        (lambda: torsio.simulate("dfki-51"), "dfki-5"),
        (lambda: torsio.Recording("x", -1.0), "rate"),
        (lambda: torsio.Dataset(), "at least one recording"),
        (lambda: torsio.Dataset(train=3), "expected Recordings, paths, or lists of them, found a int"),
        (lambda: torsio.simulate("dfki-50", duration_s=2.0)["oil_K"], "oil_K"),
    ]:
        with pytest.raises(ValueError, match=message) as caught:
            call()
        assert isinstance(caught.value, torsio.Error)


def test_missing_samples_are_nan():
    holes = frame()
    holes.loc[100, "torque_Nm"] = np.nan
    assert np.isnan(torsio.Recording.from_pandas(holes)["torque_Nm"][100])
    assert np.isnan(torsio.Recording.from_dict({"t_s": [0.0, 0.1], "torque_Nm": [1.0, None]})["torque_Nm"][1])


def test_a_recording_can_be_pickled(sweep):
    sweep.add_condition("support_m", 0.1) if "support_m" not in sweep else None
    again = pickle.loads(pickle.dumps(sweep))
    assert again.channels == sweep.channels and again.conditions == sweep.conditions
    for channel in sweep.channels:
        np.testing.assert_array_equal(again[channel], sweep[channel])
        np.testing.assert_array_equal(again.fresh(channel), sweep.fresh(channel))
    np.testing.assert_array_equal(again.time_s, sweep.time_s)


def test_the_uncertainty_of_the_torque_is_part_of_the_error_bars(tmp_path, sweep):
    sweep.write_csv(tmp_path / "sweep.csv")
    (tmp_path / "cell.yaml").write_text("uncertainty: {torque_Nm: {gain: 1%, zero: 0.5Nm}}")
    stated = torsio.read(tmp_path / "sweep.csv", mapping=tmp_path / "cell.yaml")[0]
    plain = torsio.fit(sweep, "linear")
    assert plain.target_uncertainty == (0.0, 0.0)
    for recording in (stated, pickle.loads(pickle.dumps(stated))):
        model = torsio.fit(recording, "linear")
        assert model.target_uncertainty == (0.5, 0.01)
        found, without = torsio.estimate(model, sweep), torsio.estimate(plain, sweep)
        np.testing.assert_allclose(
            found.std_dev, np.sqrt(without.std_dev**2 + 0.5**2 + (0.01 * without.value) ** 2), rtol=1e-9
        )
    scores = [torsio.evaluate(each, sweep).together()[0] for each in (model, plain)]
    assert scores[0].mean_std_dev == pytest.approx(scores[1].mean_std_dev)


def test_a_log_of_bam_has_labels(tmp_path):
    entries = [{"timestamp": 0.01 * n, "position": 0.1 * n} for n in range(20)]
    log = {"mass": 0.5, "length": 0.1, "kp": 8, "vin": 12, "motor": "m", "trajectory": "t", "entries": entries}
    (tmp_path / "run.json").write_text(json.dumps(log))
    (recording,) = torsio.read(tmp_path / "run.json")
    assert recording.labels == {"motor": "m", "trajectory": "t"}
    assert pickle.loads(pickle.dumps(recording)).labels == recording.labels


def test_a_recording_is_written_and_read(tmp_path, sweep):
    sweep.write_csv(tmp_path / "sweep.csv")
    again = torsio.read(tmp_path / "sweep.csv")[0]
    for channel in sweep.channels:
        np.testing.assert_array_equal(again[channel], sweep[channel])


def test_equal_simulations_are_equal():
    a = torsio.simulate("dfki-50", "sweep", seed=3, duration_s=2.0)
    b = torsio.simulate("dfki-50", "sweep", seed=3, duration_s=2.0)
    np.testing.assert_array_equal(a["torque_Nm"], b["torque_Nm"])


def test_masked_values_are_not_measured():
    torque = np.ma.masked_array([0.0, 999.0, 2.0, 3.0], mask=[False, True, False, False])
    read = torsio.Recording.from_dict({"torque_Nm": torque}, rate_Hz=1000.0)["torque_Nm"]
    assert np.array_equal(read, [0.0, np.nan, 2.0, 3.0], equal_nan=True)
    recording = torsio.Recording.from_dict({"torque_Nm": torque}, rate_Hz=1000.0)
    recording.add("angle_rad", np.ma.masked_array([1, 2, 3, 4], mask=[True, False, False, False]))
    np.testing.assert_array_equal(recording["angle_rad"], [np.nan, 2.0, 3.0, 4.0])
    with pytest.raises(torsio.UsageError, match="an array of numbers"):
        recording.add("speed_rad_s", "fast")


@pytest.mark.parametrize("kind", [torsio.Model, torsio.Recording, torsio.Dataset, torsio.Estimator, torsio.Estimate])
def test_an_object_that_was_not_initialised_is_an_error(kind):
    with pytest.raises(TypeError, match="not initialised"):
        repr(kind.__new__(kind))


def test_a_batch_that_was_not_initialised_is_an_error():
    with pytest.raises(TypeError, match="not initialised"):
        len(torsio.Batch.__new__(torsio.Batch))


def test_a_recording_that_was_not_closed_is_read_with_a_warning(tmp_path):
    def record(kind, content):
        return bytes([kind]) + len(content).to_bytes(8, "little") + content

    def text(value):
        return len(value).to_bytes(4, "little") + value

    records = record(4, b"\1\0\0\0" + text(b"/t") + text(b"json") + bytes(4))
    for n in range(20):
        stamp = (n * 10_000_000).to_bytes(8, "little")
        records += record(5, b"\1\0" + bytes(4) + 2 * stamp + b'{"q_rad": %d}' % n)
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n" + records)
    with pytest.warns(UserWarning, match="was not closed"):
        assert len(torsio.read(tmp_path / "cut.mcap")[0]) == 20


def test_what_reading_assumed_is_noted(tmp_path):
    (tmp_path / "run.csv").write_text("t [s],torque [Nm]\n0,NA\n1,2\n")
    recording = torsio.read(tmp_path / "run.csv")[0]
    assert recording.channels == ["torque_Nm"]
    assert any("'NA' (1)" in note for note in recording.notes)
    np.savez(tmp_path / "run.npz", t_s=np.arange(3.0), torque_Nm=np.arange(3, dtype=">f2"), z=1j * np.arange(3))
    recording = torsio.read(tmp_path / "run.npz")[0]
    np.testing.assert_array_equal(recording["torque_Nm"], [0.0, 1.0, 2.0])
    assert recording.not_read == ["z (complex numbers, '<c16')"]
