#include "realtime/block_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {

BlockFile::BlockFile(const std::filesystem::path& path)
    : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (descriptor_ >= 0) return;
  const int code = errno;
  throw Error({.place = path.string(),
               .problem = "cannot record into it: " + std::generic_category().message(code),
               .advice = code == EEXIST ? "A recorder replaces no file: name another one." : ""});
}

BlockFile::~BlockFile() { close(); }

void BlockFile::note(int code) { trouble_ = std::generic_category().message(code); }

bool BlockFile::append(std::span<const std::byte> block) {
  std::int64_t at = size_;
  while (!block.empty()) {
    const ssize_t written = ::pwrite(descriptor_, block.data(), block.size(), at);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      note(errno);
      if (::ftruncate(descriptor_, size_) != 0) note(errno);
      return false;
    }
    at += written;
    block = block.subspan(static_cast<std::size_t>(written));
  }
  size_ = at;
  return true;
}

bool BlockFile::sync() {
  if (::fdatasync(descriptor_) == 0) return true;
  note(errno);
  return false;
}

void BlockFile::close() {
  if (descriptor_ < 0) return;
  (void)sync();
  if (::close(std::exchange(descriptor_, -1)) != 0) note(errno);
}

}  // namespace torsio
