#include "data/byte_source.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 16;

std::string system_message(int code) { return std::generic_category().message(code); }

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1)
      throw Error({.problem = "OpenSSL offers no SHA-256"});
  }
  void add(const char* bytes, std::size_t size) { EVP_DigestUpdate(context_.get(), bytes, size); }
  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    std::string text;
    for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest.at(i));
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

class FileBytes final : public ByteSource {
 public:
  FileBytes(std::string path, Progress progress)
      : path_(std::move(path)), progress_(std::move(progress)) {
    int code = 0;
    do {
      report();
      descriptor_ = path_ == "-" ? dup(STDIN_FILENO) : open(path_.c_str(), O_RDONLY | O_CLOEXEC);
      code = errno;
    } while (descriptor_ < 0 && code == EINTR);
    if (descriptor_ < 0)
      throw Error({.place = path_,
                   .problem = "cannot be opened: " + system_message(code),
                   .advice = code == ENOENT ? "Check the path; '-' reads standard input." : ""});
    struct stat info {};
    const bool is_known = fstat(descriptor_, &info) == 0;
    if (is_known && S_ISREG(info.st_mode)) bytes_ = static_cast<double>(info.st_size);
    if (is_known && is_endless(info)) {
      close(descriptor_);
      throw Error({.place = path_, .expected = "a file or a pipe", .found = "a device"});
    }
    if (is_known && S_ISDIR(info.st_mode)) {
      close(descriptor_);
      throw Error({.place = path_,
                   .expected = "a file",
                   .found = "a directory",
                   .advice = "Name the files in it, or a dataset manifest (.yaml)."});
    }
  }
  ~FileBytes() override { close(descriptor_); }
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  std::size_t read(char* out, std::size_t size) override {
    ssize_t got = 0;
    do {
      report();
      got = ::read(descriptor_, out, size);
    } while (got < 0 && errno == EINTR);
    if (got < 0)
      throw Error({.place = path_, .problem = "cannot be read: " + system_message(errno)});
    sha_.add(out, static_cast<std::size_t>(got));
    read_ += static_cast<double>(got);
    return static_cast<std::size_t>(got);
  }
  std::string sha256() override { return sha_.hex(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override {
    return static_cast<std::uint64_t>(read_);
  }

 private:
  /// A device that is neither a terminal nor the empty one may give bytes without end.
  [[nodiscard]] bool is_endless(const struct stat& info) const noexcept {
    if (S_ISBLK(info.st_mode)) return true;
    return S_ISCHR(info.st_mode) && isatty(descriptor_) == 0 &&
           info.st_rdev != makedev(kEmptyMajor, kEmptyMinor);
  }
  static constexpr unsigned kEmptyMajor = 1;
  static constexpr unsigned kEmptyMinor = 3;

  void report() const {
    report_progress(progress_, bytes_ > 0.0 ? std::min(read_ / bytes_, 1.0) : 0.0, "reading");
  }

  std::string path_;
  Progress progress_;
  int descriptor_ = -1;
  double bytes_ = 0.0;  ///< 0 of a pipe
  double read_ = 0.0;
  Sha256 sha_;
};

class MemoryBytes final : public ByteSource {
 public:
  explicit MemoryBytes(std::string_view bytes) : bytes_(bytes) {}
  std::size_t read(char* out, std::size_t size) override {
    const std::size_t count = std::min(size, bytes_.size());
    std::copy_n(bytes_.data(), count, out);
    sha_.add(out, count);
    bytes_.remove_prefix(count);
    read_ += count;
    return count;
  }
  std::string sha256() override { return sha_.hex(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return read_; }

 private:
  std::string_view bytes_;
  std::uint64_t read_ = 0;
  Sha256 sha_;
};

/// Looks at the first bytes and unpacks what follows if they are those of gzip or zstd.
class MaybePacked final : public ByteSource {
 public:
  MaybePacked(std::unique_ptr<ByteSource> packed, std::string name)
      : packed_(std::move(packed)), name_(std::move(name)), input_(kChunk) {
    while (filled_ < kZstdMark.size()) {
      const std::size_t got = packed_->read(input_.data() + filled_, input_.size() - filled_);
      if (got == 0) break;
      filled_ += got;
    }
    const std::string_view start(input_.data(), filled_);
    gzip_ = start.starts_with("\x1f\x8b");
    constexpr int kGzipOnly = 16 + MAX_WBITS;
    if (gzip_ && inflateInit2(&stream_, kGzipOnly) != Z_OK)
      throw Error({.place = name_, .problem = "zlib cannot start"});
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = static_cast<uInt>(filled_);
    if (start.starts_with(kZstdMark)) zstd_.reset(ZSTD_createDCtx());
    zstd_input_ = {input_.data(), filled_, 0};
  }
  ~MaybePacked() override {
    if (gzip_) inflateEnd(&stream_);
  }
  MaybePacked(const MaybePacked&) = delete;
  MaybePacked& operator=(const MaybePacked&) = delete;

  std::size_t read(char* out, std::size_t size) override {
    if (zstd_) return unpack_zstd(out, size);
    return gzip_ ? unpack(out, size) : pass(out, size);
  }
  std::string sha256() override { return packed_->sha256(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return packed_->bytes_read(); }

 private:
  std::size_t pass(char* out, std::size_t size) {
    if (handed_ == filled_) return packed_->read(out, size);
    const std::size_t count = std::min(size, filled_ - handed_);
    std::copy_n(input_.data() + handed_, count, out);
    handed_ += count;
    return count;
  }

  std::size_t unpack(char* out, std::size_t size) {
    const auto wanted = static_cast<uInt>(std::min(size, kChunk));
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = wanted;
    while (stream_.avail_out == wanted) {
      if (stream_.avail_in == 0 && !refill()) {
        if (inside_member_) fail("it ends in the middle: the file is truncated");
        return 0;
      }
      inside_member_ = true;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      if (code == Z_STREAM_END) {
        inside_member_ = false;
        inflateReset(&stream_);  // another member may follow
      } else if (code != Z_OK && code != Z_BUF_ERROR) {
        fail("its gzip data are corrupt");
      }
    }
    return wanted - stream_.avail_out;
  }

  std::size_t unpack_zstd(void* out, std::size_t size) {
    ZSTD_outBuffer to{out, size, 0};
    while (to.pos == 0 && size > 0) {
      if (zstd_input_.pos == zstd_input_.size) {
        zstd_input_ = {input_.data(), packed_->read(input_.data(), input_.size()), 0};
        if (zstd_input_.size == 0 && !inside_member_) return 0;
      }
      const std::size_t left = ZSTD_decompressStream(zstd_.get(), &to, &zstd_input_);
      if (ZSTD_isError(left) != 0) fail("its zstd data are corrupt");
      if (zstd_input_.size == 0 && to.pos == 0 && left != 0)
        fail("it ends in the middle: the file is truncated");
      inside_member_ = left != 0;  // another frame may follow
    }
    return to.pos;
  }

  bool refill() {
    const std::size_t got = packed_->read(input_.data(), input_.size());
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = static_cast<uInt>(got);
    return got > 0;
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw Error({.place = name_, .problem = problem, .advice = "Copy or export the file again."});
  }

  std::unique_ptr<ByteSource> packed_;
  std::string name_;
  std::vector<char> input_;
  std::size_t filled_ = 0;
  std::size_t handed_ = 0;
  bool gzip_ = false;
  bool inside_member_ = false;
  z_stream stream_{};
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> zstd_{nullptr, &ZSTD_freeDCtx};
  ZSTD_inBuffer zstd_input_{};
};

}  // namespace

std::unique_ptr<ByteSource> open_bytes(const std::string& path, const Progress& progress) {
  return std::make_unique<MaybePacked>(std::make_unique<FileBytes>(path, progress), path);
}

std::unique_ptr<ByteSource> bytes_in_memory(std::string_view bytes, const std::string& name) {
  return std::make_unique<MaybePacked>(std::make_unique<MemoryBytes>(bytes), name);
}

std::string sha256_hex(std::string_view bytes) {
  Sha256 sha;
  sha.add(bytes.data(), bytes.size());
  return sha.hex();
}

std::string sha256_of_file(const std::string& path, const Progress& progress) {
  const auto source = open_bytes(path, progress);
  std::vector<char> block(kChunk);
  while (source->read(block.data(), block.size()) > 0) {
  }
  return source->sha256();
}

bool read_exactly(ByteSource& source, std::string& to, std::size_t size) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  to.clear();
  while (to.size() < size) {
    const std::size_t before = to.size();
    to.resize(std::min(size, before + kBlock));
    const std::size_t got = source.read(to.data() + before, to.size() - before);
    to.resize(before + got);
    if (got == 0) return false;
  }
  return true;
}

}  // namespace torsio
