#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "data/mcap/mcap_records.hpp"
#include "data/mcap_bytes.hpp"
#include "data/packed_by_zstd.hpp"
#include "data/read_log.hpp"
#include "data/ros/message_topics.hpp"
#include "data/ros/ros_schema.hpp"
#include "report/log_summary.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

using test::channel;
using test::error_message;
using test::file_bytes;
using test::file_with;
using test::message;
using test::packed_by_zstd;
using testing::HasSubstr;

// Written by the reference implementation of MCAP: tools/recording_peers/make_mcap.mjs has the equations.
constexpr std::size_t kMessages = 200;

std::string mcap_path(const std::string& name) { return std::string(TORSIO_MCAP_FILES "/") + name; }

LogTable parsed(std::string_view bytes, const TopicOptions& options = {}) {
  const auto source = bytes_in_memory(bytes, "test.mcap");
  McapRecords records(*source, "test.mcap", {.record_bytes = std::size_t{1} << 20});
  const std::vector<NamedMessages> files{{"test.mcap", &records}};
  return table_of_messages(files, "test.mcap", options);
}

double elbow(std::size_t n) { return std::sin(0.05 * static_cast<double>(n)); }

class McapFile : public testing::TestWithParam<std::string> {};

TEST_P(McapFile, HasTheNumbersOfItsMessagesWhateverItsPacking) {
  const LogTable table = read_log(mcap_path(GetParam()));
  ASSERT_EQ(table.rows(), kMessages - 3);  // before the first message of the load cell
  EXPECT_EQ(table.source.sha256.size(), 64U);
  const LogColumn& position = *table.find("/joint_states/elbow/position");
  const LogColumn& shoulder = *table.find("/joint_states/shoulder/effort");
  const LogColumn& cell = *table.find("/load_cell/wrench/torque/z");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::size_t n = row + 3;
    EXPECT_NEAR(position.values[row], elbow(n), 1e-12);  // the order of the joints changes half-way
    EXPECT_NEAR(shoulder.values[row], 20.0 * elbow(n), 1e-12);
    EXPECT_NEAR(table.find("t_s")->values[row], 0.005 * static_cast<double>(row), 1e-9);
    const std::size_t held = (n - 3) / 4 * 4 + 2;
    EXPECT_EQ(cell.values[row], 0.5 * static_cast<double>(held));
    EXPECT_EQ(cell.fresh[row], (n - 3) % 4 == 0 ? 1 : 0) << n;
  }
  EXPECT_TRUE(position.fresh.empty());
  EXPECT_EQ(table.find("/joint_states/elbow/velocity"), nullptr);
  EXPECT_EQ(table.find("/motor/temperature/others/2")->values[0], 3.0);
  EXPECT_EQ(table.find("/motor/temperature/raw/0"), nullptr);
  EXPECT_NEAR(table.find("/status/current/A")->values.back(), 10.0, 1e-12);
  EXPECT_EQ(table.find("/status/armed")->values.back(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Packings, McapFile,
                         testing::Values("no_chunks.mcap", "lz4.mcap", "zstd.mcap"),
                         [](const auto& file) {
                           return file.param.substr(0, file.param.find('.'));
                         });

TEST(Mcap, ReadsOnlyTheTopicsThatAreWanted) {
  const LogTable table =
      read_log(mcap_path("zstd.mcap"), {.skip = {}, .wanted = {"/load_cell/wrench/torque/z"}});
  EXPECT_EQ(table.rows(), kMessages / 4);  // its rows are those of that topic
  EXPECT_EQ(table.find("/joint_states/elbow/position"), nullptr);
  const LogColumn& cell = *table.find("/load_cell/wrench/torque/z");
  EXPECT_TRUE(cell.fresh.empty());
  EXPECT_EQ(cell.values[2], 5.0);
  EXPECT_EQ(table.place(1, cell).substr(0, mcap_path("zstd.mcap").size()), mcap_path("zstd.mcap"));
  EXPECT_THAT(table.place(1, cell), HasSubstr(": message 1"));
}

TEST(Mcap, BecomesChannelsByAMapping) {
  const TemporaryFolder folder;
  std::ofstream(folder.path("joint.yaml")) << "channels:\n"
                                              "  joint_angle_rad: /joint_states/elbow/position\n"
                                              "  torque_Nm: /load_cell/wrench/torque/z\n"
                                              "  motor_temperature_K: {from: "
                                              "/motor/temperature/temperature, unit: degC}\n";
  LoadOptions options;
  options.mapping = folder.path("joint.yaml");
  const std::vector<Recording> recordings = load_recordings(mcap_path("lz4.mcap"), options);
  ASSERT_EQ(recordings.size(), 1U);
  EXPECT_NEAR(recordings[0].sample_rate_Hz(), 200.0, 1e-6);
  EXPECT_EQ(recordings[0].channels().size(), 3U);
  EXPECT_FALSE(recordings[0].channel("torque_Nm").is_fresh(1));
  EXPECT_NEAR(recordings[0].channel("motor_temperature_K").values[0], 298.15, 1e-12);
  EXPECT_EQ(recordings[0].name(), "lz4");
}

TEST(Mcap, IsReadUpToItsLastWholeRecordIfTheRecorderWasStopped) {
  const std::string whole = file_bytes(mcap_path("no_chunks.mcap"));
  const LogTable all = parsed(whole);
  for (const std::size_t size : {whole.size() / 2, whole.size() / 2 + 1, whole.size() / 3}) {
    const LogTable cut = parsed(std::string_view(whole).substr(0, size));
    ASSERT_LT(cut.rows(), all.rows());
    const LogColumn& position = *cut.find("/joint_states/elbow/position");
    for (std::size_t row = 0; row < cut.rows(); ++row)
      EXPECT_EQ(position.values[row], all.find(position.name)->values[row]);
  }
}

TEST(Mcap, AnyChangedByteIsAnErrorOrAnotherNumber) {
  const std::string whole = file_bytes(mcap_path("zstd.mcap"));
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 37) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x55);
    try {
      EXPECT_GT(parsed(changed).rows(), 0U);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, whole.size() / 37 / 2);  // most of it is in chunks, which have checksums
}

