#include "data/text_sink.hpp"

#include <charconv>
#include <cmath>
#include <iterator>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 18;
constexpr std::size_t kLongestNumber = 32;

}  // namespace

TextSink::TextSink(OutputFile& file, bool packs) : file_(file) {
  text_.reserve(kPiece + kLongestNumber);
  if (!packs) return;
  packed_.resize(kPiece);
  constexpr int kGzip = 16 + MAX_WBITS;
  constexpr int kDefaultMemory = 8;
  if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kDefaultMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw Error({.place = "gzip", .problem = "zlib cannot start"});
}

TextSink::~TextSink() {
  if (!packed_.empty()) deflateEnd(&stream_);
}

void TextSink::add(std::string_view more) {
  text_ += more;
  if (text_.size() >= kPiece) flush(false);
}

void TextSink::add(double value) {
  if (std::isnan(value)) return add("nan");
  char digits[kLongestNumber];  // NOLINT(modernize-avoid-c-arrays): to_chars takes pointers
  const auto [end, code] = std::to_chars(std::begin(digits), std::end(digits), value);
  add(std::string_view(std::begin(digits), end));
}

void TextSink::finish() { flush(true); }

void TextSink::flush(bool is_last) {
  const auto bytes = std::as_bytes(std::span(text_));
  if (packed_.empty()) {
    file_.write(bytes);
  } else {
    pack(bytes, is_last);
  }
  text_.clear();
}

void TextSink::pack(std::span<const std::byte> bytes, bool is_last) {
  // zlib reads through a pointer to what is not const, and leaves it as it is.
  stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
  stream_.avail_in = static_cast<uInt>(bytes.size());
  do {
    stream_.next_out = reinterpret_cast<Bytef*>(packed_.data());
    stream_.avail_out = static_cast<uInt>(packed_.size());
    if (deflate(&stream_, is_last ? Z_FINISH : Z_NO_FLUSH) == Z_STREAM_ERROR)
      throw Error({.place = "gzip", .problem = "zlib cannot pack"});
    file_.write(std::span(packed_).first(packed_.size() - stream_.avail_out));
  } while (stream_.avail_out == 0);
}

}  // namespace torsio
