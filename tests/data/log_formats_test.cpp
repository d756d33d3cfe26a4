// Files that other programs wrote: tools/recording_peers/make_logs.py has the equations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "data/arrays/child_process.hpp"
#include "data/arrays/mat.hpp"
#include "data/arrays/npz.hpp"
#include "data/arrays/zip_archive.hpp"
#include "data/bag/bag_records.hpp"
#include "data/log_summary.hpp"
#include "data/packed_by_zstd.hpp"
#include "data/read_log.hpp"
#include "data/ros/message_topics.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::file_bytes;
using test::packed_by_zstd;
using testing::HasSubstr;

constexpr std::size_t kSamples = 200;

std::string log_path(const std::string& name) { return std::string(TORSIO_LOG_FILES "/") + name; }

double q(std::size_t n) { return std::sin(0.05 * static_cast<double>(n)); }

void expect_sine(const std::vector<double>& values, double factor, double tolerance) {
  ASSERT_EQ(values.size(), kSamples);
  for (std::size_t n = 0; n < kSamples; ++n) ASSERT_NEAR(values[n], factor * q(n), tolerance) << n;
}

class MessageFile : public testing::TestWithParam<std::string> {};

TEST_P(MessageFile, HasTheNumbersAndTimesOfItsMessages) {
  const LogTable table = read_log(log_path(GetParam()));
  expect_sine(table.find("/joint_states/elbow/position")->values, 1.0, 1e-12);
  expect_sine(table.find("/joint_states/wrist/effort")->values, -20.0, 1e-12);
  EXPECT_EQ(table.find("/joint_states/elbow/velocity"), nullptr);
  EXPECT_NEAR(table.find("t_s")->values.back(), 0.995, 1e-9);
  EXPECT_EQ(table.source.sha256.size(), 64U);
  EXPECT_FALSE(table.has_units);
  const LogSummary summary = list_log(log_path(GetParam()));
  ASSERT_EQ(summary.topics.size(), 1U);
  EXPECT_EQ(summary.topics[0].messages, kSamples);
  EXPECT_EQ(summary.topics[0].problem, "");
  EXPECT_FALSE(summary.is_unfinished);
}

INSTANTIATE_TEST_SUITE_P(Files, MessageFile,
                         testing::Values("joints_none.bag", "joints_bz2.bag", "joints_lz4.bag",
                                         "humble.db3", "iron.db3"),
                         [](const auto& file) {
                           return file.param.substr(0, file.param.find('.'));
                         });

LogTable table_of_bag(std::string_view bytes) {
  const auto source = bytes_in_memory(bytes, "test.bag");
  BagRecords records(*source, "test.bag", {.record_bytes = std::size_t{1} << 20});
  const std::vector<NamedMessages> files{{"test.bag", &records}};
  return table_of_messages(files, "test.bag");
}

TEST(Bag, IsReadUpToItsLastWholeRecordIfTheRecorderWasStopped) {
  const std::string whole = file_bytes(log_path("joints_none.bag"));
  const LogTable cut = table_of_bag(std::string_view(whole).substr(0, whole.size() * 6 / 10));
  ASSERT_LT(cut.rows(), kSamples);
  ASSERT_GT(cut.rows(), kSamples / 4);
  for (std::size_t n = 0; n < cut.rows(); ++n)
    EXPECT_NEAR(cut.find("/joint_states/elbow/position")->values[n], q(n), 1e-15);
}

TEST(Bag, AnyChangedByteIsAnErrorOrAnotherNumber) {
  const std::string whole = file_bytes(log_path("joints_lz4.bag"));
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 41) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x55);
    try {
      EXPECT_GT(table_of_bag(changed).rows(), 0U);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 10U);
}

TEST(Bag, NamesThePlaceOfWhatIsWrong) {
  EXPECT_THAT(error_message([] { (void)table_of_bag("#ROSBAG V2.0\n"); }),
              HasSubstr("no messages"));
  EXPECT_THAT(error_message([] { (void)table_of_bag("#ROSBAG V1.2\n...."); }),
              HasSubstr("version 2.0"));
  const std::string huge = std::string("#ROSBAG V2.0\n") + "\xff\xff\xff\x7f";
  EXPECT_THAT(error_message([&] { (void)table_of_bag(huge); }),
              HasSubstr("a record of 2147483647"));
}

