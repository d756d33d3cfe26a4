// The main job as a user types it: simulate, check, fit, evaluate, compare, demo.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class MainJob : public Program {
 protected:
  /// Two short sweeps with a reversal each.
  void record() {
    ASSERT_EQ(
        torsio("simulate dfki-50 sweep --duration 40s --lever 0.24m --seed 1 -o a.csv").exit_code,
        0);
    ASSERT_EQ(
        torsio("simulate dfki-50 sweep --duration 40s --lever 0.17m --seed 2 -o b.csv").exit_code,
        0);
  }
};

TEST_F(MainJob, GoesFromARecordingToADeployedModel) {
  record();
  const Outcome check = torsio("check a.csv --test b.csv --json check.json");
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_EQ(nlohmann::json::parse(contents("check.json")).at("findings").at(0).at("verdict"),
            "PASS");

  const Outcome fit = torsio("fit a.csv --model linear_coulomb -o joint.safetensors");
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  const Outcome evaluate =
      torsio("evaluate joint.safetensors b.csv --predictions out.csv --json -");
  EXPECT_EQ(evaluate.exit_code, 0) << evaluate.err;
  const Outcome description = torsio("evaluate joint.safetensors");
  EXPECT_NE(description.out.find("trained on a.csv"), std::string::npos) << description.out;
  EXPECT_NE(description.out.find("k1 (spring_deflection_rad)"), std::string::npos)
      << description.out;
  const auto model = nlohmann::json::parse(torsio("evaluate joint.safetensors --json -").out);
  EXPECT_NEAR(model.at("parameters").at("coefficients.values").at(1), 573.0, 100.0);
  const auto json = nlohmann::json::parse(evaluate.out);
  EXPECT_EQ(json.at("results").at(0).at("split"), "test");
  EXPECT_LT(json.at("results").at(0).at("rmse"), 2.0);
  EXPECT_EQ(contents("out.csv").substr(0, contents("out.csv").find('\n')),
            "t_s,torque_Nm,torque_fresh_1,estimated_torque_Nm,torque_std_dev_Nm,fault_1");
}

TEST_F(MainJob, StatesWhichErrorOfTheReferenceSensorTheSharesAreWithout) {
  record();
  const auto write_mapping = [&](const std::string& name, const std::string& zero) {
    (void)folder_.file(name, "uncertainty: {torque_Nm: {zero: " + zero + "}}\n");
  };
  write_mapping("bench.yaml", "0.2Nm");
  write_mapping("other.yaml", "0.3Nm");
  ASSERT_EQ(torsio("fit a.csv --mapping bench.yaml --model linear -o m.safetensors").exit_code, 0);
  const std::string same = torsio("evaluate m.safetensors b.csv --mapping bench.yaml").out;
  EXPECT_NE(same.find("without 0.2 Nm "), std::string::npos) << same;
  EXPECT_EQ(same.find("of its sensor"), std::string::npos) << same;
  const std::string differs = torsio("evaluate m.safetensors b.csv --mapping other.yaml").out;
  EXPECT_NE(differs.find("b states 0.3 Nm "), std::string::npos) << differs;
  EXPECT_NE(differs.find("the training 0.2 Nm "), std::string::npos) << differs;
  ASSERT_EQ(torsio("fit a.csv --model linear -o none.safetensors").exit_code, 0);
  const std::string none = torsio("evaluate none.safetensors b.csv --mapping other.yaml").out;
  EXPECT_NE(none.find("of its sensor, the training none"), std::string::npos) << none;
}

TEST_F(MainJob, StatesWhichAbsurdValuesTheFitDidNotUse) {
  record();
  shell("awk -F, -v OFS=, 'NR == 5002 { $3 = 1e12 } 1' a.csv >glitch.csv");
  const std::string header = shell("head -1 glitch.csv | cut -d, -f3 | tr -d '\\n'").out;
  const Outcome fit = torsio("fit glitch.csv --model linear -o joint.safetensors");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_NE(fit.err.find("glitch.csv, sample 5000 (t = 5 s): " + header + " = 1e+12"),
            std::string::npos)
      << fit.err;
  const auto model = nlohmann::json::parse(torsio("evaluate joint.safetensors --json -").out);
  for (const auto& input : model.at("inputs")) EXPECT_LT(input.at("highest"), 100.0);
}