TEST(Mcap, RowsBeforeTheFirstMessageOfAnotherTopicHaveNoValueOfIt) {
  const std::string file = std::string(kMcapMark) + channel(1, 0, "/a", "json") +
                           channel(2, 0, "/b", "json") + message(1, 2, "{\"x\": 0}") +
                           message(2, 4, "{\"y\": 7}") + message(1, 5, "{\"x\": 1}") +
                           message(1, 10, "{\"x\": 2}") + message(1, 3, "{\"x\": 3}");
  const LogTable table = parsed(file);  // the clock of /a goes back at its last message
  EXPECT_THAT(table.find("/a/x")->values, testing::ElementsAre(1.0, 2.0, 3.0));
  EXPECT_THAT(table.find("/b/y")->values, testing::ElementsAre(7.0, 7.0, testing::IsNan()));
  EXPECT_THAT(table.find("/b/y")->fresh, testing::ElementsAre(1, 0, 1));
}

/// A message with a header, in CDR.
std::string stamped(std::int32_t seconds, std::uint32_t nanoseconds, double x) {
  return std::string("\0\1\0\0", 4) + test::number(seconds) + test::number(nanoseconds) +
         test::number(std::uint32_t{1}) + std::string(4, '\0') + test::number(x);
}

constexpr const char* kStamped =
    "std_msgs/Header header\nfloat64 x\n===\nMSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\n"
    "int32 sec\nuint32 nanosec\n";

std::vector<double> times_of(const std::string& file) { return parsed(file).find("t_s")->values; }

TEST(Mcap, SimulatedTimeMayBeginAtZero) {
  constexpr std::int64_t kWall_ns = 1'744'909'205'000'000'000;
  std::string file = file_with("ros2msg", kStamped, "cdr", stamped(0, 0, 0.0));
  // The first message of the helper was recorded at 1000 ns.
  for (std::uint32_t n = 1; n < 4; ++n)
    file += message(1, kWall_ns + 7'000'000 * n, stamped(0, 10'000'000 * n, n));
  EXPECT_THAT(times_of(file), testing::ElementsAre(0.0, testing::DoubleNear(0.01, 1e-12),
                                                   testing::DoubleNear(0.02, 1e-12),
                                                   testing::DoubleNear(0.03, 1e-12)));
  // The recorder has the simulated time, too; the first message of the helper is recorded at 1000 ns.
  std::string all_simulated = file_with("ros2msg", kStamped, "cdr", stamped(0, 0, 0.0));
  all_simulated += message(1, 10'003'000, stamped(0, 10'000'000, 1.0));
  EXPECT_THAT(times_of(all_simulated), testing::ElementsAre(0.0, testing::DoubleNear(0.01, 1e-12)));
}