TEST(Db3, RefusesOtherDatabasesAndDamagedOnes) {
  const TemporaryFolder folder;
  const std::string whole = file_bytes(log_path("iron.db3"));
  std::ofstream(folder.path("cut.db3"), std::ios::binary) << whole.substr(0, whole.size() / 3);
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("cut.db3")); }),
              HasSubstr("a database of rosbag2"));
  std::string other = whole;
  for (std::size_t at = other.find("topics"); at != std::string::npos; at = other.find("topics"))
    other.replace(at, 6, "tropes");
  std::ofstream(folder.path("other.db3"), std::ios::binary) << other;
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("other.db3")); }),
              HasSubstr("no tables 'topics' and 'messages'"));
}

TEST(Db3, PackedFilesAreReadAlsoWithALogOfChanges) {
  const TemporaryFolder folder;
  std::string whole = file_bytes(log_path("iron.db3"));
  whole[18] = whole[19] = 2;  // journal_mode=WAL, as rosbag2 writes
  std::ofstream(folder.path("run_0.db3.zstd"), std::ios::binary) << packed_by_zstd(whole);
  expect_sine(read_log(folder.path("run_0.db3.zstd")).find("/joint_states/elbow/position")->values,
              1.0, 1e-12);
  // The folder, whose metadata have the name before or after it was packed.
  for (const char* name : {"run_0.db3", "run_0.db3.zstd"}) {
    std::ofstream(folder.path("metadata.yaml"))
        << "rosbag2_bagfile_information:\n  compression_format: zstd\n  compression_mode: FILE\n"
           "  relative_file_paths:\n    - "
        << name << "\n";
    EXPECT_EQ(read_log(folder.path("")).rows(), kSamples);
  }
  const std::string packed = file_bytes(folder.path("run_0.db3.zstd"));
  std::ofstream(folder.path("cut.db3.zstd"), std::ios::binary)
      << packed.substr(0, packed.size() / 2);
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("cut.db3.zstd")); }),
              HasSubstr("truncated"));
}

class ArrayFile : public testing::TestWithParam<std::string> {};

TEST_P(ArrayFile, HasItsRealNumbersAsColumns) {
  const LogTable table = read_log(log_path(GetParam()));
  expect_sine(table.find("q")->values, 1.0, 1e-15);
  expect_sine(table.find("tau")->values, 20.0, 1e-5);  // single precision
  for (const char* both : {"both", "both_f"}) {
    expect_sine(table.find(std::string(both) + "/0")->values, 1.0, 1e-15);
    expect_sine(table.find(std::string(both) + "/1")->values, 20.0, 1e-12);
  }
  EXPECT_EQ(table.find("count")->values[150], 150.0);
  EXPECT_EQ(table.find("is_on")->values[2], 1.0);
  EXPECT_EQ(table.find("gain"), nullptr);  // a single number
  EXPECT_EQ(table.find("z"), nullptr);     // complex
  const auto refused = [&](const std::string& name) {
    return error_message(
        [&] { (void)read_log(log_path(GetParam()), {.skip = {}, .wanted = {name}}); });
  };
  EXPECT_THAT(refused("z"), HasSubstr("the array is not read: complex numbers, '<c16'"));
  EXPECT_THAT(refused("qq"),
              testing::AllOf(HasSubstr("there is no array 'qq'"), HasSubstr("q (200)")));
}

INSTANTIATE_TEST_SUITE_P(Files, ArrayFile, testing::Values("arrays.npz", "packed.npz"),
                         [](const auto& file) {
                           return file.param.substr(0, file.param.find('.'));
                         });