TEST_F(MainJob, RanksEveryFamilyOnHeldOutRecords) {
  record();
  const Outcome compare =
      torsio("compare a.csv --test b.csv -o best.safetensors --json results.json");
  ASSERT_EQ(compare.exit_code, 0) << compare.err;
  for (const char* family : {"linear ", "linear_coulomb", "polynomial", "dgmm ", "dgmm_paper"})
    EXPECT_NE(compare.out.find(family), std::string::npos) << compare.out;
  EXPECT_NE(compare.err.find("families, which --help lists"), std::string::npos) << compare.err;
  EXPECT_EQ(compare.err.find("narx_mlp"), std::string::npos) << "a list: " << compare.err;
  EXPECT_EQ(torsio("evaluate best.safetensors b.csv").exit_code, 0);
}

TEST_F(MainJob, SearchesStructuresWithinTheTrainingRecords) {
  for (const char* run : {"triangles --seed 1 -o a.csv", "triangles --seed 2 -o b.csv",
                          "random-walk --seed 3 -o c.csv"})
    ASSERT_EQ(torsio(std::string("simulate elastomer --duration 6s ") + run).exit_code, 0);
  const Outcome search = torsio(
      "compare a.csv b.csv --test c.csv --models search --inputs spring_deflection_rad --json "
      "s.json -o best.safetensors");
  ASSERT_EQ(search.exit_code, 0) << search.err;
  // What was tried, then the best of each family on the held-out record.
  EXPECT_NE(search.out.find("maxwell_slip[thresholds=16]"), std::string::npos) << search.out;
  EXPECT_NE(search.out.find("held-out (test) errors"), std::string::npos) << search.out;
  const auto json = nlohmann::json::parse(contents("s.json"));
  EXPECT_EQ(json.at("schema_version"), 1);
  const auto& tried = json.at("search").at("summary");
  EXPECT_EQ(json.at("search").at("folds").size(), 3U);
  std::map<std::string, std::string> winner;  // variant by family
  bool is_ranked = true;
  for (const auto& row : tried) {
    const bool is_ok = row.at("status") == "ok";
    EXPECT_TRUE(is_ranked || !is_ok) << "a failure is ranked before " << row;
    is_ranked = is_ok;
    // What a guard replaced in most of a fold is not ranked.
    if (is_ok && row.at("ranked_folds") > 0)
      winner.emplace(row.at("family"), row.at("variant").dump());
  }
  // No input is a rate: its fit fails in each fold with this reason and is not compared.
  EXPECT_FALSE(winner.contains("linear_coulomb"));
  EXPECT_NE(search.out.find("linear_coulomb: failed in 3 of 3 folds"), std::string::npos)
      << search.out;
  for (const char* family : {"viscoelastic", "bouc_wen", "grey_box"})
    EXPECT_TRUE(std::ranges::any_of(tried, [&](const auto& row) {
      return row["family"] == family;
    })) << family;
  std::set<std::string> compared;
  for (const auto& row : json.at("results")) {
    compared.insert(row.at("family"));
    EXPECT_EQ(row.at("variant").dump(), winner.at(row.at("family")));
  }
  EXPECT_EQ(compared.size(), winner.size());
  EXPECT_EQ(torsio("evaluate best.safetensors c.csv").exit_code, 0);
}

