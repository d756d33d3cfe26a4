#include "torsio/data/load.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

std::string ramp(int samples, const std::string& header = "t_s,angle_deg,torque_Nm") {
  std::string csv = header + "\n";
  for (int i = 0; i < samples; ++i)
    csv += std::to_string(i) + "e-2," + std::to_string(i) + "," + std::to_string(2 * i) + "\n";
  return csv;
}

TEST(LoadDataset, CsvFilesTakeTheRoleOfTheirList) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", ramp(10));
  const std::string b = folder.file("b.csv", ramp(20));
  const Dataset dataset = load_dataset({a}, {b});
  ASSERT_EQ(dataset.records.size(), 2U);
  EXPECT_EQ(dataset.records[0].segments[0].role, Role::train);
  EXPECT_EQ(dataset.records[1].segments[0].role, Role::test);
  EXPECT_EQ(dataset.records[1].segments[0].end, 20U);
  EXPECT_EQ(dataset.target, "torque_Nm");
  EXPECT_EQ(dataset.records[0].recording.name(), "a");
  EXPECT_EQ(dataset.records[0].recording.source.file, a);
}

TEST(LoadDataset, KeepsTheOrderOfFilesThatAreReadAtTheSameTime) {
  const TemporaryFolder folder;
  std::vector<std::string> files;
  for (int k = 0; k < 9; ++k) {
    const std::size_t samples = k % 2 == 0 ? 20000 : 10;
    files.push_back(folder.file(std::to_string(k) + ".csv", ramp(static_cast<int>(samples) + k)));
  }
  double last = 0.0;
  std::size_t falls = 0;
  LoadOptions options;
  options.progress = [&](double fraction, std::string_view) {
    if (fraction < last) ++falls;
    last = fraction;
    return true;
  };
  const Dataset dataset = load_dataset(files, {}, options);
  EXPECT_EQ(dataset.files, files);
  ASSERT_EQ(dataset.records.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) {
    EXPECT_EQ(dataset.records[k].recording.name(), std::to_string(k));
    EXPECT_EQ(dataset.records[k].recording.size(), (k % 2 == 0 ? 20000 : 10) + k);
  }
  EXPECT_EQ(falls, 0U) << "the progress is that of all files together";
  EXPECT_NEAR(last, 1.0, 1e-9);
}

TEST(LoadDataset, ReportsTheFirstOfSeveralWrongFiles) {
  const TemporaryFolder folder;
  std::vector<std::string> files;
  for (int k = 0; k < 6; ++k) files.push_back(folder.file(std::to_string(k) + ".csv", ramp(20000)));
  const std::string wrong = folder.file("2.csv", ramp(40000) + "1,x,2\n");
  (void)folder.file("3.csv", "no numbers\n");
  for (int repeat = 0; repeat < 5; ++repeat) {
    const std::string message = test::error_message([&] { (void)load_dataset(files, {}); });
    EXPECT_TRUE(message.starts_with(wrong + ": line 40002")) << message;
  }
}

TEST(LoadDataset, OneRateServesAll) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", ramp(11));
  const std::string b = folder.file("b.csv", "torque_Nm\n1\n2\n");
  const Dataset dataset = load_dataset({a, b}, {}, {.mapping = {}, .rate_Hz = 50.0, .target = {}});
  EXPECT_EQ(dataset.sample_rate_Hz(), 50.0);
  EXPECT_EQ(dataset.records[0].recording.size(), 6U);
  EXPECT_EQ(dataset.records[1].recording.size(), 2U);
}

TEST(LoadDataset, FilesOfOneNameStayApart) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path("x"));
  std::filesystem::create_directories(folder.path("y"));
  const std::string a = folder.file("x/run.csv", ramp(5));
  const std::string b = folder.file("y/run.csv", ramp(5));
  const Dataset dataset = load_dataset({a}, {b});
  EXPECT_EQ(dataset.records[0].recording.name(), a);
  EXPECT_EQ(dataset.records[1].recording.name(), b);
}