TEST(Npz, HasTimesHalfPrecisionAndBigEndianNumbers) {
  const Recording recording = load_recordings(log_path("types.npz")).front();
  EXPECT_EQ(recording.sample_rate_Hz(), 200.0);
  EXPECT_NEAR(recording.time_s(0), 1744909208.0, 1e-6);
  expect_sine(recording.channel("q_rad").values, 1.0, 1e-15);
  expect_sine(recording.channel("torque_Nm").values, 20.0, 1e-5);
  expect_sine(recording.channel("half_Nm").values, 20.0, 1e-2);
  EXPECT_EQ(recording.channel("count_1").values[150], 150.0);
  EXPECT_THAT(recording.notes, testing::ElementsAre("the times in 'time' are the clock"));
  EXPECT_THAT(recording.not_read,
              testing::ElementsAre("z (complex numbers, '<c16')", "note (texts)",
                                   HasSubstr("wide (2 x 200; "), "cube (more than two dimensions)",
                                   "robot (objects of Python)", HasSubstr("log (structured")));
  // A channel that is missing may be one that was not read.
  EXPECT_THAT(error_message([&] { (void)recording.channel("tau_Nm"); }),
              HasSubstr("; not read: z (complex numbers"));
}

TEST(Npz, OfThreeDimensionsTheLongerOneIsTheTime) {
  const LogTable table = read_log(
      log_path("types.npz"),
      {.skip = {}, .wanted = {"deep/0", "deep/1", "deep_f/0", "deep_f/1", "rows/0", "rows/1"}});
  for (const char* name : {"deep", "deep_f", "rows"}) {
    expect_sine(table.find(std::string(name) + "/0")->values, 1.0, 1e-15);
    expect_sine(table.find(std::string(name) + "/1")->values, 20.0, 1e-12);
  }
}

TEST(Npz, HalfPrecisionHasItsWholeRange) {
  const TemporaryFolder folder;
  const auto values_of = [&](const std::string& type, const std::string& bytes) {
    const std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" +
                               std::to_string(bytes.size() / 2) + ",), }";
    OutputFile file(folder.path("x.npz"));
    ZipWriter archive(file);
    archive.add("x.npy", std::string("\x93NUMPY\1\0", 8) + static_cast<char>(header.size()) + '\0' +
                             header + bytes);
    archive.finish();
    file.commit();
    return read_log(folder.path("x.npz")).columns.front().values;
  };
  // 1, -2, 65504, 2^-14, 2^-24, not a number
  const std::string bytes("\x00\x3c\x00\xc0\xff\x7b\x00\x04\x01\x00\x01\x7e", 12);
  EXPECT_THAT(values_of("<f2", bytes),
              testing::ElementsAre(1.0, -2.0, 65504.0, std::ldexp(1.0, -14), std::ldexp(1.0, -24),
                                   testing::IsNan()));
  EXPECT_THAT(values_of(">u2", bytes), testing::Contains(0x003c));
  EXPECT_THAT(error_message([&] { (void)values_of("<f16", bytes); }),
              HasSubstr("x (numbers of type '<f16')"));
}

TEST(Npz, OtherArchivesAreNamedWithTheCommandThatReadsThem) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& member) {
    OutputFile file(folder.path("x.zip"));
    ZipWriter archive(file);
    archive.add(member, "text");
    archive.finish();
    file.commit();
    return error_message([&] { (void)read_log(folder.path("x.zip")); });
  };
  EXPECT_THAT(refused("run.csv"), HasSubstr("unzip "));
  EXPECT_THAT(refused("xl/workbook.xml"),
              testing::AllOf(HasSubstr("an Excel file"), HasSubstr("pandas.read_excel")));
}

TEST(Npz, AnyChangedByteIsAnErrorOrAnotherNumber) {
  const std::string whole = file_bytes(log_path("packed.npz"));
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 29) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x55);
    const auto source = bytes_in_memory(changed, "test.npz");
    try {
      (void)read_npz(*source, "test.npz");
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, whole.size() / 29 / 2);  // most of it has a checksum
}

struct MatFile {
  std::string file;
  std::string q;
  std::string tau;
};

class MatFiles : public testing::TestWithParam<MatFile> {};