TEST_F(MainJob, CrossValidatesWithoutAHeldOutRecording) {
  record();
  const Outcome by_record =
      torsio("crossvalidate a.csv b.csv --by record --models linear --json -");
  ASSERT_EQ(by_record.exit_code, 0) << by_record.err;
  const auto json = nlohmann::json::parse(by_record.out);
  // The fold that holds b out is what fit and evaluate do with the two.
  ASSERT_EQ(torsio("fit a.csv --model linear -o joint.safetensors").exit_code, 0);
  const auto by_hand =
      nlohmann::json::parse(torsio("evaluate joint.safetensors b.csv --json -").out);
  const auto& row = json.at("results").at(2);
  EXPECT_EQ(row.at("fold"), "b");
  EXPECT_EQ(row.at("rmse"), by_hand.at("results").at(0).at("rmse"));

  const Outcome blocks = torsio("crossvalidate a.csv --models linear,polynomial --set rates=true");
  ASSERT_EQ(blocks.exit_code, 0) << blocks.err;
  EXPECT_NE(blocks.out.find("5 contiguous blocks within one recording"), std::string::npos)
      << blocks.out;
  EXPECT_NE(blocks.out.find("polynomial[rates=true]"), std::string::npos) << blocks.out;
}

TEST_F(MainJob, AttributesAModelToItsInputs) {
  record();
  ASSERT_EQ(torsio("fit a.csv --model linear_coulomb -o joint.safetensors").exit_code, 0);
  const Outcome attribute = torsio("attribute joint.safetensors b.csv --json attribution.json");
  ASSERT_EQ(attribute.exit_code, 0) << attribute.err;
  EXPECT_NE(attribute.out.find("Caveat: "), std::string::npos) << attribute.out;
  const auto json = nlohmann::json::parse(contents("attribution.json"));
  EXPECT_NE(json.at("caveat").get<std::string>().find("not what causes"), std::string::npos);
  EXPECT_EQ(json.at("results").at(0).at("input"), "spring_deflection_rad");
  EXPECT_GT(json.at("results").at(0).at("share"), 0.8);
  EXPECT_EQ(json.at("results").at(2).at("mean_abs_shapley"), 0.0) << "the joint speed has no term";
  EXPECT_LT(json.at("additivity_error"), 1e-9);
  EXPECT_EQ(json.at("explained").size(), 200U);
  EXPECT_EQ(torsio("attribute joint.safetensors b.csv --json -").out, contents("attribution.json"));
}

TEST_F(MainJob, AdaptsANetworkToAnotherJoint) {
  const std::string inputs =
      " --inputs 'motor_angle_rad - wave_generator_angle_rad,motor_torque_Nm'";
  for (const char* call : {"#01 human-torque --duration 60s -o first.csv",
                           "#03 human-torque --duration 60s --seed 2 -o third.csv"})
    ASSERT_EQ(torsio(std::string("simulate 'harmonic-drive:soft'") + call).exit_code, 0);
  ASSERT_EQ(torsio("fit first.csv --model gru -o joint.safetensors" + inputs).exit_code, 0);
  const Outcome adapt = torsio(
      "adapt joint.safetensors third.csv -o third.safetensors --device-serial three --json "
      "out.json");
  ASSERT_EQ(adapt.exit_code, 0) << adapt.err;
  for (const char* word : {"as it ran", "held out", "warming_up", "roll-backs"})
    EXPECT_NE(adapt.out.find(word), std::string::npos) << adapt.out;
  const auto json = nlohmann::json::parse(contents("out.json"));
  EXPECT_EQ(json.at("method"), "nlms");
  EXPECT_GT(json.at("updates"), 3000);
  EXPECT_EQ(json.at("outcomes").at("warming_up"), 200);
  const auto& held_out = json.at("held_out").at(0);
  EXPECT_EQ(held_out.at("samples"), 1800);
  EXPECT_LT(held_out.at("adapted").at("rmse"), held_out.at("frozen").at("rmse"));

  const Outcome evaluate = torsio("evaluate third.safetensors third.csv");
  EXPECT_EQ(evaluate.exit_code, 0) << evaluate.err;
  EXPECT_NE(evaluate.err.find("was trained on third"), std::string::npos) << evaluate.err;
  EXPECT_NE(torsio("evaluate third.safetensors").out.find("adapted with "), std::string::npos);
  EXPECT_EQ(adapt.err.find("is worse than the frozen one"), std::string::npos) << adapt.err;
  EXPECT_NE(torsio("adapt joint.safetensors first.csv --set step_size=1.9")
                .err.find("is worse than the frozen one"),
            std::string::npos);
  // Nothing is written unless it is asked for.
  const std::string before = shell("ls -A").out;
  EXPECT_EQ(torsio("adapt joint.safetensors third.csv --method rls").exit_code, 0);
  EXPECT_EQ(shell("ls -A").out, before);
}