TEST(Mcap, WithoutStampsTheTimesOfTheRecorderAreUsed) {
  std::string all_zero = file_with("ros2msg", kStamped, "cdr", stamped(0, 0, 0.0));
  all_zero += message(1, 10'001'000, stamped(0, 0, 1.0));
  EXPECT_THAT(times_of(all_zero), testing::ElementsAre(0.0, testing::DoubleNear(0.01, 1e-12)));
  // A single message without a stamp, where the others have the clock of the recorder.
  std::string one_zero = file_with("ros2msg", kStamped, "cdr", stamped(0, 1000, 0.0));
  one_zero += message(1, 10'001'000, stamped(0, 0, 1.0));
  one_zero += message(1, 20'001'000, stamped(0, 20'001'000, 2.0));
  EXPECT_THAT(times_of(one_zero), testing::ElementsAre(0.0, testing::DoubleNear(0.01, 1e-12),
                                                       testing::DoubleNear(0.02, 1e-12)));
}

/// Arm and gripper publish on one topic.
std::string two_publishers(int arm_messages) {
  std::string file = std::string(kMcapMark) + channel(1, 0, "/js", "json");
  for (int n = 0; n < arm_messages; ++n) {
    file += message(1, 10'000'000 * n, "{\"arm\": " + std::to_string(n) + ", \"spare\": null}");
    if (n % 2 == 0)
      file += message(1, 10'000'000 * n + 3'000'000, "{\"gripper\": " + std::to_string(n) + "}");
  }
  return file;
}

