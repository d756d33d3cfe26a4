#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/byte_source.hpp"
#include "torsio/core/error.hpp"

namespace torsio {

/// Lines of a byte source with bounded memory, that end in LF, CRLF or CR. Each is followed by its end in memory, also the
/// last one, so that a parser needs no end check on digits.
class LineReader {
 public:
  LineReader(ByteSource& source, std::string name)
      : source_(source), name_(std::move(name)), buffer_(kChunk + 1) {}

  /// The next line without its end. @throws Error if it is longer than `longest` bytes.
  bool next(std::string_view& line, std::size_t longest) {
    while (true) {
      const char* const begin = buffer_.data() + begin_;
      const auto* const newline = static_cast<const char*>(
          std::memchr(begin + searched_, line_end_, end_ - begin_ - searched_));
      const auto length =
          newline != nullptr ? static_cast<std::size_t>(newline - begin) : end_ - begin_;
      if (newline == nullptr && number_ == 0 && ends_in_returns({begin, length})) continue;
      if (length > longest) refuse(length);
      if (newline == nullptr) {
        searched_ = length;
        if (fill()) continue;
        if (length == 0) return false;
        buffer_[end_] = '\n';
      }
      line = {buffer_.data() + begin_, length};
      begin_ = std::min(begin_ + length + 1, end_);
      searched_ = 0;
      ++number_;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      return true;
    }
  }

  /// Counted from 1, of the line given last.
  [[nodiscard]] std::size_t number() const noexcept { return number_; }

 private:
  static constexpr std::size_t kChunk = std::size_t{1} << 16;

  /// Whether lines end in a CR alone, as text that has one and is not followed by an LF shows.
  bool ends_in_returns(std::string_view text) {
    if (line_end_ == '\r' || text.empty() ||
        text.substr(0, text.size() - 1).find('\r') == std::string_view::npos)
      return false;
    line_end_ = '\r';
    searched_ = 0;
    return true;
  }

  bool fill() {
    std::move(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_;
    begin_ = 0;
    if (buffer_.size() - end_ - 1 < kChunk / 2) buffer_.resize(2 * buffer_.size());
    const std::size_t got = source_.read(buffer_.data() + end_, buffer_.size() - end_ - 1);
    end_ += got;
    return got > 0;
  }

  [[noreturn]] void refuse(std::size_t length) const {
    throw Error({.place = fmt::format("{}: line {}", name_, number_ + 1),
                 .expected = "a line of text",
                 .found = fmt::format("{} bytes and no end of the line", length),
                 .advice = "This is not a CSV file, or its line ends are missing."});
  }

  ByteSource& source_;
  std::string name_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t searched_ = 0;  ///< bytes after begin_ without a line end
  std::size_t number_ = 0;
  char line_end_ = '\n';
};

}  // namespace torsio
