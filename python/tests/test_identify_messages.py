"""What `identify` and its result refuse, by name, with what they expect."""

import pytest

import torsio


@pytest.fixture(scope="module")
def chirp() -> torsio.Recording:
    return torsio.simulate("dfki-50", "air-chirp", seed=1, duration_s=4.0, lever_m=0.2, mass_kg=9.0)


@pytest.fixture(scope="module")
def identified(chirp, pendulum_file) -> torsio.IdentifiedDrive:
    return torsio.identify(chirp, load=pendulum_file, terms=[], starts=1)


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ({"load": 5}, "load: expected a load file .*a str or a path, found int"),
        ({"load": None}, "load: expected .* found None"),
        ({"drive": 5}, "drive: expected a drive file .* found int"),
        ({"terms": 5}, 'terms: expected "auto" or names.* found int'),
        ({"terms": [5]}, 'terms: expected "auto" or names.* found int'),
        ({"group_by": 5}, "group_by: expected a str, found int"),
        ({"starts": 2.5}, "starts: expected a whole number from 1, found float"),
        ({"starts": -1}, "starts: expected a whole number from 1, found -1"),
        ({"seed": "one"}, "seed: expected a whole number from 0, found str"),
        ({"spring": "no"}, "spring: expected True or False, found str"),
    ],
)
def test_an_argument_of_another_type_is_named(chirp, pendulum_file, argument, message):
    with pytest.raises(torsio.UsageError, match=message):
        torsio.identify(chirp, **{"load": pendulum_file, **argument})


def test_the_result_names_an_argument_of_another_type(identified, chirp, tmp_path):
    with pytest.raises(torsio.UsageError, match="expected one Recording, such as an item of the list of torsio.read"):
        identified.simulate([chirp])
    with pytest.raises(torsio.UsageError, match="target: expected bam, mjcf or isaaclab, found int"):
        identified.write(5, tmp_path / "a.xml")
    with pytest.raises(torsio.UsageError, match="name: expected a str, found int"):
        identified.write("mjcf", tmp_path / "a.xml", name=5)
    with pytest.raises(torsio.UsageError, match="load: expected"):
        identified.evaluate(chirp, load=5)


def test_a_verdict_needs_standard_errors(identified):
    assert identified.parameters["armature_kg_m2"].is_determined is None
    assert "it is not known which parameters" in str(identified)


def test_a_file_is_given_a_condition(chirp, tmp_path):
    chirp.write_csv(tmp_path / "run.csv")
    [log] = torsio.read(tmp_path / "run.csv")
    log.add_condition("kp_1", 200)
    assert "kp_1" in log.conditions
    with pytest.raises(torsio.UsageError, match="kp_2_1: expected a number, found a str"):
        log.add_condition("kp_2_1", "high")
    with pytest.raises(torsio.UsageError, match="expected a name with its unit"):
        log.add_condition(5, 200.0)