TEST_F(MainJob, DemoWritesComparesDocument) {
  record();
  const Outcome compare = torsio("compare a.csv --test b.csv --models linear --json -");
  const Outcome demo = torsio("demo a.csv --test b.csv --models linear --json -");
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  auto theirs = nlohmann::json::parse(compare.out);
  auto ours = nlohmann::json::parse(demo.out);
  for (auto* document : {&theirs, &ours})
    for (auto& row : (*document)["results"])
      for (const char* timing : {"step_ns_p50", "step_ns_p999", "fit_seconds"}) row.erase(timing);
  EXPECT_EQ(ours, theirs);
}

TEST_F(MainJob, DemoShowsTableLoopAndDeployment) {
  record();
  const Outcome demo = torsio("demo a.csv --test b.csv");
  ASSERT_EQ(demo.exit_code, 0) << demo.err;
  for (const char* text : {"best first", "torque_Nm over spring_deflection_rad", "loaded back"})
    EXPECT_NE(demo.out.find(text), std::string::npos) << demo.out;
  EXPECT_FALSE(contents("torsio-demo.safetensors").empty());
}

TEST_F(MainJob, IsReproducible) {
  record();
  ASSERT_EQ(
      torsio("simulate dfki-50 sweep --duration 40s --lever 0.24m --seed 1 -o again.csv").exit_code,
      0);
  EXPECT_EQ(contents("again.csv"), contents("a.csv"));
  ASSERT_EQ(torsio("fit a.csv --model dgmm -o one.safetensors").exit_code, 0);
  ASSERT_EQ(torsio("fit a.csv --model dgmm -o two.safetensors").exit_code, 0);
  EXPECT_EQ(contents("one.safetensors"), contents("two.safetensors"));
}

