#include "studies/board_predictions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::string_view kAdvice =
    "torsio reproduce board --set SET --template FILE.csv writes the samples to be predicted; "
    "docs/board.md describes the file.";

/// Without spaces and a pair of quotes at its ends: R writes text, and names of columns, in quotes.
std::string_view plain_field(std::string_view field) {
  while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
  while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
  const bool has_quotes = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return has_quotes ? field.substr(1, field.size() - 2) : field;
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(plain_field(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// The next line without its end, which is LF, CR LF or CR; `text` becomes what follows.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find_first_of("\r\n");
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end, text.size()));
  text.remove_prefix(text.starts_with("\r\n") ? 2 : text.empty() ? 0 : 1);
  return line;
}

template <class Number>
std::optional<Number> parsed(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// A number of samples, which may have been written as a real number: 20.0.
template <>
std::optional<std::size_t> parsed<std::size_t>(std::string_view text) {
  constexpr double kLargest = 1e15;
  const std::optional<double> value = parsed<double>(text);
  if (!value || !(*value >= 0.0 && *value <= kLargest) || *value != std::floor(*value))
    return std::nullopt;
  return static_cast<std::size_t>(*value);
}

/// Where the columns of a file are.
struct PredictionColumns {
  std::size_t set = 0;
  std::size_t recording = 0;
  std::optional<std::size_t> sample;
  std::optional<std::size_t> time;
  std::size_t prediction = 0;
  std::string unit;
};

class PredictionReader {
 public:
  PredictionReader(std::string_view text, std::string name) : text_(text) {
    result_.file = std::move(name);
  }

  [[nodiscard]] PredictionFile read() {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
      throw Error({.place = result_.file,
                   .problem = "the file is encoded in UTF-16",
                   .expected = "UTF-8",
                   .advice = std::string(kAdvice)});
    std::size_t number = 0;
    while (!text_.empty()) {
      ++number;
      const std::string_view line = next_line(text_);
      if (line.empty() || line.starts_with('#')) continue;
      if (header_.empty())
        read_header(line, number);
      else
        read_line(line, number);
    }
    if (result_.samples.empty())
      throw Error({.place = result_.file,
                   .problem = "the file has no predictions",
                   .advice = std::string(kAdvice)});
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::string place(std::size_t line) const {
    return fmt::format("{}: line {}", result_.file, line);
  }

  [[nodiscard]] std::optional<std::size_t> find(std::string_view column) const {
    const auto found = std::ranges::find(header_, column);
    if (found == header_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - header_.begin());
  }

  [[nodiscard]] std::size_t required(std::string_view column, std::size_t line) const {
    if (const auto found = find(column)) return *found;
    for (const auto& [sign, separators] : {std::pair{';', "semicolons"}, {'\t', "tabs"}})
      if (header_.size() == 1 && header_.front().find(sign) != std::string::npos)
        throw Error({.place = place(line),
                     .problem = fmt::format("the fields are separated by {}", separators),
                     .expected = "commas, and a point as decimal separator",
                     .advice = std::string(kAdvice)});
    throw Error({.place = place(line),
                 .problem = fmt::format("the column {} is missing", column),
                 .expected = "set, recording, sample (or t_s), prediction_UNIT",
                 .found = fmt::format("{}", fmt::join(header_, ", ")),
                 .advice = std::string(kAdvice)});
  }

  void read_header(std::string_view line, std::size_t number) {
    for (const std::string_view field : fields_of(line)) header_.emplace_back(field);
    columns_.set = required("set", number);
    columns_.recording = required("recording", number);
    columns_.sample = find("sample");
    columns_.time = find("t_s");
    if (!columns_.sample && !columns_.time) static_cast<void>(required("sample", number));
    constexpr std::string_view kPrediction = "prediction_";
    const auto is_prediction = [&](const std::string& column) {
      return column.starts_with(kPrediction);
    };
    const auto found = std::ranges::find_if(header_, is_prediction);
    if (found == header_.end()) static_cast<void>(required("prediction_UNIT", number));
    const bool is_ambiguous = std::ranges::count_if(header_, is_prediction) > 1 ||
                              std::ranges::any_of(std::array{"set", "recording", "sample", "t_s"},
                                                  [&](const char* column) {
                                                    return std::ranges::count(header_, column) > 1;
                                                  });
    if (is_ambiguous)
      throw Error({.place = place(number),
                   .problem = "a column is there twice",
                   .expected = "set, recording, sample (or t_s) and prediction_UNIT once each",
                   .found = fmt::format("{}", fmt::join(header_, ", ")),
                   .advice = "Write one file for each model."});
    columns_.prediction = static_cast<std::size_t>(found - header_.begin());
    columns_.unit = found->substr(kPrediction.size());
    header_line_ = number;
  }

  void check_set(std::string_view set, std::size_t number) {
    if (result_.set == nullptr) {
      result_.set = &find_board_set(set, place(number));
      if (columns_.unit == result_.set->unit) return;
      throw Error({.place = place(header_line_),
                   .problem = fmt::format("the predictions have another unit than the set {}", set),
                   .expected = fmt::format("a column prediction_{}", result_.set->unit),
                   .found = "prediction_" + columns_.unit,
                   .advice = "Convert the values and rename the column."});
    }
    if (set == result_.set->name) return;
    throw Error({.place = place(number),
                 .problem = "a file of predictions is for one set",
                 .expected = std::string(result_.set->name),
                 .found = std::string(set),
                 .advice = "Write one file for each set."});
  }

  template <class Number>
  [[nodiscard]] Number number_in(std::string_view field, std::string_view column,
                                 std::string_view expected, std::size_t line) const {
    if (const auto value = parsed<Number>(field)) return *value;
    throw Error({.place = fmt::format("{}, column {}", place(line), column),
                 .expected = std::string(expected),
                 .found = fmt::format("\"{}\"", field)});
  }

  void read_line(std::string_view line, std::size_t number) {
    const std::vector<std::string_view> fields = fields_of(line);
    if (fields.size() != header_.size())
      throw Error({.place = place(number),
                   .problem = "the line has another number of fields than the header",
                   .expected = fmt::format("{}", header_.size()),
                   .found = fmt::format("{}", fields.size())});
    check_set(fields[columns_.set], number);
    PredictedSample& sample = result_.samples.emplace_back();
    sample.line = number;
    sample.recording = fields[columns_.recording];
    if (columns_.sample)
      sample.sample = number_in<std::size_t>(fields[*columns_.sample], "sample",
                                             "a whole number from 0", number);
    if (columns_.time && !(columns_.sample && fields[*columns_.time].empty()))
      sample.t_s = number_in<double>(fields[*columns_.time], "t_s", "a number", number);
    // Empty where there is no prediction: required of scored samples alone.
    const std::string_view prediction = fields[columns_.prediction];
    sample.value = prediction.empty() ? kNotMeasured
                                      : number_in<double>(prediction, "prediction_" + columns_.unit,
                                                          "a number", number);
  }

  std::string_view text_;
  std::vector<std::string> header_;
  std::size_t header_line_ = 0;
  PredictionColumns columns_;
  PredictionFile result_;
};

/// The sample of a recording at a time.
std::size_t sample_at(const PredictionFile& file, const PredictedSample& predicted,
                      const Recording& recording) {
  constexpr double kTolerance = 0.1;  // periods, for the digits of a time that was written as text
  const double exact = (predicted.t_s - recording.time_s(0)) * recording.sample_rate_Hz();
  const double nearest = std::round(exact);
  if (std::isfinite(exact) && nearest >= 0.0 && std::abs(exact - nearest) <= kTolerance)
    return static_cast<std::size_t>(nearest);
  throw Error({.place = fmt::format("{}: line {}, column t_s", file.file, predicted.line),
               .problem = fmt::format("no sample of {} has this time", predicted.recording),
               .expected = fmt::format("{} s and steps of {:.6g} s", recording.time_s(0),
                                       1.0 / recording.sample_rate_Hz()),
               .found = fmt::format("{}", predicted.t_s),
               .advice = std::string(kAdvice)});
}

/// Its sample, which its time, where both are given, must not contradict.
std::size_t sample_of(const PredictionFile& file, const PredictedSample& predicted,
                      const Recording& recording) {
  if (std::isnan(predicted.t_s)) return *predicted.sample;
  const std::size_t at_time = sample_at(file, predicted, recording);
  if (!predicted.sample || *predicted.sample == at_time) return at_time;
  throw Error({.place = fmt::format("{}: line {}", file.file, predicted.line),
               .problem = "sample and t_s contradict each other",
               .expected = fmt::format("sample {} at {} s", at_time, predicted.t_s),
               .found = fmt::format("sample {}", *predicted.sample),
               .advice = "Leave one of the two columns out."});
}

const Recording& recording_of(const PredictionFile& file, const PredictedSample& predicted,
                              const Dataset& dataset, std::span<const BoardTarget> targets) {
  const bool is_target =
      std::ranges::find(targets, predicted.recording, &BoardTarget::recording) != targets.end();
  const auto record = std::ranges::find_if(dataset.records, [&](const DatasetRecord& each) {
    return each.recording.name() == predicted.recording;
  });
  if (is_target && record != dataset.records.end()) return record->recording;
  std::vector<std::string> names;
  names.reserve(targets.size());
  for (const BoardTarget& target : targets) names.push_back(target.recording);
  throw Error({.place = fmt::format("{}: line {}, column recording", file.file, predicted.line),
               .problem = fmt::format("the set {} has no such test recording", file.set->name),
               .expected = fmt::format("one of {}", fmt::join(names, ", ")),
               .found = fmt::format("\"{}\"", predicted.recording)});
}

/// Counts the scored samples without a prediction.
void require_complete(const PredictionFile& file, std::span<const BoardTarget> targets,
                      const std::vector<std::vector<std::size_t>>& lines) {
  std::size_t missing = 0;
  std::size_t scored = 0;
  std::string first;
  for (std::size_t k = 0; k < targets.size(); ++k)
    for (std::size_t n = 0; n < lines[k].size(); ++n) {
      ++scored;
      if (lines[k][n] != 0) continue;
      if (missing++ == 0)
        first = fmt::format("sample {} of {}", targets[k].samples[n], targets[k].recording);
    }
  if (missing == 0) return;
  throw Error({.place = file.file,
               .problem = fmt::format("{} of {} scored samples have no prediction, the first is {}",
                                      missing, scored, first),
               .advice = std::string(kAdvice)});
}

}  // namespace

PredictionFile parse_predictions(std::string_view text, const std::string& name) {
  return PredictionReader(text, name).read();
}

PredictionFile read_predictions(const std::string& path) {
  return parse_predictions(unpacked_content(path), path);
}

std::vector<std::vector<double>> matched_predictions(const PredictionFile& file,
                                                     const Dataset& dataset,
                                                     std::span<const BoardTarget> targets) {
  std::vector<std::vector<double>> values;
  std::vector<std::vector<std::size_t>> lines;  // by scored sample; 0: none yet
  values.reserve(targets.size());
  lines.reserve(targets.size());
  for (const BoardTarget& target : targets) {
    values.emplace_back(target.samples.size(), kNotMeasured);
    lines.emplace_back(target.samples.size(), 0);
  }
  for (const PredictedSample& predicted : file.samples) {
    const Recording& recording = recording_of(file, predicted, dataset, targets);
    const std::size_t sample = sample_of(file, predicted, recording);
    if (sample >= recording.size())
      throw Error({.place = fmt::format("{}: line {}", file.file, predicted.line),
                   .problem = fmt::format("{} has no sample {}", predicted.recording, sample),
                   .expected = fmt::format("0 to {}", recording.size() - 1)});
    const auto k = static_cast<std::size_t>(
        std::ranges::find(targets, predicted.recording, &BoardTarget::recording) - targets.begin());
    const auto found = std::ranges::lower_bound(targets[k].samples, sample);
    if (found == targets[k].samples.end() || *found != sample) continue;
    const auto n = static_cast<std::size_t>(found - targets[k].samples.begin());
    if (lines[k][n] != 0)
      throw Error({.place = fmt::format("{}: line {}", file.file, predicted.line),
                   .problem = fmt::format("sample {} of {} is predicted twice, first in line {}",
                                          sample, predicted.recording, lines[k][n])});
    if (!std::isfinite(predicted.value))
      throw Error(
          {.place = fmt::format("{}: line {}", file.file, predicted.line),
           .problem = fmt::format("the prediction of a scored sample ({} of {}) is empty or "
                                  "not finite",
                                  sample, predicted.recording),
           .expected = "a finite number for every scored sample"});
    lines[k][n] = predicted.line;
    values[k][n] = predicted.value;
  }
  require_complete(file, targets, lines);
  return values;
}

}  // namespace torsio