/// A foreign log and the mapping that reads it.
constexpr const char* kForeign = "time,enc,cell,note\n0,1,5,0\n1,2,6,0\n2,4,7,0\n";
constexpr const char* kForeignMapping = R"(
channels:
  t_s: {from: time, unit: ms}
  joint_angle_rad: {from: enc, unit: deg}
  torque_Nm: cell
drop: [note]
latency: {torque_Nm: 1ms}
zero: [{channel: torque_Nm, first: 1ms}, {channel: joint_angle_rad, first: 1ms}]
derive: {half_torque_Nm: 0.5 * torque_Nm}
)";

LoadOptions mapped_by(const std::string& mapping, const std::string& target = {}) {
  LoadOptions options;
  options.mapping = mapping;
  options.target = target;
  return options;
}

TEST(LoadInputs, NeedsNeitherTheTargetNorItsColumns) {
  const TemporaryFolder folder;
  const std::string log = folder.file("log.csv", "time,enc,note\n0,1,0\n1,2,0\n2,4,0\n");
  const std::string mapping = folder.file("map.yaml", kForeignMapping);
  EXPECT_NE(test::error_message([&] {
              (void)load_dataset({log}, {}, mapped_by(mapping));
            }).find("has no column 'cell'"),
            std::string::npos);
  const Dataset dataset = load_inputs({log}, {"joint_angle_rad"}, mapped_by(mapping, "torque_Nm"));
  const Recording& recording = dataset.records.at(0).recording;
  ASSERT_EQ(recording.channels().size(), 1U);
  EXPECT_DOUBLE_EQ(recording.channel("joint_angle_rad").values[2], rad_from_deg(3.0));
  EXPECT_EQ(recording.zeros.size(), 1U);
  EXPECT_EQ(dataset.files, (std::vector<std::string>{mapping, log}));
  // What the model needs must be there.
  EXPECT_NE(test::error_message([&] {
              (void)load_inputs({log}, {"torque_Nm"}, mapped_by(mapping, "torque_Nm"));
            }).find("has no column 'cell'"),
            std::string::npos);
}

TEST(LoadDataset, ADefaultMappingIsForLogsWithoutOne) {
  const TemporaryFolder folder;
  const std::string log = folder.file("log.csv", kForeign);
  const std::string text = mapping_text(parse_mapping(kForeignMapping, "map.yaml"));
  LoadOptions options;
  options.default_mapping = text;
  options.default_mapping_place = "m: mapping";
  const Dataset by_default = load_dataset({log}, {}, options);
  EXPECT_TRUE(by_default.records.at(0).recording.has("half_torque_Nm"));
  EXPECT_EQ(by_default.records.at(0).recording.mapping, text);
  const std::string own = "{drop: [note, time, enc], rate: 1kHz, channels: {torque_mNm: cell}}";
  const std::string manifest = folder.file("set.yaml", "mapping: " + own + "\nfiles: [log.csv]\n");
  const Recording mapped = load_dataset({manifest}, {}, options).records.at(0).recording;
  EXPECT_DOUBLE_EQ(mapped.channel("torque_Nm").values[0], 0.005);
  EXPECT_EQ(mapped.mapping, mapping_text(parse_mapping(own, "own")));
  const std::string given = folder.file("own.yaml", own);
  LoadOptions with_own = options;
  with_own.mapping = given;
  EXPECT_DOUBLE_EQ(
      load_dataset({log}, {}, with_own).records.at(0).recording.channel("torque_Nm").values[0],
      0.005);
}

constexpr const char* kManifest = R"(
label: a made-up bench
root: [not_there, "${TORSIO_TEST_UNSET}/x", logs]
sample_rate_Hz: 100
target: torque_Nm
mapping: map.yaml
split: {contiguous: 0.8, embargo: 20ms}
input_sets:
  plain: angle_rad, lowpass(rate(angle_rad), 10Hz)
  short: [angle_rad]
files:
  - a.csv
  - {file: b.csv, name: other, role: validation, conditions: {support_mm: 33, temperature_degC: 20}}
  - file: c.csv
    split: {interleaved_blocks: 4, test_every: 2}
    mapping: {}
    zero: [{channel: angle_rad, mid_range: true}]
)";

