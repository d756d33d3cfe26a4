#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <system_error>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/csv.hpp"

namespace torsio {
namespace {

[[noreturn]] void refuse(const std::string& path, int code) {
  throw Error({.place = path == "-" ? "standard output" : path,
               .problem = "cannot be written: " + std::generic_category().message(code)});
}

/// Writes beside the file and takes its name only when all is on the disk; a device or pipe is
/// written straight.
class OutputFile {
 public:
  explicit OutputFile(std::string path) : path_(std::move(path)) {
    struct stat info {};
    const bool exists = stat(path_.c_str(), &info) == 0;
    if (path_ == "-") {
      descriptor_ = dup(STDOUT_FILENO);
    } else if (exists && !S_ISREG(info.st_mode)) {
      descriptor_ = open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    } else {
      temporary_ = fmt::format("{}.{}.tmp", path_, getpid());
      descriptor_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
      if (descriptor_ < 0) temporary_.clear();
    }
    if (descriptor_ < 0) refuse(path_, errno);
  }
  ~OutputFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!temporary_.empty()) unlink(temporary_.c_str());
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const char* bytes, std::size_t size) {
    while (size > 0) {
      const ssize_t done = ::write(descriptor_, bytes, size);
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) refuse(path_, errno);
      bytes += done;
      size -= static_cast<std::size_t>(done);
    }
  }

  void finish() {
    if (!temporary_.empty() && fsync(descriptor_) != 0) refuse(path_, errno);
    const int closed = close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) refuse(path_, errno);
    if (temporary_.empty()) return;
    if (std::rename(temporary_.c_str(), path_.c_str()) != 0) refuse(path_, errno);
    temporary_.clear();
  }

 private:
  std::string path_;
  std::string temporary_;  ///< empty when there is none to remove
  int descriptor_ = -1;
};

/// Collects text and hands it on in large pieces.
class Text {
 public:
  explicit Text(OutputFile& file) : file_(file) { text_.reserve(kPiece + kLongestNumber); }
  void add(std::string_view more) {
    text_ += more;
    if (text_.size() >= kPiece) flush();
  }
  void add(double value) {
    if (std::isnan(value)) return add("nan");
    char digits[kLongestNumber];  // NOLINT(modernize-avoid-c-arrays): to_chars wants pointers
    const auto [end, code] = std::to_chars(std::begin(digits), std::end(digits), value);
    add(std::string_view(std::begin(digits), end));
  }
  void flush() {
    file_.write(text_.data(), text_.size());
    text_.clear();
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 18;
  static constexpr std::size_t kLongestNumber = 32;
  OutputFile& file_;
  std::string text_;
};

void check_writable(const Recording& recording) {
  std::set<std::string> names;
  for (const Channel& channel : recording.channels()) {
    for (const double value : channel.values)
      if (std::isinf(value))
        throw Error({.place = recording.name() + ": " + channel.name,
                     .problem = "an infinite value cannot be written"});
    const bool is_clock = channel.name == "t_s" || channel.name == "time_s";
    bool is_new = !is_clock && names.insert(channel.name).second;
    if (!channel.fresh.empty())
      is_new = names.insert(freshness_column(channel.name)).second && is_new;
    if (!is_new)
      throw Error({.place = recording.name() + ": " + channel.name,
                   .problem = "the CSV file would have two columns of the same name"});
  }
}

}  // namespace

std::string freshness_column(std::string_view channel_name) {
  const auto parts = split_channel_name(channel_name);
  return std::string(parts ? parts->quantity : channel_name) + "_fresh_1";
}

void write_csv(const Recording& recording, const std::string& path) {
  check_writable(recording);
  OutputFile file(path);
  Text text(file);
  text.add("t_s");
  for (const Channel& channel : recording.channels()) {
    text.add(",");
    text.add(channel.name);
    if (channel.fresh.empty()) continue;
    text.add(",");
    text.add(freshness_column(channel.name));
  }
  text.add("\n");
  for (std::size_t i = 0; i < recording.size(); ++i) {
    text.add(recording.time_s(i));
    for (const Channel& channel : recording.channels()) {
      text.add(",");
      text.add(channel.values[i]);
      if (!channel.fresh.empty()) text.add(channel.fresh[i] != 0 ? ",1" : ",0");
    }
    text.add("\n");
  }
  text.flush();
  file.finish();
}

}  // namespace torsio
