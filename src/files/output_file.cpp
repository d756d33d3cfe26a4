#include "files/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstring>
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

/// The names of the temporary files, where a signal handler can read them: it may neither allocate
/// nor lock, and it may interrupt any line. More files than places are not removed by it.
class UnfinishedFiles {
 public:
  void add(const fs::path& name) noexcept {
    const std::size_t size = std::strlen(name.c_str()) + 1;
    for (Place& place : places_) {
      State expected = State::free;
      if (size > place.name.size() ||
          !place.state.compare_exchange_strong(expected, State::changing))
        continue;
      std::memcpy(place.name.data(), name.c_str(), size);
      place.state = State::named;
      return;
    }
  }
  void drop(const fs::path& name) noexcept {
    for (Place& place : places_) {
      if (place.state != State::named || std::strcmp(place.name.data(), name.c_str()) != 0)
        continue;
      place.state = State::free;
      return;
    }
  }
  void remove() noexcept {
    for (Place& place : places_)
      if (place.state == State::named) ::unlink(place.name.data());
  }

 private:
  enum class State : std::uint8_t { free, changing, named };
  struct Place {
    std::atomic<State> state{State::free};
    std::array<char, PATH_MAX> name{};
  };
  static_assert(std::atomic<State>::is_always_lock_free);

  std::array<Place, 8> places_;
};

constinit UnfinishedFiles unfinished;

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
    do {  // a pipe without a reader waits for one
      descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    } while (descriptor_ < 0 && errno == EINTR);
  } else {
    target_ = target_of(path);
    if (is_protected(target_)) {
      errno = EACCES;
      refuse();
    }
    temporary_ = temporary_name(target_);
    unfinished.add(temporary_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0 && fs::exists(status))
      ::fchmod(descriptor_, static_cast<::mode_t>(status.permissions()));
  }
  if (descriptor_ < 0) {
    unfinished.drop(temporary_);
    refuse();
  }
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  unfinished.drop(temporary_);
}

void OutputFile::remove_unfinished() noexcept { unfinished.remove(); }

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
  unfinished.drop(temporary_);
  temporary_.clear();
  sync_folder(target_.parent_path());
}

}  // namespace torsio