class Manifests : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path("logs"));
    static_cast<void>(folder_.file("logs/a.csv", ramp(100)));
    static_cast<void>(folder_.file("logs/b.csv", ramp(50)));
    static_cast<void>(folder_.file("logs/c.csv", ramp(40, "t_s,angle_rad,torque_Nm")));
    static_cast<void>(folder_.file("map.yaml", R"(
derive: {double_angle_rad: 2 * angle_rad}
computed_from: {torque_Nm: [iq_A]}
)"));
    manifest_ = folder_.file("set.yaml", kManifest);
  }
  TemporaryFolder folder_;
  std::string manifest_;
};

TEST_F(Manifests, NeedNotStandInAFile) {
  Manifest manifest = read_manifest(manifest_);
  const Dataset from_file = load_dataset({manifest_}, {});
  const Dataset from_memory = load_manifest(manifest);
  ASSERT_EQ(from_memory.records.size(), from_file.records.size());
  for (std::size_t i = 0; i < from_file.records.size(); ++i) {
    EXPECT_EQ(from_memory.records[i].recording.name(), from_file.records[i].recording.name());
    EXPECT_EQ(from_memory.records[i].segments, from_file.records[i].segments);
  }
  manifest.files.pop_back();
  EXPECT_EQ(load_manifest(manifest).records.size(), 2U);
}

TEST_F(Manifests, SayFilesRolesConditionsMappingsAndSplits) {
  const Dataset dataset = load_dataset({manifest_}, {});
  ASSERT_EQ(dataset.records.size(), 3U);
  EXPECT_EQ(dataset.label, "a made-up bench");
  ASSERT_EQ(dataset.input_sets.size(), 2U);
  EXPECT_EQ(dataset.input_sets[0].second,
            (std::vector<std::string>{"angle_rad", "lowpass(rate(angle_rad), 10Hz)"}));
  EXPECT_EQ(dataset.target_computed_from, std::vector<std::string>{"iq_A"});

  const DatasetRecord& first = dataset.records[0];
  ASSERT_EQ(first.segments.size(), 2U);
  EXPECT_EQ(first.segments[0].end, 78U);
  EXPECT_TRUE(first.recording.has("double_angle_rad"));

  const DatasetRecord& other = dataset.records[1];
  EXPECT_EQ(other.recording.name(), "other");
  EXPECT_EQ(other.segments[0].role, Role::validation);
  EXPECT_DOUBLE_EQ(other.recording.channel("support_m").values[0], 0.033);
  EXPECT_DOUBLE_EQ(other.recording.channel("temperature_K").values[0], 293.15);

  const DatasetRecord& third = dataset.records[2];
  EXPECT_EQ(third.segments.size(), 4U);
  EXPECT_FALSE(third.recording.has("double_angle_rad"));
  EXPECT_TRUE(third.recording.zeros[0].mid_range);
  EXPECT_EQ(third.recording.channel("angle_rad").values[0], -19.5);
}

TEST_F(Manifests, AsATestAllOfItIsTest) {
  const Dataset dataset = load_dataset({folder_.path("logs/a.csv")}, {manifest_});
  for (std::size_t i = 1; i < dataset.records.size(); ++i) {
    EXPECT_EQ(dataset.records[i].segments.size(), 1U);
    EXPECT_EQ(dataset.records[i].segments[0].role, Role::test);
  }
}

TEST_F(Manifests, KeepTheirRolesWhereAllElseIsTest) {
  LoadOptions options;
  options.role = Role::test;
  const std::string plain = folder_.file("plain.yaml", "files: [logs/a.csv]");
  const Dataset dataset = load_dataset({manifest_, folder_.path("logs/c.csv"), plain}, {}, options);
  ASSERT_EQ(dataset.records.size(), 5U);
  EXPECT_TRUE(dataset.records[0].has_role(Role::train)) << "by the split";
  EXPECT_TRUE(dataset.records[1].has_role(Role::validation));
  EXPECT_EQ(dataset.records[3].segments.front().role, Role::test) << "a CSV file";
  EXPECT_EQ(dataset.records[4].segments.front().role, Role::test) << "listed in no manifest";
}