TEST_P(MatFiles, HasItsArraysAndThoseOfStructures) {
  const auto& [file, q_name, tau_name] = GetParam();
  std::vector<std::string> wanted{q_name};
  if (!tau_name.empty()) wanted.push_back(tau_name);
  const LogTable table = read_log(log_path(file), {.skip = {}, .wanted = wanted});
  ASSERT_NE(table.find(q_name), nullptr);
  expect_sine(table.find(q_name)->values, 1.0, 1e-12);
  if (!tau_name.empty()) expect_sine(table.find(tau_name)->values, 20.0, 1e-5);
  EXPECT_NEAR(table.find("t_s")->values.back(), 0.995, 1e-12);  // its name has a unit
  EXPECT_EQ(table.source.sha256.size(), 64U);
}

INSTANTIATE_TEST_SUITE_P(Versions, MatFiles,
                         testing::Values(MatFile{"octave_v4.mat", "q", ""},
                                         MatFile{"octave_v6.mat", "log.q", "log.deep.tau"},
                                         MatFile{"octave_v7.mat", "log.q", "log.deep.tau"},
                                         MatFile{"matlab_v73.mat", "q", ""},
                                         MatFile{"scipy.mat", "log.q", "both/1"}),
                         [](const auto& file) {
                           return file.param.file.substr(0, file.param.file.find('.'));
                         });

TEST(Mat, OfThreeDimensionsTheLongerOneIsTheTime) {
  const LogTable table =
      read_log(log_path("dimensions.mat"),
               {.skip = {}, .wanted = {"deep.data/0", "deep.data/1", "deep.one/0"}});
  expect_sine(table.find("deep.data/0")->values, 1.0, 1e-15);
  expect_sine(table.find("deep.data/1")->values, 20.0, 1e-12);
  expect_sine(table.find("deep.one/0")->values, 20.0, 1e-12);  // its only column
}

TEST(Mat, ListsWhatItDoesNotReadWithTheReason) {
  const auto refused = [&](const std::vector<std::string>& wanted) {
    return error_message(
        [&] { (void)read_log(log_path("dimensions.mat"), {.skip = {}, .wanted = wanted}); });
  };
  EXPECT_THAT(
      read_log(log_path("dimensions.mat")).not_read,
      testing::ElementsAre("z (complex numbers)", "names (a cell array)", "note (a text)",
                           "cube (more than two dimensions)", HasSubstr("wide (2 x 200; ")));
  EXPECT_THAT(refused({"z"}), HasSubstr("the array is not read: z (complex numbers)"));
  EXPECT_THAT(refused({"zz"}),
              testing::AllOf(HasSubstr("there is no array 'zz'"), HasSubstr("not read: ")));
}

TEST(Mat, DamagedFilesAreErrorsAndNoCrash) {
  const TemporaryFolder folder;
  for (const char* name : {"octave_v7.mat", "matlab_v73.mat", "octave_v4.mat"}) {
    const std::string whole = file_bytes(log_path(name));
    for (std::size_t part = 1; part < 8; ++part) {
      std::string changed = whole.substr(0, whole.size() * part / 8);
      if (part % 2 == 0) changed[changed.size() / 2] ^= 0x55;
      std::ofstream(folder.path("cut.mat"), std::ios::binary) << changed;
      try {
        (void)read_mat(folder.path("cut.mat"));
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("cut.mat"));
      }
    }
  }
  std::ofstream(folder.path("text.mat")) << "t_s,q\n0,1\n";
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("text.mat")); }),
              HasSubstr("expected a MATLAB file"));
  EXPECT_THAT(error_message([&] {
                (void)read_log(log_path("octave_v7.mat"), {.skip = {}, .wanted = {"lag.q"}});
              }),
              HasSubstr("log.deep.tau (200)"));
}

TEST(ChildProcess, ACrashOfItsWorkIsAnError) {
  const auto run = [](auto work) {
    return error_message([&] { (void)output_of_child(work, "run.mat"); });
  };
  EXPECT_EQ(output_of_child([](int out) { return write_all(out, "abc", 3) ? std::string() : "no"; },
                            "run.mat")
                .bytes(),
            "abc");
  EXPECT_THAT(run([](int) -> std::string { std::abort(); }), HasSubstr("ended by signal 6"));
  EXPECT_THAT(run([](int) { return std::string("it is damaged"); }),
              HasSubstr("run.mat: it is damaged"));
  EXPECT_THROW((void)output_of_child(
                   [](int) {
                     while (true) {
                     }
                     return std::string();
                   },
                   "run.mat", [](double, std::string_view) { return false; }),
               Cancelled);
}

