#include "files/output_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::HasSubstr;

void write(OutputFile& file, std::string_view text) { file.write(std::as_bytes(std::span(text))); }

TEST(OutputFile, HasItsNameOnlyAfterCommit) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a", "old");
  OutputFile file(path);
  write(file, "one ");
  write(file, "two");
  EXPECT_EQ(test::file_bytes(path), "old");
  file.commit();
  EXPECT_EQ(test::file_bytes(path), "one two");
  EXPECT_EQ(folder.files(), 1U);
}

TEST(OutputFile, LeavesNothingWithoutCommit) {
  const TemporaryFolder folder;
  {
    OutputFile file(folder.path("a"));
    write(file, "half");
  }
  EXPECT_EQ(folder.files(), 0U);
}

TEST(OutputFile, CanBeRemovedFromASignalHandler) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a", "old");
  OutputFile committed(folder.path("b"));
  committed.commit();
  OutputFile unfinished(path);
  OutputFile other(folder.path("c"));
  write(unfinished, "half");
  EXPECT_EQ(folder.files(), 4U);
  OutputFile::remove_unfinished();
  EXPECT_EQ(folder.files(), 2U);
  EXPECT_EQ(test::file_bytes(path), "old");
}

TEST(OutputFile, WritesTheFileThatADanglingLinkNames) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("target", folder.path("link"));
  OutputFile file(folder.path("link"));
  write(file, "text");
  file.commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("link")));
  EXPECT_EQ(test::file_bytes(folder.path("target")), "text");
}

TEST(OutputFile, KeepsTheModeOfTheFileThatItReplaces) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a", "old");
  constexpr auto kMode = std::filesystem::perms{0640};
  std::filesystem::permissions(path, kMode);
  OutputFile file(path);
  write(file, "new");
  file.commit();
  EXPECT_EQ(test::file_bytes(path), "new");
  EXPECT_EQ(std::filesystem::status(path).permissions(), kMode);
}

TEST(OutputFile, DoesNotReplaceAReadOnlyFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a", "old");
  std::filesystem::permissions(path, std::filesystem::perms{0444});
  EXPECT_THAT(error_message([&] { const OutputFile file(path); }), HasSubstr("Permission denied"));
  EXPECT_EQ(test::file_bytes(path), "old");
  EXPECT_EQ(folder.files(), 1U);
}

TEST(OutputFile, TwoOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  OutputFile first(folder.path("a"));
  OutputFile second(folder.path("a"));
  write(first, "first");
  write(second, "second");
  second.commit();
  first.commit();
  EXPECT_EQ(test::file_bytes(folder.path("a")), "first");
  EXPECT_EQ(folder.files(), 1U);
}

TEST(OutputFile, WritesStraightIntoADeviceOrPipeThroughALink) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  // A link to a link of the kernel's to "pipe:[1234]", which is not a name.
  const TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/fd/" + std::to_string(ends[1]), folder.path("link"));
  {
    OutputFile file(folder.path("link"));
    write(file, "straight");
    file.commit();
  }
  close(ends[1]);
  std::string text(20, ' ');
  text.resize(static_cast<std::size_t>(::read(ends[0], text.data(), text.size())));
  close(ends[0]);
  EXPECT_EQ(text, "straight");
  EXPECT_EQ(folder.files(), 1U);
}

TEST(OutputFile, SaysWhyADeviceOrFolderCannotBeWritten) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_message([] {
                OutputFile full("/dev/full");
                write(full, "x");
              }),
              HasSubstr("/dev/full: cannot write: No space left on device"));
  EXPECT_THAT(error_message([&] { const OutputFile directory(folder.path("")); }),
              HasSubstr("cannot write: Is a directory"));
}

}  // namespace
}  // namespace torsio