TEST_F(Manifests, AnEmbargoLongerThanTheRecordIsRefused) {
  for (const char* embargo : {"1e300s", "1e308min", "2s"}) {
    const std::string path = folder_.file(
        "long.yaml",
        std::string("{files: [logs/a.csv], split: {contiguous: 0.5, embargo: ") + embargo + "}}");
    EXPECT_NE(
        test::error_message([&] { static_cast<void>(load_dataset({path}, {})); }).find("embargo"),
        std::string::npos)
        << embargo;
  }
}

TEST_F(Manifests, TheUsersWordCountsMore) {
  const std::string mapping = folder_.file("mine.yaml", "derive: {mine_rad: angle_rad}");
  const auto recordings =
      load_recordings(manifest_, {.mapping = mapping, .rate_Hz = 50.0, .target = {}});
  ASSERT_EQ(recordings.size(), 3U);
  for (const Recording& recording : recordings) {
    EXPECT_TRUE(recording.has("mine_rad"));
    EXPECT_EQ(recording.sample_rate_Hz(), 50.0);
  }
}

TEST(LoadDataset, DistinguishesACanonicalTargetFromItsSources) {
  const TemporaryFolder folder;
  const std::string log =
      folder.file("a.csv", "t_s,gear_angle_rad,joint_angle_rad\n0,1,0.75\n0.1,2,1.5\n0.2,3,2.25\n");
  const Dataset dataset =
      load_dataset({log}, {}, {.mapping = {}, .rate_Hz = {}, .target = "spring_deflection_rad"});
  EXPECT_EQ(dataset.records.front().recording.channel("spring_deflection_rad").values,
            (std::vector<double>{0.25, 0.5, 0.75}));
  EXPECT_THROW(static_cast<void>(load_dataset(
                   {log}, {}, {.mapping = {}, .rate_Hz = {}, .target = "motor_speed_rad_s"})),
               Error);
}

TEST_F(Manifests, ARootMayStandInAnEnvironmentVariable) {
  ASSERT_EQ(setenv("TORSIO_TEST_ROOT", folder_.path("logs").c_str(), 1), 0);
  const Manifest manifest =
      parse_manifest("{root: '${TORSIO_TEST_ROOT}', files: [a.csv]}", folder_.path("x.yaml"));
  EXPECT_TRUE(std::filesystem::equivalent(data_folder(manifest), folder_.path("logs")));
}

TEST(LoadDataset, RefusesAMisspeltSourceOfTheTarget) {
  const TemporaryFolder folder;
  const std::string log = folder.file("a.csv", "t_s,iq_A,torque_Nm\n0,1,2\n0.1,2,4\n0.2,3,6\n");
  const auto load = [&](const std::string& computed_from) {
    const std::string manifest = folder.file(
        "set.yaml", "{files: [a.csv], mapping: {computed_from: {" + computed_from + "}}}");
    return load_dataset({manifest}, {}).target_computed_from;
  };
  EXPECT_EQ(load("torque_Nm: [iq_A]"), std::vector<std::string>{"iq_A"});
  EXPECT_EQ(load("torque_Nm: [strain_1]"), std::vector<std::string>{"strain_1"});
  const std::string of_source = test::error_message([&] { load("torque_Nm: [iqq_A]"); });
  EXPECT_NE(of_source.find("computed_from.torque_Nm"), std::string::npos) << of_source;
  EXPECT_NE(of_source.find("Did you mean 'iq_A'?"), std::string::npos) << of_source;
  const std::string of_target = test::error_message([&] { load("torqe_Nm: [iq_A]"); });
  EXPECT_NE(of_target.find("Did you mean 'torque_Nm'?"), std::string::npos) << of_target;
}

TEST_F(Manifests, ThatDisagreeAreRefused) {
  const std::string force = folder_.file("force.yaml", "{target: force_N, files: [logs/a.csv]}");
  EXPECT_THROW(static_cast<void>(load_dataset({manifest_, force}, {})), UsageError);
}

}  // namespace
}  // namespace torsio