TEST_F(MainJob, RunsTheExamples) {
  record();
  ASSERT_EQ(torsio("fit a.csv --model dgmm -o joint.safetensors").exit_code, 0);
  const Outcome estimate =
      shell(std::string(TORSIO_EXAMPLES) + "/example_02_estimate_torque joint.safetensors");
  EXPECT_EQ(estimate.exit_code, 0) << estimate.err;
  EXPECT_NE(estimate.out.find("Nm +-"), std::string::npos) << estimate.out;
  ASSERT_EQ(torsio("fit a.csv --model linear --inputs spring_deflection_rad,motor_current_A -o "
                   "current.safetensors")
                .exit_code,
            0);
  const Outcome lacking =
      shell(std::string(TORSIO_EXAMPLES) + "/example_02_estimate_torque current.safetensors");
  EXPECT_EQ(lacking.out, "t = 0.000 s: fault input_not_finite\n") << "the fault is reported once";
  const Outcome control =
      shell(std::string(TORSIO_EXAMPLES) + "/example_06_control_torque joint.safetensors");
  EXPECT_EQ(control.exit_code, 0) << control.err;
  EXPECT_NE(control.out.find("phase margin 61 degrees"), std::string::npos) << control.out;
  const Outcome margins = shell(std::string(TORSIO_EXAMPLES) + "/example_05_choose_loop_gains");
  EXPECT_EQ(margins.exit_code, 0) << margins.err;
  EXPECT_NE(margins.out.find("dfki-300"), std::string::npos) << margins.out;
  const Outcome fast = shell(std::string(TORSIO_EXAMPLES) + "/example_05_choose_loop_gains 200");
  EXPECT_EQ(fast.exit_code, 1) << fast.out;
  EXPECT_NE(fast.err.find("unstable with its output locked"), std::string::npos) << fast.err;
  const Outcome limits = shell(std::string(TORSIO_EXAMPLES) + "/example_07_limit_and_stop_joint");
  EXPECT_EQ(limits.exit_code, 0) << limits.err;
  EXPECT_NE(limits.out.find("limit position, stop running"), std::string::npos);
  EXPECT_NE(limits.out.find("stop off, at rest: yes"), std::string::npos) << limits.out;
  const Outcome monitored =
      shell(std::string(TORSIO_EXAMPLES) + "/example_09_monitor_two_estimates");
  EXPECT_EQ(monitored.exit_code, 0) << monitored.err;
  EXPECT_NE(monitored.out.find("monitor watching, brake open"), std::string::npos);
  EXPECT_NE(monitored.out.find("monitor stopped, brake closed"), std::string::npos);
  EXPECT_NE(monitored.out.find("the torques of spring and current differ by"), std::string::npos)
      << monitored.out;
  const Outcome own = shell(std::string(TORSIO_EXAMPLES) + "/example_11_estimate_with_own_model");
  EXPECT_EQ(own.exit_code, 0) << own.err;
  EXPECT_NE(own.out.find("outside_training_range"), std::string::npos) << own.out;
  EXPECT_NE(own.out.find("input_not_finite"), std::string::npos) << own.out;
  ASSERT_EQ(torsio("fit a.csv --model mlp -o network.safetensors").exit_code, 0);
  const Outcome adapt =
      shell(std::string(TORSIO_EXAMPLES) +
            "/example_10_adapt_to_load_cell network.safetensors adapted.safetensors");
  EXPECT_EQ(adapt.exit_code, 0) << adapt.err;
  EXPECT_NE(adapt.out.find(" updates"), std::string::npos) << adapt.out;
  EXPECT_EQ(torsio("evaluate adapted.safetensors b.csv").exit_code, 0);
}

TEST_F(MainJob, RunsFromCodeWhatTheProgramDoes) {
  record();
  const std::string example = std::string(TORSIO_EXAMPLES) + "/example_01_fit_model";
  const Outcome fit = shell(example + " b.csv code.safetensors a.csv");
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_NE(fit.out.find("Nm on "), std::string::npos) << fit.out;
  ASSERT_EQ(torsio("fit a.csv --model grey_box --set passive=true --seed 1 -o program.safetensors")
                .exit_code,
            0);
  const auto rmse = [&](const std::string& model) {
    const Outcome outcome = torsio("evaluate " + model + " b.csv --json -");
    return nlohmann::json::parse(outcome.out).at("results").at(0).at("rmse");
  };
  EXPECT_EQ(rmse("code.safetensors"), rmse("program.safetensors"));
  EXPECT_EQ(shell(example).exit_code, 2);
  const Outcome missing = shell(example + " none.csv x.safetensors a.csv");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("none.csv"), std::string::npos) << missing.err;
}