TEST(Mcap, TheClockOfATopicIsThatOfTheMessagesWithTheWantedFields) {
  const std::string file = two_publishers(6);
  const LogTable arm = parsed(file, {.wanted = {"/js/arm"}});
  EXPECT_THAT(arm.find("/js/arm")->values, testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_NEAR(arm.find("t_s")->values[1], 0.01, 1e-12);
  EXPECT_EQ(arm.find("/js/gripper"), nullptr);
  EXPECT_THAT(arm.column_list(), HasSubstr("/js/gripper"));  // for messages about wrong names
  const LogTable gripper = parsed(file, {.wanted = {"/js/gripper"}});
  EXPECT_THAT(gripper.find("/js/gripper")->values, testing::ElementsAre(0, 2, 4));
  EXPECT_NEAR(gripper.find("t_s")->values[1], 0.02, 1e-12);
}

TEST(Mcap, FieldsOfTwoPublishersOnATopicAreHeldLikeThoseOfTwoTopics) {
  const LogTable both = parsed(two_publishers(6), {.wanted = {"/js/arm", "/js/gripper"}});
  EXPECT_THAT(both.find("/js/arm")->values, testing::ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(both.find("/js/gripper")->values, testing::ElementsAre(0, 0, 2, 2, 4));
  EXPECT_THAT(both.find("/js/gripper")->fresh, testing::ElementsAre(1, 0, 1, 0, 1));
}

TEST(Mcap, AFieldThatIsNullWasNotMeasured) {
  const std::string file = std::string(kMcapMark) + channel(1, 0, "/a", "json") +
                           message(1, 0, "{\"x\": 1}") + message(1, 10, "{\"x\": null}") +
                           message(1, 20, "{\"x\": 3}");
  EXPECT_THAT(parsed(file, {.wanted = {"/a/x"}}).find("/a/x")->values,
              testing::ElementsAre(1.0, testing::IsNan(), 3.0));
}

TEST(Mcap, MessagesThatRosbag2PackedAreUnpacked) {
  const std::string cdr = std::string("\0\1\0\0", 4) + test::number(1.5F);
  const std::string packed = packed_by_zstd(cdr);
  EXPECT_EQ(parsed(file_with("ros2msg", "float32 x", "cdr", packed)).find("/t/x")->values[0], 1.5);
  EXPECT_THAT(
      error_message([&] {
        (void)parsed(file_with("ros2msg", "float32 x", "cdr", packed.substr(0, packed.size() - 2)));
      }),
      testing::AllOf(HasSubstr("message 1"), HasSubstr("zstd packed is damaged")));
}

TEST(Mcap, StatesWhatItDoesNotRead) {
  const std::string cdr("\0\1\0\0", 4);
  const auto refused = [](const std::string& bytes) {
    return error_message([&] { (void)parsed(bytes); });
  };
  EXPECT_EQ(parsed(file_with("ros2msg", "float32 x", "cdr", cdr + std::string("\0\0\x80\x3f", 4)))
                .find("/t/x")
                ->values[0],
            1.0);
  EXPECT_THAT(
      refused(file_with("ros2msg", "float64 x", "cdr", cdr + "1234")),
      testing::AllOf(HasSubstr("test.mcap: message 1"), HasSubstr("does not match its schema")));
  EXPECT_THAT(
      refused(file_with("ros2msg", "float64 x", "cdr", std::string("\0\7\0\0", 4) + "12345678")),
      HasSubstr("XCDR2"));
  EXPECT_THAT(refused(file_with("ros2msg", "other/Type x", "cdr", cdr)),
              HasSubstr("a type that the schema does not define"));
  EXPECT_THAT(refused(file_with("ros2msg", "wstring x", "cdr", cdr)), HasSubstr("wide texts"));
  EXPECT_THAT(refused(file_with("protobuf", "", "protobuf", "")), HasSubstr("no numbers"));
  EXPECT_THAT(refused(file_with("jsonschema", "", "json", "{\"a\": ")), HasSubstr("expected json"));
  EXPECT_THAT(refused(std::string(kMcapMark)), HasSubstr("no messages"));
  EXPECT_THAT(refused("a,b\n"), HasSubstr("an MCAP file"));
  // An array that claims more elements than there are bytes.
  EXPECT_THAT(
      refused(file_with("ros2msg", "float64[] x", "cdr", cdr + std::string("\xff\xff\xff\xff", 4))),
      HasSubstr("does not match"));
  const TopicOptions unknown{.wanted = {"/t/y"}};
  const std::string bytes = file_with("ros2msg", "float32 x", "cdr", cdr + "1234");
  EXPECT_THAT(error_message([&] { (void)parsed(bytes, unknown); }),
              testing::AllOf(HasSubstr("/t/y"), HasSubstr("check --list")));
}

TEST(Mcap, TypesThatContainThemselvesAreRefused) {
  const std::string line(80, '=');
  EXPECT_THAT(error_message([&] {
                (void)parse_ros_schema("p/msg/A", "B b\n" + line + "\nMSG: p/B\nA a\n", "x.mcap");
              }),
              HasSubstr("nested too deeply"));
}

TEST(RosSchema, HasFieldsArraysConstantsAndDefaults) {
  const RosSchema schema = parse_ros_schema("p/msg/T",
                                            "uint8 ON=1  # a constant\n"
                                            "float64[4] w\n"
                                            "int32[<=3] bounded\n"
                                            "string<=10 unit \"rad\"\n"
                                            "bool ok true\n",
                                            "x.mcap");
  ASSERT_EQ(schema.types.size(), 1U);
  const auto& fields = schema.types[0].fields;
  ASSERT_EQ(fields.size(), 4U);
  EXPECT_EQ(fields[0].size, 4U);
  EXPECT_EQ(fields[1].count, RosField::Count::sequence);
  EXPECT_EQ(fields[2].kind, RosKind::text);
  EXPECT_EQ(fields[3].name, "ok");
}

TEST(ReadLog, ReadsTheFolderOfRosbag2InItsOrder) {
  const TemporaryFolder folder;
  const std::string whole = file_bytes(mcap_path("no_chunks.mcap"));
  for (const char* name : {"run_0.mcap", "run_1.mcap"})
    std::ofstream(folder.path(name), std::ios::binary) << whole;
  std::ofstream(folder.path("metadata.yaml"))
      << "rosbag2_bagfile_information:\n  version: 5\n"
         "  relative_file_paths:\n    - run_0.mcap\n    - run_1.mcap\n";
  const ReadLogOptions options{.skip = {}, .wanted = {"/joint_states/elbow/position"}};
  EXPECT_EQ(read_log(folder.path(""), options).rows(), 2 * kMessages);
  std::filesystem::remove(folder.path("metadata.yaml"));
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("")); }),
              testing::AllOf(HasSubstr("metadata.yaml"), HasSubstr("run_0.mcap, run_1.mcap"),
                             HasSubstr("ros2 bag reindex")));
  std::filesystem::remove(folder.path("run_1.mcap"));
  EXPECT_EQ(read_log(folder.path(""), options).rows(), kMessages);
}

TEST(ReadLog, ReadsPackedFilesOfRosbag2) {
  const TemporaryFolder folder;
  const std::string whole = file_bytes(mcap_path("no_chunks.mcap"));
  std::ofstream(folder.path("run_0.mcap.zstd"), std::ios::binary) << packed_by_zstd(whole);
  const ReadLogOptions options{.skip = {}, .wanted = {"/joint_states/elbow/position"}};
  EXPECT_EQ(read_log(folder.path("run_0.mcap.zstd"), options).rows(), kMessages);
  const std::string metadata =
      "rosbag2_bagfile_information:\n  compression_format: FORMAT\n  compression_mode: MESSAGE\n"
      "  relative_file_paths: [run_0.mcap.zstd]\n";
  const auto write = [&](const std::string& format) {
    std::string text = metadata;
    std::ofstream(folder.path("metadata.yaml")) << text.replace(text.find("FORMAT"), 6, format);
  };
  write("ZSTD");
  EXPECT_EQ(read_log(folder.path(""), options).rows(), kMessages);
  write("other");
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path(""), options); }),
              testing::AllOf(HasSubstr("expected zstd"), HasSubstr("ros2 bag convert")));
}