/// Two channels that need every bit, one of them slower, on a clock that does not begin at zero.
Recording two_channels() {
  Recording recording("example", 1000.0, -0.25);
  Channel angle{.name = "joint_angle_rad", .values = {}};
  Channel torque{.name = "torque_Nm", .values = {}};
  for (std::size_t n = 0; n < 70000; ++n) {  // several chunks of an MCAP file
    angle.values.push_back(q(n) / 3.0);
    torque.values.push_back(n % 8 == 0 ? std::nan("") : -q(n));
    torque.fresh.push_back(n % 8 == 1 ? 1 : 0);
  }
  recording.add(std::move(angle));
  recording.add(std::move(torque));
  return recording;
}

class WrittenFile : public testing::TestWithParam<std::string> {};

TEST_P(WrittenFile, ReadsBackBitByBit) {
  const TemporaryFolder folder;
  const std::string path = folder.path("run" + GetParam());
  const Recording written = two_channels();
  write_recording(written, path);
  const std::vector<Recording> read = load_recordings(path);
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].sample_rate_Hz(), written.sample_rate_Hz());
  EXPECT_EQ(read[0].time_s(0), written.time_s(0));
  EXPECT_EQ(read[0].name(), "run");
  ASSERT_EQ(read[0].channels().size(), written.channels().size());
  for (const Channel& channel : written.channels()) {
    const Channel& again = read[0].channel(channel.name);
    ASSERT_EQ(again.values.size(), channel.values.size());
    EXPECT_EQ(again.fresh, channel.fresh);
    for (std::size_t n = 0; n < channel.values.size(); ++n)
      ASSERT_TRUE(again.values[n] == channel.values[n] ||
                  (std::isnan(again.values[n]) && std::isnan(channel.values[n])));
  }
  const std::string bytes = file_bytes(path);
  write_recording(written, path);
  EXPECT_EQ(file_bytes(path), bytes);
}

TEST_P(WrittenFile, IsNotWrittenWithAnInfiniteValue) {
  const TemporaryFolder folder;
  Recording recording("example", 100.0);
  recording.add({.name = "torque_Nm", .values = {1.0, HUGE_VAL}});
  EXPECT_THAT(error_message([&] { write_recording(recording, folder.path("a" + GetParam())); }),
              HasSubstr("infinite"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("a" + GetParam())));
}

INSTANTIATE_TEST_SUITE_P(Formats, WrittenFile,
                         testing::Values(".csv", ".csv.gz", ".mcap", ".npz", ".mat"),
                         [](const auto& ending) {
                           std::string name = ending.param.substr(1);
                           for (char& c : name)
                             if (c == '.') c = '_';
                           return name;
                         });

TEST(WriteRecording, NamesThatAFormatCannotHaveAreRefused) {
  const TemporaryFolder folder;
  Recording recording("example", 100.0);
  recording.add({.name = "torque left_Nm", .values = {1.0, 2.0}});
  recording.add({.name = "Torque Left_Nm", .values = {3.0, 4.0}});
  EXPECT_THAT(error_message([&] { write_recording(recording, folder.path("a.mat")); }),
              testing::AllOf(HasSubstr("torque left_Nm"), HasSubstr("rename the channel")));
  write_recording(recording, folder.path("a.mcap"));  // fields that differ in their number
  const Recording again = load_recordings(folder.path("a.mcap")).front();
  EXPECT_EQ(again.channel("torque left_Nm").values[1], 2.0);
  EXPECT_EQ(again.channel("Torque Left_Nm").values[1], 4.0);
}

constexpr const char* kTwoJoints = R"(
joints: {upper: {side: elbow, ratio: 2}, lower: {side: wrist, ratio: 1/4}}
channels:
  joint_angle_rad: "/joint_states/{side}/position"
  motor_angle_rad: {from: "/joint_states/{side}/position", gear_ratio: "{ratio}"}
  torque_Nm: {from: "/joint_states/{side}/effort", gear_ratio: "{ratio}"}
clock: {rebuild: true}
)";