TEST_F(MainJob, WritesADescriptionOfTheSimulationAsJson) {
  const Outcome outcome = torsio("simulate dfki-28 sweep --duration 2s -o a.csv --json -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("samples"), 2000);
  const auto list = nlohmann::json::parse(torsio("simulate --list --json -").out);
  EXPECT_EQ(list.at("actuators").size(), 7U);
  EXPECT_EQ(list.at("actuators").at(1).at("variants").size(), 3U);
  const auto sheet =
      nlohmann::json::parse(torsio("simulate --describe dfki-50:bouc-wen#03 --json -").out);
  EXPECT_EQ(sheet.at("name"), "dfki-50:bouc-wen#03");
  EXPECT_EQ(sheet.at("variant"), "bouc-wen");
  EXPECT_EQ(sheet.at("printed_facts").at(2).at("name"), "mass");
  EXPECT_EQ(sheet.at("printed_facts").at(2).at("value"), 2.5);
  EXPECT_NE(torsio("simulate --describe harmonic-drive").out.find("printed, not used"),
            std::string::npos);
  EXPECT_GT(sheet.at("longest_step_s"), 1e-5);
  EXPECT_LT(sheet.at("natural_frequencies_Hz").at(0), sheet.at("natural_frequencies_Hz").at(1));
}

TEST_F(MainJob, SaysWhatToTrainASpringOfOtherChannelsOn) {
  for (const char* bench : {"rubber-clutch multisine", "harmonic-drive:soft human-torque",
                            "harmonic-drive:rigid human-torque"}) {
    const Outcome simulated =
        torsio("simulate " + std::string(bench) + " --duration 20s -o other.csv");
    ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
    const std::size_t inputs = simulated.err.find("--inputs '");
    ASSERT_NE(inputs, std::string::npos) << simulated.err;
    const std::string flag =
        simulated.err.substr(inputs, simulated.err.find('\n', inputs) - inputs);
    EXPECT_EQ(torsio("fit other.csv --model linear -o m.safetensors " + flag).exit_code, 0) << flag;
    EXPECT_NE(torsio("simulate --list").out.find("with --inputs '"), std::string::npos);
  }
}

TEST_F(MainJob, RecordsAnActuatorThatFailsAndWears) {
  folder_.file("faults.yaml",
               "faults:\n"
               "  - {sensor: gear_angle_rad, fault: nan, at: 500ms, for: 100ms}\n"
               "  - {sensor: joint_angle_rad, fault: dropout, at: 1s}\n"
               "  - {part: friction, fault: drift, at: 0s, to: 1.3, over: 2s}\n");
  const std::string call = "simulate dfki-50 sweep --duration 2s ";
  const Outcome outcome = torsio(
      call + "--faults faults.yaml --temperature 40degC --warm-up 10K --age 0.5 -o a.csv --json -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("faults"), 3);
  EXPECT_EQ(json.at("conditions").at("temperature_K"), 313.15);
  EXPECT_NE(contents("a.csv").find("joint_angle_fresh_1"), std::string::npos);
  EXPECT_NE(contents("a.csv").find(",nan,"), std::string::npos);
  // Options with their default values change nothing.
  ASSERT_EQ(torsio(call + "-o b.csv").exit_code, 0);
  ASSERT_EQ(torsio(call + "--temperature 25degC --warm-up 0K --age 0 -o c.csv").exit_code, 0);
  EXPECT_EQ(contents("c.csv"), contents("b.csv"));
}

TEST_F(MainJob, WritesItsDocumentIntoDevicesAndPipes) {
  const std::string call = "{torsio} simulate dfki-50 sweep --duration 1s -o a.csv --json ";
  for (const std::string& to :
       {call + "/dev/stdout", call + "/dev/stdout | cat", call + "/dev/fd/3 3>&1 | cat",
        "mkfifo pipe; cat pipe & " + call + "pipe; wait"}) {
    const Outcome outcome = shell(to);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    ASSERT_TRUE(nlohmann::json::accept(outcome.out)) << to << "\n" << outcome.out << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("samples"), 1000);
  }
  EXPECT_EQ(shell(call + "/dev/null").exit_code, 0);
  EXPECT_EQ(shell(call + "/dev/full").exit_code, 1);
}

TEST_F(MainJob, DrawsTheLoopOfEveryFamily) {
  for (const char* call : {"dfki-50:lugre#07 sweep", "elastomer triangles", "rubber-clutch slip",
                           "harmonic-drive:soft human-torque"}) {
    const Outcome outcome =
        torsio(std::string("simulate ") + call + " --duration 2s -o a.csv --plot loop.svg");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(contents("loop.svg").find("deflection [deg]"), std::string::npos) << call;
  }
}

TEST_F(MainJob, WritesAPageForTheBrowser) {
  record();
  ASSERT_EQ(torsio("compare a.csv --test b.csv --models linear --report out.html").exit_code, 0);
  EXPECT_NE(contents("out.html").find("<h2>Models on the test recordings"), std::string::npos);
  EXPECT_NE(contents("out.html").find("torsio compare a.csv --test b.csv"), std::string::npos);
}

TEST_F(MainJob, ListsAndDescribes) {
  EXPECT_NE(torsio("simulate --list").out.find("dfki-300"), std::string::npos);
  EXPECT_NE(torsio("simulate --describe dfki-50").out.find("gear_ratio"), std::string::npos);
  EXPECT_NE(torsio("fit --list").out.find("dgmm"), std::string::npos);
  EXPECT_EQ(torsio("--help").exit_code, 0);
  for (const char* verb : {"demo", "simulate", "check", "fit", "evaluate", "compare",
                           "crossvalidate", "attribute", "import"})
    EXPECT_NE(torsio(std::string(verb) + " --help").out.find("Example"), std::string::npos) << verb;
}

TEST_F(MainJob, ImportsANetworkOfAnotherProgram) {
  record();
  const std::string golden = std::string(TORSIO_SOURCE) + "/tests/golden/import/";
  const std::string call = "import '" + golden +
                           "weights_lstm.json' --rate 100Hz --inputs \"gear_angle_rad - "
                           "joint_angle_rad, rate(joint_angle_rad)\" ";
  const Outcome import = torsio(call + "-o joint.safetensors --json model.json");
  ASSERT_EQ(import.exit_code, 0) << import.err;
  EXPECT_NE(import.err.find("there is no range guard"), std::string::npos) << import.err;
  const auto model = nlohmann::json::parse(contents("model.json"));
  EXPECT_EQ(model.at("sample_rate_Hz"), 100.0);
  EXPECT_EQ(model.at("parameters").at("scaling.target_scale").at(0), 20.0);
  EXPECT_EQ(torsio("evaluate joint.safetensors a.csv --rate 100Hz").exit_code, 0);
  EXPECT_EQ(torsio("evaluate joint.safetensors a.csv").exit_code, 1) << "at 1 kHz";

  const Outcome guarded =
      torsio(call + "--guards a.csv -o guarded.safetensors --json guarded.json");
  ASSERT_EQ(guarded.exit_code, 0) << guarded.err;
  EXPECT_EQ(guarded.err.find("there is no range guard"), std::string::npos) << guarded.err;
  const double highest =
      nlohmann::json::parse(contents("guarded.json")).at("inputs").at(0).at("highest");
  EXPECT_GT(highest, 0.01);
  EXPECT_LT(highest, 0.1);
}

TEST_F(MainJob, AStoppedFitOfANetworkGoesOnWhereItWas) {
  record();
  const std::string fit =
      "fit a.csv --model lstm --set layers=8 --set stride=10 --set epochs=60 --set patience=0 "
      "--set batch=16";
  ASSERT_EQ(torsio(fit + " -o whole.safetensors").exit_code, 0);
  // Stopped at once, after a while, and after a longer while: wherever that is.
  const std::string stop = "timeout --foreground --preserve-status -s INT ";
  Outcome stopped;
  for (const char* seconds : {"0.2", "0.4", "0.8", "1.6"}) {
    stopped = shell(stop + seconds + " {torsio} " + fit + " -o part.safetensors");
    if (stopped.exit_code != 0 && !contents("part.safetensors.checkpoint").empty()) break;
  }
  if (stopped.exit_code == 0) GTEST_SKIP() << "the fit was over before it could be stopped";
  EXPECT_NE(stopped.err.find("part.safetensors.checkpoint"), std::string::npos) << stopped.err;
  EXPECT_TRUE(contents("part.safetensors").empty());

  EXPECT_EQ(torsio(fit + " --seed 9 --resume -o part.safetensors").exit_code, 2);
  EXPECT_EQ(torsio("fit a.csv --model linear --resume -o part.safetensors").exit_code, 2);
  const Outcome resumed = torsio(fit + " --resume -o part.safetensors");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(contents("part.safetensors"), contents("whole.safetensors"));
  EXPECT_TRUE(contents("part.safetensors.checkpoint").empty());
}

}  // namespace
}  // namespace torsio::test
