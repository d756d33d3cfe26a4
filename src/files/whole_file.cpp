#include "torsio/files/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, std::string_view doing, int code) {
  throw Error({.place = path.string(),
               .problem = fmt::format("{}: {}", doing, std::generic_category().message(code))});
}

[[noreturn]] void refuse_kind(const fs::path& path) {
  throw Error({.place = path.string(),
               .expected = "a regular file",
               .found = fs::is_directory(path) ? "a directory" : "a device, pipe or socket"});
}

/// An open file that is closed on every way out.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }

  [[nodiscard]] int number() const noexcept { return number_; }
  /// @returns false if the system had kept an error until now.
  bool close() noexcept { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

/// A file that does not outlive a failure.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path) : path_(std::move(path)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  void keep() noexcept { path_.clear(); }

 private:
  fs::path path_;
};

fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> count{0};
  return target.parent_path() /
         fmt::format(".{}.{}-{}.tmp", target.filename().string(), ::getpid(), count++);
}

/// Tells the folder's storage about the new name. Not every file system can; the data is safe
/// already.
void sync_folder(const fs::path& folder) {
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.number() >= 0) ::fsync(opened.number());
}

void write_all(int file, std::span<const std::byte> bytes, const fs::path& target) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) refuse(target, "cannot write", errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

}  // namespace

std::vector<std::byte> read_whole_file(const fs::path& path, std::size_t most_bytes) {
  // Without O_NONBLOCK, opening a pipe would wait for its writer.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) refuse(path, "cannot open", errno);
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) refuse(path, "cannot open", errno);
  if (!S_ISREG(status.st_mode)) refuse_kind(path);
  if (std::cmp_greater(status.st_size, most_bytes))
    throw Error({.place = path.string(),
                 .expected = fmt::format("at most {} bytes", most_bytes),
                 .found = fmt::format("{}", status.st_size)});
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t got = ::read(file.number(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) refuse(path, "cannot read", errno);
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

void write_whole_file(const fs::path& path, std::span<const std::byte> bytes) {
  std::error_code code;
  const fs::path target = fs::is_symlink(path, code) ? fs::weakly_canonical(path) : path;
  if (fs::exists(target, code) && !fs::is_regular_file(target, code)) refuse_kind(target);
  const fs::path temporary = temporary_name(target);
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) refuse(path, "cannot write", errno);
  TemporaryFile unfinished(temporary);
  write_all(file.number(), bytes, path);
  if (::fsync(file.number()) != 0 || !file.close()) refuse(path, "cannot write", errno);
  if (::rename(temporary.c_str(), target.c_str()) != 0) refuse(path, "cannot write", errno);
  unfinished.keep();
  sync_folder(target.parent_path());
}

}  // namespace torsio
