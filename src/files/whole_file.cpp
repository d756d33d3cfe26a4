#include "files/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "files/output_file.hpp"
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
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }

  [[nodiscard]] int number() const noexcept { return number_; }

 private:
  int number_;
};

}  // namespace

std::vector<std::byte> read_whole_file(const fs::path& path, std::size_t max_bytes) {
  // Without O_NONBLOCK, opening a pipe would wait for its writer.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) refuse(path, "cannot open", errno);
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) refuse(path, "cannot open", errno);
  if (!S_ISREG(status.st_mode)) refuse_kind(path);
  if (std::cmp_greater(status.st_size, max_bytes))
    throw Error({.place = path.string(),
                 .expected = fmt::format("at most {} bytes", max_bytes),
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
  if (fs::exists(path, code) && !fs::is_regular_file(path, code)) refuse_kind(path);
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace torsio
