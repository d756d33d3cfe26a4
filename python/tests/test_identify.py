import json
import xml.etree.ElementTree

import numpy as np
import pytest

import torsio


def chirp(seed: int) -> torsio.Recording:
    return torsio.simulate("dfki-50", "air-chirp", seed=seed, duration_s=8.0, lever_m=0.2, mass_kg=9.0)


@pytest.fixture(scope="module")
def chirps() -> list[torsio.Recording]:
    return [chirp(seed) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def identified(chirps, pendulum_file) -> torsio.IdentifiedDrive:
    return torsio.identify(chirps, load=pendulum_file, terms=["load_friction"], starts=1)


def test_parameters_have_errors_and_intervals(identified):
    armature = identified.parameters["armature_kg_m2"]
    assert armature.value > 0.1
    assert armature.lowest_95 < armature.value < armature.highest_95
    assert armature.standard_error > 0.0
    assert identified.terms == ["load_friction"]
    assert identified.mae_rad < 0.05
    assert np.isfinite(identified.held_out_mae_rad) and np.isnan(identified.nested_mae_rad)
    assert len(identified.recordings) == 3 and len({row["group"] for row in identified.recordings}) == 3
    assert identified.advice and "standard_error_ratio" in identified.advice[0]
    assert "armature_kg_m2" in str(identified) and "<table>" in identified._repr_html_()


def test_a_recording_without_a_repeat_is_remarked(chirps, pendulum_file):
    alone = torsio.identify(chirps[0], load=pendulum_file, terms=[], starts=1)
    remarks = {row["subject"]: row for row in alone.findings}
    assert remarks["recordings"]["status"] == "WARN"
    assert np.isnan(alone.parameters["armature_kg_m2"].standard_error)


def test_a_free_run_has_the_error_that_is_stated(identified, chirps):
    run = identified.simulate(chirps[1])
    assert run["angle_rad"].shape == (len(chirps[1]),)
    error = np.mean(np.abs(run["angle_rad"] - run["measured_rad"]))
    assert error == pytest.approx(identified.recordings[1]["mae_rad"], rel=1e-9)
    assert np.max(np.abs(run["joint_torque_Nm"])) > 1.0


def test_a_saved_drive_is_evaluated_without_a_fit(identified, chirps, tmp_path):
    path = tmp_path / "joint.json"
    identified.save(path)
    assert json.loads(path.read_text()) == json.loads(identified.to_json())
    again = torsio.read_drive(path).evaluate(chirps)
    assert again.mae_rad == pytest.approx(identified.mae_rad, rel=1e-9)
    heavy = tmp_path / "heavy.yaml"
    heavy.write_text("load: {pendulum: {mass: 30kg, length: lever_m}}\n")
    assert torsio.read_drive(path).evaluate(chirps, load=heavy).mae_rad > 1.3 * identified.mae_rad
    with pytest.raises(torsio.UsageError, match="needs recordings="):
        torsio.read_drive(path).write("mjcf", tmp_path / "joint.xml")


def test_a_file_for_another_program_is_written(identified, tmp_path):
    path = tmp_path / "joint.xml"
    error_rad = identified.write("mjcf", path, name="elbow", starts=1)
    assert f"{error_rad:.5f} rad" in path.read_text()
    with pytest.raises(torsio.UsageError, match="bam, mjcf or isaaclab"):
        identified.write("gazebo", path)
    with pytest.raises(torsio.UsageError, match="kp_1"):
        identified.write("mjcf", path, group_by="kp_1")


def test_a_comment_of_xml_has_any_name_of_a_recording(identified, chirps, tmp_path):
    chirps[0].write_csv(tmp_path / "air--one---.csv")
    path = tmp_path / "joint.xml"
    identified.write("mjcf", path, recordings=tmp_path / "air--one---.csv", starts=1)
    assert "air- -one" in path.read_text()
    assert xml.etree.ElementTree.parse(path).getroot().tag == "mujoco"


def test_mistakes_are_named(chirps, pendulum_file, tmp_path):
    with pytest.raises(torsio.UsageError, match="load_friction"):
        torsio.identify(chirps, load=pendulum_file, terms="delai")
    with pytest.raises(torsio.UsageError, match="recordings"):
        torsio.identify([], load=pendulum_file)
    with pytest.raises(torsio.UsageError, match="found a int"):
        torsio.identify([3], load=pendulum_file)
    broken = tmp_path / "broken.json"
    broken.write_text("{}")
    with pytest.raises(torsio.Error, match="drive_format"):
        torsio.read_drive(broken)
