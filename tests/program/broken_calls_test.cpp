// Bad calls and bad input through the program: a clear message, the right exit code, nothing
// half-written.
#include <sys/stat.h>

#include <csignal>
#include <utility>

#include "program/program.hpp"

namespace torsio::test {
namespace {

constexpr int kInterrupted = 128 + SIGINT;

class BrokenCalls : public Program {
 protected:
  void record() {
    ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 40s -o a.csv").exit_code, 0);
  }

  void expect_error(const Outcome& outcome, int exit_code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(BrokenCalls, OfTheCommandLineExitWithTwo) {
  EXPECT_EQ(torsio("").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("frobnicate").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("demo --colour red").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("simulate").exit_code, kCallWasWrong);
  expect_error(torsio("simulate dfki-51 sweep -o x.csv"), kCallWasWrong, "dfki-50");
  expect_error(torsio("simulate dfki-50 swoop -o x.csv"), kCallWasWrong, "sweep");
  expect_error(torsio("simulate dfki-50 sweep --duration 3Nm -o x.csv"), kCallWasWrong,
               "--duration");
  EXPECT_EQ(torsio("check").exit_code, kCallWasWrong);
}

TEST_F(BrokenCalls, HaveAQuantityWithoutItsUnit) {
  expect_error(torsio("simulate dfki-50 sweep --lever 0.17 -o x.csv"), kCallWasWrong,
               "Write 0.17m if that is meant");
  expect_error(torsio("simulate dfki-50 sweep --duration 10 -o x.csv"), kCallWasWrong, "10s");
  expect_error(torsio("track --duration 10"), kCallWasWrong, "10s");
  expect_error(torsio("design rubber-spring --torque 0.5 --angle 15deg"), kCallWasWrong, "0.5Nm");
  expect_error(torsio("monitor --actuator dfki-50 --inject gear_angle=1@2s"), kCallWasWrong,
               "1rad");
}

TEST_F(BrokenCalls, NameTheNearestOfWhatThereIs) {
  const auto suggests = [this](const std::string& call, const std::string& right) {
    expect_error(torsio(call), kCallWasWrong, "Did you mean '" + right + "'?");
  };
  suggests("fitt a.csv", "fit");
  suggests("train a.csv", "fit");
  expect_error(torsio("attribute -o rows.json"), kCallWasWrong,
               "torsio: attribute: there is no option '-o'");
  suggests("fit a.csv --modle linear -o m.safetensors", "--model");
  suggests("simulate dfki50 sweep -o a.csv", "dfki-50");
  suggests("simulate dfki-50:bouc-wenn sweep -o a.csv", "bouc-wen");
  suggests("simulate dfki-50 swep -o a.csv", "sweep");
  suggests("reproduce 001-model", "001-models");
  suggests("track --reference chrip", "chirp");
  record();
  suggests("fit a.csv --model polynomial --set degre=3 -o m.safetensors", "degree");
}

TEST_F(BrokenCalls, OfFitNameOnlyWhatIsMissing) {
  expect_error(torsio("fit a.csv --model linear"), kCallWasWrong, "torsio fit: -o FILE missing");
  expect_error(torsio("fit a.csv --model linear --set degree 3"), kCallWasWrong,
               "expected option=value in one word");
}

TEST_F(BrokenCalls, OfImportLeaveTheirOutputAlone) {
  const std::string weights =
      "import '" + std::string(TORSIO_SOURCE) + "/tests/golden/import/weights_mlp.json' ";
  folder_.file("m.safetensors", "old");
  const std::string to = "-o m.safetensors --rate 100Hz ";
  expect_error(torsio(weights + "-o m.safetensors"), kCallWasWrong, "--inputs, --rate and -o");
  expect_error(torsio(weights + to + "--inputs a_rad,b_rad"), kCallWasWrong, "--activation");
  const std::string call = weights + to + "--activation softsign ";
  expect_error(torsio(call + "--inputs a_rad,b_rad"), kCallWasWrong, "--inputs: expected 3");
  expect_error(torsio(weights + to + "--inputs a_rad,b_rad,c_rad --activation sine"), kCallWasWrong,
               "softsign");
  const std::string good = call + "--inputs a_rad,b_rad,c_rad ";
  expect_error(torsio(good + "--input-scale 1,2"), kCallWasWrong, "--input-scale: expected 3");
  expect_error(torsio(good + "--output-scale 0"), kCallWasWrong, "--output-scale");
  expect_error(torsio(good + "--target torque"), kWorkFailed, "unit");
  expect_error(torsio(good + "--output-name y"), kCallWasWrong, "--output-name");
  folder_.file("net.json", R"({"tensors": {"a.weight": {"shape": [1, 1], "data": [)");
  expect_error(torsio("import net.json " + to + "--inputs a_rad"), kWorkFailed, "net.json");
  folder_.file("net.onnx", "\x08\x07");
  expect_error(torsio("import net.onnx " + to + "--inputs a_rad"), kWorkFailed, "net.onnx");
  expect_error(torsio("import m.safetensors " + to + "--inputs a_rad"), kCallWasWrong,
               "would replace a file that is read");
  EXPECT_EQ(contents("m.safetensors"), "old");
}

TEST_F(BrokenCalls, WithAnOutputThatAManifestReadsLeaveTheRecordingAlone) {
  const std::string csv = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n0,0,0,0\n0.001,0,0,0\n";
  folder_.file("sweep.csv", csv);
  folder_.file("units.yaml", "{}\n");
  folder_.file("bench.yaml", "mapping: units.yaml\nfiles:\n  - {file: sweep.csv, role: train}\n");
  for (const char* output : {"sweep.csv", "./sweep.csv", "units.yaml"}) {
    expect_error(torsio("fit bench.yaml --model linear -o " + std::string(output)), kCallWasWrong,
                 "would replace a file that is read");
    expect_error(torsio("check bench.yaml --json " + std::string(output)), kCallWasWrong,
                 "would replace a file that is read");
  }
  EXPECT_EQ(contents("sweep.csv"), csv);
  EXPECT_EQ(contents("units.yaml"), "{}\n");
}

TEST_F(BrokenCalls, WithASeedThatIsNoneAreRefusedByEveryVerb) {
  for (const char* seed : {"-1", "18446744073709551616", "1.5", "one"})
    for (const char* call :
         {"simulate dfki-50 sweep -o x.csv", "demo", "fit a.csv --model linear -o m.safetensors",
          "compare a.csv --test b.csv"})
      expect_error(torsio(std::string(call) + " --seed " + seed), kCallWasWrong,
                   "--seed: expected a whole number from 0 to 18446744073709551615, found '" +
                       std::string(seed) + "'");
}

TEST_F(BrokenCalls, WithABadFaultScheduleFailBeforeTheRun) {
  const std::string call = "simulate dfki-50 sweep --duration 4s -o x.csv --faults faults.yaml";
  expect_error(torsio(call), kCallWasWrong, "faults.yaml: cannot be opened");
  folder_.file("faults.yaml", "faults:\n  - {sensor: gear_angel_rad, fault: freeze, at: 1s}\n");
  expect_error(torsio(call), kCallWasWrong, "faults.yaml: line 2 (faults[0].sensor)");
  folder_.file("faults.yaml", "faults:\n  - {sensor: gear_angle_rad, fault: freeze, at: 5s}\n");
  expect_error(torsio(call), kCallWasWrong, "a time within the run, before 4 s");
  expect_error(torsio("simulate dfki-50 sweep -o faults.yaml --faults faults.yaml"), kCallWasWrong,
               "would replace a file that is read");
  EXPECT_EQ(contents("x.csv"), "");
}

TEST_F(BrokenCalls, WithConditionsOutOfRangeNameTheRange) {
  const std::string call = "simulate dfki-50 sweep --duration 1s -o x.csv ";
  expect_error(torsio(call + "--temperature 200degC"), kCallWasWrong, "-40 to 85 degC");
  expect_error(torsio(call + "--temperature 40Nm"), kCallWasWrong, "--temperature: expected");
  expect_error(torsio(call + "--warm-up 100K"), kCallWasWrong, "temperature after the warm-up");
  expect_error(torsio(call + "--warm-up-time 0s"), kCallWasWrong,
               "warm-up time: expected at least");
  expect_error(torsio(call + "--age 2"), kCallWasWrong, "age: expected 0 to 1, found 2");
}

TEST_F(BrokenCalls, NameTheFileThatIsMissing) {
  for (const char* call :
       {"check nowhere.csv", "fit nowhere.csv --model linear -o m.safetensors",
        "compare nowhere.csv --test nowhere.csv", "evaluate nowhere.safetensors a.csv"}) {
    const Outcome outcome = torsio(call);
    EXPECT_NE(outcome.exit_code, 0) << call;
    EXPECT_NE(outcome.err.find("nowhere"), std::string::npos) << outcome.err;
  }
}

TEST_F(BrokenCalls, LeaveTheOutputUntouchedWhenTheFitFails) {
  record();
  folder_.file("m.safetensors", "precious");
  expect_error(torsio("fit a.csv --model linaer -o m.safetensors"), kCallWasWrong, "linear");
  expect_error(torsio("fit a.csv --model dgmm --set components=0 -o m.safetensors"), kCallWasWrong,
               "components");
  expect_error(torsio("fit a.csv --model dgmm --set components -o m.safetensors"), kCallWasWrong,
               "option=value");
  expect_error(torsio("fit a.csv --model dgmm --set components 3 -o m.safetensors"), kCallWasWrong,
               "in one word");
  expect_error(torsio("fit a.csv --model linear --inputs nothing_rad -o m.safetensors"),
               kCallWasWrong, "nothing_rad");
  expect_error(torsio("fit a.csv --model linear --inputs 'foo(' -o m.safetensors"), kCallWasWrong,
               "expected a function");
  expect_error(torsio("fit a.csv --model linear --target force_N -o m.safetensors"), kWorkFailed,
               "force_N");
  EXPECT_EQ(contents("m.safetensors"), "precious");
}

TEST_F(BrokenCalls, OfCrossValidationSayWhatFoldsThereCanBe) {
  record();
  const std::string call = "crossvalidate a.csv --models linear ";
  expect_error(torsio(call + "--by support_m"), kCallWasWrong, "no channel is constant");
  expect_error(torsio(call + "--by record"), kCallWasWrong, "at least two recordings");
  expect_error(torsio(call + "--by record --folds 3"), kCallWasWrong, "excludes");
  expect_error(torsio(call + "--folds 1"), kCallWasWrong, "at least 2");
  expect_error(torsio(call + "--folds 1000000"), kCallWasWrong, "at most 40000");
  expect_error(torsio(call + "--embargo 100s"), kCallWasWrong, "shorter --embargo");
  expect_error(torsio(call + "--embargo 3Nm"), kCallWasWrong, "--embargo");
  expect_error(torsio(call + "--set components=3"), kCallWasWrong, "components");
  expect_error(torsio("crossvalidate a.csv --set rates=true"), kCallWasWrong, "--models");
  expect_error(torsio("crossvalidate a.csv a.csv"), kCallWasWrong, "given twice");
  expect_error(torsio("crossvalidate"), kCallWasWrong, "at least one recording");
  expect_error(torsio(call + "--json no/such/folder/x.json"), kCallWasWrong, "no/such/folder");
}

TEST_F(BrokenCalls, OfAttributionSayWhatIsMissing) {
  record();
  ASSERT_EQ(torsio("fit a.csv --model polynomial -o m.safetensors").exit_code, 0);
  const std::string call = "attribute m.safetensors ";
  expect_error(torsio("attribute"), kCallWasWrong, "MODEL");
  expect_error(torsio("attribute m.safetensors"), kCallWasWrong, "at least one recording");
  expect_error(torsio("attribute nowhere.safetensors a.csv"), kWorkFailed, "nowhere");
  expect_error(torsio(call + "a.csv --windows 0"), kCallWasWrong, "--windows");
  expect_error(torsio(call + "a.csv --window 0s"), kCallWasWrong, "--window");
  expect_error(torsio(call + "a.csv --window 3Nm"), kCallWasWrong, "--window");
  expect_error(torsio(call + "a.csv --window 100s"), kWorkFailed, "shorter window");
  expect_error(torsio(call + "a.csv --json m.safetensors"), kCallWasWrong, "replace");
  folder_.file("b.csv", "t_s,torque_Nm\n0,1\n0.001,2\n0.002,3\n");
  expect_error(torsio(call + "b.csv"), kWorkFailed, "gear_angle_rad");
  expect_error(shell("timeout --foreground --signal=INT --preserve-status 2 {torsio} " + call +
                     "a.csv --windows 20000 --background 2000 --window 0.1s --json x.json"),
               kInterrupted, "stopped on request");
  EXPECT_EQ(contents("x.json"), "");
}

TEST_F(BrokenCalls, OfAdaptationSayWhatIsMissingAndLeaveTheOutputUntouched) {
  record();
  ASSERT_EQ(
      torsio("fit a.csv --model mlp --set layers=8 --set epochs=1 -o m.safetensors").exit_code, 0);
  ASSERT_EQ(torsio("fit a.csv --model linear -o linear.safetensors").exit_code, 0);
  folder_.file("old.safetensors", "precious");
  const auto files = [this] { return shell("ls -A").out; };
  const std::string before = files();
  const std::string call = "adapt m.safetensors a.csv -o old.safetensors ";
  expect_error(torsio("adapt"), kCallWasWrong, "MODEL");
  expect_error(torsio("adapt m.safetensors"), kCallWasWrong, "at least one recording");
  expect_error(torsio("adapt linear.safetensors a.csv -o old.safetensors"), kCallWasWrong,
               "expected a single network (mlp, lstm, gru), a dgmm or a grey_box, found linear");
  expect_error(torsio("adapt nowhere.safetensors a.csv"), kWorkFailed, "nowhere");
  expect_error(torsio("adapt m.safetensors nowhere.csv"), kWorkFailed, "nowhere");
  expect_error(torsio(call + "--method lms"), kCallWasWrong, "auto, nlms, rls or em");
  expect_error(torsio(call + "--set step_size=2"), kCallWasWrong, "option step_size");
  expect_error(torsio(call + "--set mu=1"), kCallWasWrong, "one of step_size");
  expect_error(torsio(call + "--set step_size"), kCallWasWrong, "option=value");
  expect_error(torsio(call + "--held-out 1"), kCallWasWrong, "a share between 0 and 1");
  expect_error(torsio(call + "--held-out 0.2 --test b.csv"), kCallWasWrong, "excludes");
  expect_error(torsio(call + "--test a.csv"), kCallWasWrong,
               "used for training and for the scores");
  expect_error(torsio(call + "--embargo 3Nm"), kCallWasWrong, "--embargo");
  expect_error(torsio(call + "--embargo 100s"), kWorkFailed, "Give longer recordings");
  expect_error(torsio(call + "--json old.safetensors"), kCallWasWrong, "two outputs");
  expect_error(torsio("adapt m.safetensors a.csv -o m.safetensors"), kCallWasWrong, "replace");
  expect_error(torsio("adapt m.safetensors a.csv -o a.csv"), kCallWasWrong, "replace");
  expect_error(torsio("adapt m.safetensors a.csv -o no/such/m.safetensors"), kCallWasWrong,
               "no/such");
  expect_error(torsio("adapt m.safetensors a.csv -o /dev/full"), kCallWasWrong, "/dev/full");
  expect_error(shell("ulimit -f 1; {torsio} " + call + ">/dev/null"), kWorkFailed,
               "old.safetensors: cannot write: File too large");
  EXPECT_EQ(files(), before);
  EXPECT_EQ(contents("old.safetensors"), "precious");
}

TEST_F(BrokenCalls, OfAdaptationNameWhatARecordingLacks) {
  record();
  ASSERT_EQ(
      torsio("fit a.csv --model mlp --set layers=8 --set epochs=1 -o m.safetensors").exit_code, 0);
  const std::string call = "adapt m.safetensors b.csv --embargo 0s";
  folder_.file("b.csv", "t_s,torque_Nm\n0,1\n0.001,2\n0.002,3\n0.003,3\n");
  expect_error(torsio(call), kWorkFailed, "gear_angle_rad");
  folder_.file("b.csv", "t_s,gear_angle_rad,joint_angle_rad\n0,0,0\n0.001,0,0\n0.002,0,0\n");
  expect_error(torsio(call), kWorkFailed, "torque_Nm");
  std::string text = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int i = 0; i < 40; ++i) text += std::to_string(i * 0.001) + ",0.001,0,1\n";
  folder_.file("b.csv", text);
  expect_error(torsio(call), kWorkFailed, "nothing to use with role train");
  expect_error(torsio(call), kWorkFailed, "with 40 samples in all");
}

TEST_F(BrokenCalls, CtrlCDuringAnAdaptationLeavesTheOutputUntouched) {
  record();
  ASSERT_EQ(
      torsio("fit a.csv --model mlp --set layers=4000 --set epochs=1 -o m.safetensors").exit_code,
      0);
  folder_.file("old.safetensors", "precious");
  // P has 8 million numbers: each update takes milliseconds.
  expect_error(shell("timeout --foreground --signal=INT --preserve-status 2 {torsio} adapt "
                     "m.safetensors a.csv "
                     "--method rls --set confirmation_s=0 -o old.safetensors --json x.json"),
               kInterrupted, "stopped on request");
  EXPECT_EQ(contents("old.safetensors"), "precious");
  EXPECT_EQ(contents("x.json"), "");
}

TEST_F(BrokenCalls, OfReproduceNameWhatThereIs) {
  expect_error(torsio("reproduce 004-tub"), kCallWasWrong, "004-tubes");
  expect_error(torsio("reproduce 004-tubes --repeats 0"), kCallWasWrong, "repeats");
  expect_error(torsio("reproduce 004-tubes --json missing/x.json"), kCallWasWrong, "missing");
  expect_error(torsio("reproduce --plot x.svg"), kCallWasWrong,
               "one item that has a figure: 001-figures");
  expect_error(torsio("reproduce 000-arm --plot x.gif"), kCallWasWrong, ".svg");
  expect_error(torsio("reproduce 000-brake --plot x.svg"), kCallWasWrong, "found 000-brake");
  EXPECT_NE(torsio("reproduce --list").out.find("001-models"), std::string::npos);
}

TEST_F(BrokenCalls, CtrlCDuringAFitLeavesTheOutputUntouched) {
  record();
  folder_.file("m.safetensors", "precious");
  const Outcome outcome = shell(
      "timeout --foreground --signal=INT --preserve-status 1 {torsio} fit a.csv --model dgmm --set "
      "components=2000 "
      "--set novelty_distance=0.01 --set em_iterations=10000 -o m.safetensors");
  EXPECT_EQ(outcome.exit_code, kInterrupted) << outcome.err;
  EXPECT_NE(outcome.err.find("stopped on request"), std::string::npos) << outcome.err;
  EXPECT_EQ(contents("m.safetensors"), "precious");
}

TEST_F(BrokenCalls, CtrlCStopsTheWaitForAPipeAndEndsAsASignal) {
  for (const auto& [signal, exit_code] :
       {std::pair("INT", kInterrupted), std::pair("TERM", 128 + SIGTERM)}) {
    const Outcome outcome = shell(
        std::string("rm -f pipe; mkfifo pipe; sleep 4 >pipe & timeout --foreground --signal=") +
        signal + " --preserve-status 1 {torsio} check pipe");
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find("stopped on request"), std::string::npos) << outcome.err;
  }
}

TEST_F(BrokenCalls, OnAFullDiskSaySoAndLeaveNothing) {
  record();
  folder_.file("old.safetensors", "precious");
  const auto files = [this] { return shell("ls -A").out; };
  const std::string before = files();
  // A file may grow to one block: its writes fail as on a full disk, midway.
  const std::string full_disk = "ulimit -f 1; {torsio} ";
  expect_error(shell(full_disk + "simulate dfki-50 sweep --duration 5s -o new.csv"), kWorkFailed,
               "new.csv: cannot write: File too large");
  expect_error(shell(full_disk + "fit a.csv --model dgmm -o new.safetensors >/dev/null"),
               kWorkFailed, "new.safetensors: cannot write: File too large");
  expect_error(shell(full_disk + "fit a.csv --model dgmm -o old.safetensors >/dev/null"),
               kWorkFailed, "old.safetensors: cannot write: File too large");
  EXPECT_EQ(files(), before);
  EXPECT_EQ(contents("old.safetensors"), "precious");
  expect_error(torsio("simulate dfki-50 sweep --duration 5s -o - > /dev/full"), kWorkFailed,
               "standard output");
}

TEST_F(BrokenCalls, NameTheOutputThatCannotBeAFile) {
  record();
  // "precious" is not a recording: the refusal comes before it is read.
  folder_.file("b.csv", "precious");
  expect_error(torsio("fit b.csv --model linear -o /dev/full"), kCallWasWrong,
               "/dev/full: expected a file to write the model to");
  expect_error(torsio("fit b.csv --model linear -o -"), kCallWasWrong, "standard output");
  expect_error(torsio("compare b.csv --test a.csv -o ."), kCallWasWrong, "found a folder");
  expect_error(torsio("simulate dfki-50 sweep -o ."), kCallWasWrong, "found a folder");
  expect_error(torsio("simulate dfki-50 sweep -o a.csv --plot p.gif"), kCallWasWrong,
               "--plot: expected a file that ends in .svg, .png or .pdf, found p.gif");
  expect_error(torsio("compare b.csv --test a.csv --plot no/such/p.pdf"), kCallWasWrong, "no/such");
  expect_error(torsio("simulate dfki-50 sweep -o a.csv --plot p.svg --plot-size 85x9mm"),
               kCallWasWrong, "from 40 to 400");
  expect_error(torsio("fit a.csv --model linear -o no/such/folder/m.safetensors"), kCallWasWrong,
               "no/such/folder");
}

TEST_F(BrokenCalls, OnAnEndlessPipeStopEarly) {
  const Outcome outcome = shell("head -c 10000000000 /dev/zero | timeout 20 {torsio} check -");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_NE(outcome.exit_code, 124) << "it read on";
  EXPECT_NE(outcome.err.find("standard input"), std::string::npos) << outcome.err;
}

TEST_F(BrokenCalls, EndAtAGapWithoutSamples) {
  const Outcome outcome = shell("{ echo t_s,torque_Nm; yes ''; } | timeout 30 {torsio} check - ");
  EXPECT_EQ(outcome.exit_code, kWorkFailed) << "124: it read on";
  EXPECT_NE(outcome.err.find("blank lines and comments"), std::string::npos) << outcome.err;
}

TEST_F(BrokenCalls, WithoutMemoryEndWithAMessageAndNeverWaitForIt) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer reserves 16 TB of addresses";
#endif
  record();
  for (const char* kilobytes : {"40000", "70000", "100000", "130000", "160000", "200000", "300000"})
    for (const char* call : {"--version", "fit a.csv --model linear -o m.safetensors"}) {
      const std::string limit = std::string("ulimit -v ") + kilobytes + "; ";
      const Outcome outcome = shell(limit + "exec timeout -s KILL 20 {torsio} " + call);
      EXPECT_NE(outcome.exit_code, 137) << kilobytes << " kB: " << call << " did not end";
      EXPECT_TRUE(outcome.exit_code == 0 || !outcome.err.empty()) << kilobytes << " kB: " << call;
    }
}

TEST_F(BrokenCalls, PrintTheMappingLineThatCorrectsAClock) {
  std::string text = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int i = 0; i < 500; ++i)
    text += std::to_string(i / 7 * 0.0156) + ",0.0" + std::to_string(i % 10) + ",0,1\n";
  folder_.file("coarse.csv", text);
  const Outcome outcome = torsio("check coarse.csv");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_NE(outcome.out.find("FAIL  clock"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("clock: {rebuild: true}"), std::string::npos) << outcome.out;
}

TEST_F(BrokenCalls, RefuseAModelWhoseInputsTheRecordingLacks) {
  record();
  ASSERT_EQ(torsio("fit a.csv --model linear -o m.safetensors").exit_code, 0);
  folder_.file("b.csv", "t_s,torque_Nm\n0,1\n0.001,2\n0.002,3\n");
  const Outcome outcome = torsio("evaluate m.safetensors b.csv");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_NE(outcome.err.find("gear_angle_rad"), std::string::npos) << outcome.err;
}

TEST_F(BrokenCalls, NeverReplaceWhatTheyRead) {
  record();
  const std::string before = contents("a.csv");
  expect_error(torsio("fit a.csv --model linear -o a.csv"), kCallWasWrong, "a.csv");
  expect_error(torsio("fit a.csv --model linear -o m.safetensors --json ./a.csv"), kCallWasWrong,
               "a.csv");
  ASSERT_EQ(torsio("fit a.csv --model linear -o m.safetensors").exit_code, 0);
  expect_error(torsio("evaluate m.safetensors a.csv --predictions a.csv"), kCallWasWrong, "a.csv");
  EXPECT_EQ(contents("a.csv"), before);
}

TEST_F(BrokenCalls, DoNotPassTrainingDataOffAsHeldOut) {
  record();
  expect_error(torsio("compare a.csv --test a.csv"), kCallWasWrong,
               "used for training and for the scores");
  ASSERT_EQ(torsio("fit a.csv --model linear -o m.safetensors").exit_code, 0);
  const Outcome evaluate = torsio("evaluate m.safetensors a.csv");
  EXPECT_EQ(evaluate.exit_code, 0);
  EXPECT_NE(evaluate.err.find("was trained on"), std::string::npos) << evaluate.err;
}

TEST_F(BrokenCalls, RefuseALeakUnlessItIsAllowed) {
  std::string text = "t_s,angle_rad,motor_current_A,torque_Nm\n";
  for (int i = 0; i < 400; ++i) {
    const int torque = (i * 37) % 101;
    text += std::to_string(i * 0.001) + "," + std::to_string((i * 13) % 17) + "," +
            std::to_string(torque) + "," + std::to_string(2 * torque) + "\n";
  }
  folder_.file("leaky.csv", text);
  const std::string call =
      "fit leaky.csv --model linear --inputs angle_rad,motor_current_A -o m.safetensors";
  expect_error(torsio(call), kCallWasWrong, "motor_current_A");
  EXPECT_EQ(torsio(call + " --allow-leak").exit_code, 0);
}

}  // namespace
}  // namespace torsio::test
