#include "torsio/files/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;

fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> count{0};
  return target.parent_path() /
         fmt::format(".{}.{}-{}.tmp", target.filename().string(), ::getpid(), count++);
}

/// Writes the folder's entry of the new name to storage. Not every file system can; the data is
/// safe already.
void sync_folder(const fs::path& folder) {
  const int opened =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return;
  ::fsync(opened);
  ::close(opened);
}

}  // namespace

OutputFile::OutputFile(fs::path place, int descriptor)
    : place_(std::move(place)), descriptor_(descriptor) {
  if (descriptor_ < 0) refuse();
}

fs::path OutputFile::target_of(fs::path path) {
  constexpr int kMaxLinks = 40;  // as the kernel
  std::error_code code;
  for (int k = 0; k < kMaxLinks && fs::is_symlink(path, code); ++k)
    path = path.parent_path() / fs::read_symlink(path, code);
  return path;
}

bool OutputFile::is_protected(const fs::path& target) {
  std::error_code code;
  const fs::file_status status = fs::status(target, code);
  constexpr fs::perms kWrite =
      fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
  // root may write every file, whatever its mode is.
  return fs::is_regular_file(status) && ((status.permissions() & kWrite) == fs::perms::none ||
                                         ::access(target.c_str(), W_OK) != 0);
}

OutputFile OutputFile::standard_output() { return {"standard output", ::dup(STDOUT_FILENO)}; }

OutputFile::OutputFile(const fs::path& path) : place_(path) {
  // The target of a link such as /dev/stdout may have no name ("pipe:[1234]"): the kernel follows
  // it.
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (path == "/dev/stdout") {
    descriptor_ = ::dup(STDOUT_FILENO);  // opened anew, a file would begin at its start
  } else if (fs::exists(status) && !fs::is_regular_file(status)) {
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    target_ = target_of(path);
    if (is_protected(target_)) {
      errno = EACCES;
      refuse();
    }
    temporary_ = temporary_name(target_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0 && fs::exists(status))
      ::fchmod(descriptor_, static_cast<::mode_t>(status.permissions()));
  }
  if (descriptor_ < 0) refuse();
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::refuse() const {
  const int code = errno;
  throw Error({.place = place_.string(),
               .problem = "cannot write: " + std::generic_category().message(code)});
}

void OutputFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) refuse();
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void OutputFile::commit() {
  const bool renames = !temporary_.empty();
  if (renames && ::fsync(descriptor_) != 0) refuse();
  if (::close(std::exchange(descriptor_, -1)) != 0) refuse();
  if (!renames) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) refuse();
  temporary_.clear();
  sync_folder(target_.parent_path());
}

}  // namespace torsio