TEST(JointsOfAMapping, ReplaceThePlaceholdersOfItsNames) {
  const Mapping lower = parse_mapping(kTwoJoints, "map.yaml", "lower");
  EXPECT_EQ(lower.channels[0].from, "/joint_states/wrist/position");
  EXPECT_EQ(lower.channels[1].gear_ratio, 0.25);
  EXPECT_EQ(parse_mapping(mapping_text(lower), "card").channels[2].gear_ratio, 0.25);
  const auto chosen = [](const char* text, const std::string& joint) {
    return error_message([&] { (void)parse_mapping(text, "map.yaml", joint); });
  };
  EXPECT_THAT(chosen(kTwoJoints, ""),
              testing::AllOf(HasSubstr("upper, lower"), HasSubstr("--joint")));
  EXPECT_THAT(chosen(kTwoJoints, "uper"), HasSubstr("Did you mean 'upper'"));
  EXPECT_THAT(chosen("channels: {torque_Nm: tau}", "upper"), HasSubstr("no joints to choose from"));
  EXPECT_THAT(chosen("joints: {a: {m: 1}, b: {n: 1}}", "a"),
              HasSubstr("the key 'm', as other joints"));
  EXPECT_THAT(chosen("joints: []", "a"), HasSubstr("at least one joint"));
  EXPECT_EQ(parse_mapping("channels: {torque_Nm: 'tau_{joint}'}", "m", "knee").channels[0].from,
            "tau_knee");
  EXPECT_THAT(chosen("channels: {torque_Nm: 'tau_{joint}'}", ""), HasSubstr("--joint NAME"));
}

TEST(JointsOfAMapping, MakeTheRecordingOfEachFromOneFile) {
  const TemporaryFolder folder;
  LoadOptions options;
  options.mapping = folder.file("arm.yaml", kTwoJoints);
  EXPECT_THAT(joints_of_mapping(*options.mapping), testing::ElementsAre("upper", "lower"));
  for (const auto& [joint, sign, ratio] :
       {std::tuple{"upper", 1.0, 2.0}, std::tuple{"lower", -1.0, 0.25}}) {
    options.joint = joint;
    const Recording recording = load_recordings(log_path("joints_bz2.bag"), options).front();
    expect_sine(recording.channel("joint_angle_rad").values, sign, 1e-12);
    expect_sine(recording.channel("motor_angle_rad").values, sign / ratio, 1e-12);
    expect_sine(recording.channel("torque_Nm").values, 20.0 * sign * ratio, 1e-12);
  }
}

TEST(GearRatio, ActsOnAnglesRatesAndTorquesOnly) {
  const auto refused = [](const std::string& rule) {
    return error_message([&] { (void)parse_mapping("channels: {" + rule + "}", "map.yaml"); });
  };
  EXPECT_THAT(refused("i_A: {from: i, gear_ratio: 100}"),
              HasSubstr("angles, their rates and torques"));
  EXPECT_THAT(refused("q_rad: {from: q, gear_ratio: -1}"), HasSubstr("a positive number"));
  EXPECT_EQ(refused("q_deg: {from: q, gear_ratio: 1/150}"), "");
}

TEST(ReadyMappings, ArePresentAndValid) {
  const std::vector<std::string> names = ready_mapping_names();
  EXPECT_THAT(names, testing::ElementsAre("cycloidal_drive", "desr_foot", "icub_joint",
                                          "ros2_control_joint"));
  for (const std::string& name : names) {
    std::string joint;
    try {
      (void)read_mapping(name);
    } catch (const UsageError&) {
      joint = "knee";
    }
    EXPECT_FALSE(read_mapping(name, {}, joint).channels.empty()) << name;
  }
  LoadOptions options;
  options.mapping = "ros2_control_joint";
  options.joint = "elbow";
  EXPECT_THAT(error_message([&] { (void)load_recordings(log_path("iron.db3"), options); }),
              HasSubstr("velocity"));  // this robot publishes none
  EXPECT_THAT(error_message([] { (void)read_mapping("ros2_contrl_joint"); }),
              HasSubstr("ros2_contrl_joint"));
}

}  // namespace
}  // namespace torsio
