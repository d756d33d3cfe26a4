#include <charconv>
#include <cmath>
#include <set>
#include <span>
#include <string>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/csv.hpp"
#include "torsio/files/output_file.hpp"

namespace torsio {
namespace {

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
    file_.write(std::as_bytes(std::span(text_)));
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
  OutputFile file = path == "-" ? OutputFile::standard_output() : OutputFile(path);
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
  file.commit();
}

}  // namespace torsio
