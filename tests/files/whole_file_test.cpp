#include "files/whole_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <string>

#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::HasSubstr;

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(WholeFile, ReplacesItsTargetAndLeavesNothingBeside) {
  const TemporaryFolder folder;
  write_whole_file(folder.path("a"), bytes_of("old and long"));
  write_whole_file(folder.path("a"), bytes_of("new"));
  EXPECT_EQ(read_whole_file(folder.path("a"), 3), bytes_of("new"));
  EXPECT_EQ(folder.files(), 1U);
}

TEST(WholeFile, KeepsASymbolicLink) {
  const TemporaryFolder folder;
  write_whole_file(folder.path("a"), bytes_of("old"));
  std::filesystem::create_symlink("a", folder.path("link"));
  write_whole_file(folder.path("link"), bytes_of("new"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("link")));
  EXPECT_EQ(read_whole_file(folder.path("a"), 100), bytes_of("new"));
}

TEST(WholeFile, LeavesItsTargetUntouchedWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  write_whole_file(folder.path("a"), bytes_of("old"));
  // A limit on the size of files fails a write half-way, as a full disk does.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{.rlim_cur = 100, .rlim_max = before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message =
      error_message([&] { write_whole_file(folder.path("a"), bytes_of(std::string(1000, 'x'))); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  (void)std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr("/a: cannot write: File too large"));
  EXPECT_EQ(read_whole_file(folder.path("a"), 100), bytes_of("old"));
  EXPECT_EQ(folder.files(), 1U);
}

TEST(WholeFile, SaysWhyItCannotBeWritten) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_message([&] { write_whole_file(folder.path("no/a"), {}); }),
              HasSubstr("no/a: cannot write: No such file or directory"));
  EXPECT_THAT(error_message([&] { write_whole_file(folder.path(""), {}); }),
              HasSubstr("expected a regular file, found a directory"));
  EXPECT_THAT(error_message([] { write_whole_file("/dev/null", {}); }),
              HasSubstr("/dev/null: expected a regular file, found a device, pipe or socket"));
}

TEST(WholeFile, SaysWhyItCannotBeRead) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_message([&] { (void)read_whole_file(folder.path("none"), 10); }),
              HasSubstr("none: cannot open: No such file or directory"));
  EXPECT_THAT(error_message([&] { (void)read_whole_file(folder.path(""), 10); }),
              HasSubstr("expected a regular file, found a directory"));
  write_whole_file(folder.path("a"), bytes_of("abcd"));
  EXPECT_THAT(error_message([&] { (void)read_whole_file(folder.path("a"), 3); }),
              HasSubstr("a: expected at most 3 bytes, found 4"));
}

TEST(WholeFile, DoesNotWaitForAPipe) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  EXPECT_THAT(error_message([&] { (void)read_whole_file(folder.path("pipe"), 10); }),
              HasSubstr("pipe: expected a regular file, found a device, pipe or socket"));
}

}  // namespace
}  // namespace torsio