TEST(ReadLog, NamesFormatsThatItDoesNotRead) {
  const TemporaryFolder folder;
  std::ofstream(folder.path("run.h5")) << "\x89HDF\r\n....";
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("run.h5")); }),
              testing::AllOf(HasSubstr("HDF5"), HasSubstr("numpy.savez")));
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(folder.path(name), std::ios::binary) << bytes;
    return error_message([&] { (void)read_log(folder.path(name)); });
  };
  EXPECT_THAT(refused("run.parquet", "PAR1...."), HasSubstr("pandas.read_parquet("));
  EXPECT_THAT(refused("run.csv.bz2", "BZh91AY&SY"),
              HasSubstr("bunzip2 -k " + folder.path("run.csv.bz2")));
  EXPECT_THAT(refused("run.csv.xz", std::string("\xfd"
                                                "7zXZ\0..",
                                                8)),
              HasSubstr("unxz -k "));
  EXPECT_THAT(refused("run.jsonl", "{\"t\": 0}\n{\"t\": 1}\n"),
              testing::AllOf(HasSubstr("JSON, an object in each line"),
                             HasSubstr("read_json(sys.argv[1], lines=True)")));
  EXPECT_THAT(refused("run.json", " [ {\"t\": 0}]"),
              testing::AllOf(HasSubstr("found JSON\n"), HasSubstr("read_json(sys.argv[1])")));
  EXPECT_THAT(refused("a run.json", "[{}]"), HasSubstr("run.json'"));  // quoted for the shell
  std::ofstream(folder.path("run.csv")) << "t_s,torque_Nm\n0,1\n";
  EXPECT_EQ(read_log(folder.path("run.csv")).rows(), 1U);
}

TEST(ListLog, HasTheColumnsOfACsvFileWithUnitsRangesAndNewValues) {
  const TemporaryFolder folder;
  std::ofstream(folder.path("run.csv")) << "t [ms];pos;tau_Nm;note;tau_Nm\n0;1;5;a;1\n10;2;5;b;1\n"
                                           "20;-3;;c;1\n30;4;6;d;1\n";
  const LogSummary summary = list_log(folder.path("run.csv"));
  ASSERT_EQ(summary.columns.size(), 3U);
  EXPECT_EQ(summary.clock, "t [ms]");
  EXPECT_NEAR(summary.duration_s, 0.03, 1e-12);
  EXPECT_EQ(summary.columns[0].unit_origin, UnitOrigin::brackets);
  EXPECT_EQ(summary.columns[1].unit, "");
  EXPECT_EQ(summary.columns[1].lowest, -3.0);
  EXPECT_EQ(summary.columns[1].highest, 4.0);
  EXPECT_EQ(summary.columns[2].unit_origin, UnitOrigin::name);
  EXPECT_EQ(summary.columns[2].empty, 1U);
  EXPECT_EQ(summary.columns[2].fresh, 2U);  // 5, held, nothing, 6
  EXPECT_EQ(summary.not_read,
            (std::vector<std::string>{"tau_Nm (column 5: column 3 has the same name)",
                                      "note (text, in line 2: 'a')"}));
}

TEST(ListLog, HasTopicsRatesGapsAndFields) {
  const LogSummary summary = list_log(mcap_path("lz4.mcap"));
  ASSERT_EQ(summary.topics.size(), 4U);
  EXPECT_FALSE(summary.is_unfinished);
  const TopicSummary& cell = summary.topics[1];
  EXPECT_EQ(cell.topic, "/load_cell");
  EXPECT_EQ(cell.messages, kMessages / 4);
  EXPECT_EQ(cell.largest_gap_ns, 20'000'000);
  EXPECT_THAT(cell.fields, testing::Contains("/load_cell/wrench/force/y"));
  EXPECT_THAT(log_summary_text(summary), HasSubstr("geometry_msgs/msg/WrenchStamped"));
  EXPECT_THAT(log_summary_json(summary), HasSubstr("\"duration_s\": 0.98"));
}

}  // namespace
}  // namespace torsio
