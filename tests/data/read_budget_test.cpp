#include "data/read_budget.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "data/arrays/mat.hpp"
#include "data/csv/csv_table.hpp"
#include "data/db3/db3_messages.hpp"
#include "data/mcap_bytes.hpp"
#include "data/packed_by_zstd.hpp"
#include "data/read_log.hpp"
#include "data/ros/message_topics.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/gzipped.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::file_with;
using test::packed_by_zstd;
using testing::HasSubstr;

std::string refusal(const std::string& bytes) {
  return error_message([&] {
    const auto source = bytes_in_memory(bytes, "test.mcap");
    McapRecords records(*source, "test.mcap");
    const std::vector<NamedMessages> files{{"test.mcap", &records}};
    (void)table_of_messages(files, "test.mcap");
  });
}

TEST(ReadBudget, GrowsWithTheFile) {
  ReadBudget budget("run.mcap");
  budget.keep(ReadBudget::kMemory);
  EXPECT_THAT(error_message([&] { budget.keep(1); }), HasSubstr("run.mcap: its 0 bytes describe"));
  budget.read_to(1);
  budget.keep(ReadBudget::kMemoryPerByte);
  EXPECT_THROW(budget.require(1), Error);
  EXPECT_THROW(budget.work(2 * ReadBudget::kWork), Error);
}

TEST(ReadBudget, StopsOnRequest) {
  ReadBudget budget("run.mcap", [](double, std::string_view) { return false; });
  EXPECT_THROW(budget.work(1), Cancelled);
}

// Arrays of messages without fields take no bytes, whatever their size.
TEST(ReadBudget, EndsArraysOfNothing) {
  std::string definition = "p/T1[100] a\n";
  for (int depth = 1; depth < 8; ++depth)
    definition +=
        "===\nMSG: p/T" + std::to_string(depth) + "\np/T" + std::to_string(depth + 1) + "[100] a\n";
  definition += "===\nMSG: p/T8\n";
  const std::string cdr = std::string("\0\1\0\0", 4) + std::string(200, '\0');
  EXPECT_THAT(refusal(file_with("ros2msg", definition, "cdr", cdr)),
              HasSubstr("bytes describe more"));
}

TEST(ReadBudget, EndsManyRowsThatGetManyColumns) {
  std::string file = std::string(kMcapMark) + test::channel(1, 0, "/a", "json");
  constexpr int kRows = 40000;
  for (int row = 0; row < kRows; ++row) file += test::message(1, row, "{}");
  std::string last = "{\"k\":0";
  for (int column = 0; column < 12000; ++column) last += ",\"k" + std::to_string(column) + "\":1";
  file += test::message(1, kRows, last + "}");
  EXPECT_THAT(refusal(file), HasSubstr("of memory"));
}

TEST(ReadBudget, RefusesJsonThatIsNestedTooDeeply) {
  const std::string deep = std::string(20000, '[') + "1" + std::string(20000, ']');
  EXPECT_THAT(refusal(file_with("jsonschema", "", "json", deep)), HasSubstr("expected json"));
}

TEST(ReadBudget, EndsAPackedTableOfFewBytes) {
  constexpr std::size_t kRows = 5 << 20;
  std::string text = "a_Nm,b_Nm,c_Nm,d_Nm,e_Nm,f_Nm,g_Nm,h_Nm\n";
  for (std::size_t row = 0; row < kRows; ++row) text += "1,1,1,1,1,1,1,1\n";
  EXPECT_THAT(error_message([&] { (void)parse_csv(test::gzipped(text), "log.csv.gz"); }),
              HasSubstr("of memory"));
}

// Many zeros in a small frame.
TEST(ReadBudget, EndsPackedMessagesAndFilesOfFewBytes) {
  std::string large = std::string("\0\1\0\0", 4) + std::string(std::size_t{300} << 20, '\0');
  EXPECT_THAT(refusal(file_with("ros2msg", "float64 x", "cdr", packed_by_zstd(large))),
              HasSubstr("that zstd packed is damaged"));
  large.replace(0, kDb3Mark.size(), kDb3Mark);
  const TemporaryFolder folder;
  std::ofstream(folder.path("run.db3.zstd"), std::ios::binary) << packed_by_zstd(large);
  EXPECT_THAT(error_message([&] { (void)read_log(folder.path("run.db3.zstd")); }),
              HasSubstr("of memory"));
}

// Each message has a field of its own.
TEST(ReadBudget, EndsMessagesThatAllDiffer) {
  std::string file = std::string(kMcapMark) + test::channel(1, 0, "/a", "json");
  for (int row = 0; row < 30000; ++row)
    file += test::message(1, row, "{\"k" + std::to_string(row) + "\":1}");
  EXPECT_THAT(refusal(file), HasSubstr("of memory"));
}

TEST(ReadBudget, AZeroAfterTheRecordsIsAnError) {
  EXPECT_THAT(refusal(file_with("jsonschema", "", "json", "{\"x\":1}") + std::string(900, '\0')),
              HasSubstr("a record without a kind"));
}

TEST(ReadBudget, PipesAndDevicesAreRefusedWhereAFileIsNeeded) {
  EXPECT_THAT(error_message([] { (void)read_log("/dev/zero"); }), HasSubstr("found a device"));
}

/// The values of all arrays of a file, or nothing if it is refused.
std::vector<NamedArray> arrays_of(const std::string& path) {
  try {
    return read_mat(path).arrays;
  } catch (const Error&) {
    return {};
  }
}

// Version 7 has a checksum for each variable, which libmatio does not compare.
TEST(MatVerification, NoChangedByteOfAPackedFileGivesOtherNumbers) {
  const TemporaryFolder folder;
  const std::string whole = test::file_bytes(TORSIO_LOG_FILES "/octave_v7.mat");
  const std::vector<NamedArray> right = read_mat(TORSIO_LOG_FILES "/octave_v7.mat").arrays;
  constexpr std::size_t kHeader = 128;
  std::size_t refused = 0;
  for (std::size_t at = kHeader; at < whole.size(); at += 61) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    std::ofstream(folder.path("x.mat"), std::ios::binary) << changed;
    const std::vector<NamedArray> found = arrays_of(folder.path("x.mat"));
    refused += found.empty() ? 1 : 0;
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_EQ(found[i].values, right.at(i).values) << at;
  }
  EXPECT_GT(refused, whole.size() / 61 / 2);
}

TEST(MatVerification, EveryCutIsAnError) {
  const TemporaryFolder folder;
  for (const char* name : {"octave_v4.mat", "octave_v6.mat", "octave_v7.mat"}) {
    const std::string whole = test::file_bytes(std::string(TORSIO_LOG_FILES "/") + name);
    for (std::size_t part = 1; part < 20; ++part) {
      std::ofstream(folder.path("x.mat"), std::ios::binary)
          << whole.substr(0, whole.size() * part / 20);
      EXPECT_TRUE(arrays_of(folder.path("x.mat")).empty()) << name << " " << part;
    }
  }
}

}  // namespace
}  // namespace torsio
