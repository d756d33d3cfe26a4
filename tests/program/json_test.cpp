// Each verb with --json writes documents that begin with their schema_version (docs/use/json.md).
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

struct JsonCase {
  const char* name;
  const char* before;  ///< calls that make the files that the verb reads; one per line
  const char* call;
};

constexpr const char* kRecord =
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 1 -o a.csv\n";
constexpr const char* kTwoRecords =
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 1 -o a.csv\n"
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.17m --seed 2 -o b.csv\n";
constexpr const char* kModel =
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 1 -o a.csv\n"
    "{torsio} fit a.csv --model linear -o m.safetensors\n";
constexpr const char* kStored =
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 1 -o a.csv\n"
    "{torsio} fit a.csv --model linear --device-serial elbow -o m.safetensors\n"
    "{torsio} store add elbow m.safetensors\n"
    "{torsio} store promote elbow 1\n";
constexpr const char* kNetwork =
    "{torsio} simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 1 -o a.csv\n"
    "{torsio} fit a.csv --model mlp --set epochs=2 -o m.safetensors\n";

const JsonCase kCases[] = {
    {"Adapt", kNetwork, "adapt m.safetensors a.csv"},
    {"Attribute", kModel, "attribute m.safetensors a.csv --windows 10"},
    {"Check", kRecord, "check a.csv"},
    {"CheckWithAdvice", kRecord, "check a.csv --advise"},
    {"Compare", kTwoRecords, "compare a.csv --test b.csv --models linear"},
    {"CrossValidate", kRecord, "crossvalidate a.csv --models linear"},
    {"Demo", kTwoRecords, "demo a.csv --test b.csv --models linear"},
    {"DesignActuator", "",
     "design actuator --continuous 30Nm --peak 60Nm --speed 60deg/s --deflection 5deg"},
    {"DesignClutch", "", "design clutch --slip 0.5Nm"},
    {"DesignRubberSpring", "", "design rubber-spring --torque 0.5Nm --angle 15deg"},
    {"DesignSpring", "",
     "design spring --torque 50Nm --angle 5deg --max-diameter 60mm --max-length 90mm"},
    {"Estimate", kModel, "estimate m.safetensors a.csv"},
    {"Evaluate", kModel, "evaluate m.safetensors a.csv"},
    {"EvaluateAModelAlone", kModel, "evaluate m.safetensors"},
    {"Convert", kRecord, "convert a.csv -o a.mcap"},
    {"Fit", kRecord, "fit a.csv --model linear -o m.safetensors"},
    {"FleetCalibrate", "",
     "fleet calibrate --specimens 'dfki-50#0001..#0002' --only-compare --model linear"},
    {"FleetWatch", kStored, "fleet watch --store torsio-studies.sqlite"},
    {"Joint", "", "joint --unix joint --fast --duration 1s"},
    {"Import", "",
     "import '" TORSIO_SOURCE "/tests/golden/import/weights_mlp.json' --activation softsign "
     "--inputs a_rad,b_rad,c_rad --rate 100Hz -o m.safetensors"},
    {"Reproduce", "", "reproduce 001-models --quick --repeats 1"},
    {"Simulate", "", "simulate dfki-50 sweep --duration 2s -o a.csv"},
    {"SimulateDescribe", "", "simulate --describe dfki-50"},
    {"SimulateList", "", "simulate --list"},
    {"StoreAdd", kStored, "store add elbow m.safetensors"},
    {"StoreExport", kStored, "store export elbow -o out.safetensors"},
    {"StoreList", kStored, "store list"},
    {"StorePromote", kStored, "store promote elbow 1"},
    {"StoreShow", kStored, "store show elbow"},
    {"StoreUpgrade", kStored, "store upgrade"},
    {"StoreVerify", kStored, "store verify"},
    {"Track", "", "track --actuator dfki-50 --duration 5s"},
    {"TrackImpedance", "", "track --impedance zero --duration 10s"},
    {"TuneLoop", "", "tune-loop --actuator dfki-50"},
    {"Unpack", TORSIO_EXAMPLES "/example_08_run_realtime_loop\n", "unpack run.tsr -o run.csv"},
};

void PrintTo(const JsonCase& verb, std::ostream* out) { *out << verb.call; }

class JsonOfVerb : public Program, public testing::WithParamInterface<JsonCase> {};

TEST_P(JsonOfVerb, BeginsWithItsSchemaVersion) {
  std::istringstream before(GetParam().before);
  for (std::string line; std::getline(before, line);) {
    const Outcome outcome = shell(line);
    ASSERT_EQ(outcome.exit_code, 0) << line << '\n' << outcome.err;
  }
  const Outcome outcome = torsio(std::string(GetParam().call) + " --json -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  auto document = nlohmann::ordered_json::parse(outcome.out);
  if (document.is_array()) {  // reproduce: one document for each study
    ASSERT_EQ(document.size(), 1U);
    document = document.front();
  }
  ASSERT_TRUE(document.is_object());
  EXPECT_EQ(document.begin().key(), "schema_version");
  EXPECT_EQ(document.begin().value(), 1);
}

INSTANTIATE_TEST_SUITE_P(EachVerb, JsonOfVerb, testing::ValuesIn(kCases),
                         [](const auto& verb) { return std::string(verb.param.name); });

}  // namespace
}  // namespace torsio::test
