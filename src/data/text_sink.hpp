#pragma once

#include <zlib.h>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "files/output_file.hpp"

namespace torsio {

/// Writes text to a file in large blocks, optionally packed as gzip. Equal text gives equal
/// bytes: the header contains no name and no time of day.
class TextSink {
 public:
  TextSink(OutputFile& file, bool packs);
  ~TextSink();
  TextSink(const TextSink&) = delete;
  TextSink& operator=(const TextSink&) = delete;

  void add(std::string_view more);
  void add(double value);  ///< shortest decimals that read back to the same number
  /// Call once, at the end.
  void finish();

 private:
  void flush(bool is_last);
  void pack(std::span<const std::byte> bytes, bool is_last);

  OutputFile& file_;
  std::string text_;
  std::vector<std::byte> packed_;  ///< empty: plain text
  z_stream stream_{};
};

}  // namespace torsio
