#include "fit/common/training_rules.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::set<std::string> zeroed_channels(const Recording& recording) {
  std::set<std::string> channels;
  for (const ZeroRule& zero : recording.zeros) channels.insert(zero.channel);
  return channels;
}

/// Shares of the range of the first input: values that differ by less are one, a distance that is a gap, and
/// what all gaps may be.
constexpr double kSameValue = 1e-9;
constexpr double kGapShare = 1.0 / 40.0;
constexpr double kLargestGaps = 0.6;
constexpr std::size_t kFewCodes = 10;
constexpr std::size_t kFewSamples = 100;

struct Range {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  [[nodiscard]] bool is_constant() const { return !(lowest < highest); }
};

/// The range of `value_of(sequence, sample)` over the usable samples.
template <class Value>
Range range_of(const TrainingData& data, const Value& value_of) {
  Range range;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const double value = value_of(sequence, n);
      range.lowest = std::min(range.lowest, value);
      range.highest = std::max(range.highest, value);
    }
  return range;
}

void require_squares(const Range& range, const std::string& name) {
  const double largest = std::max(std::abs(range.lowest), std::abs(range.highest));
  if (largest > kLargestValue)
    throw Error(
        {.place = name,
         .expected = fmt::format("values below {:g}, whose squares can be summed", kLargestValue),
         .found = fmt::format("{:g}", largest),
         .advice = "Check the unit and the scale of the column, or the expression."});
  if (!range.is_constant() && range.highest - range.lowest < 1.0 / kLargestValue)
    throw Error({.place = name,
                 .expected = fmt::format("a range of at least {:g}, whose square is not 0",
                                         1.0 / kLargestValue),
                 .found = fmt::format("{:g}", range.highest - range.lowest),
                 .advice = "Check the unit and the scale of the column, or the expression."});
}

}  // namespace

std::vector<ZeroRule> training_zeros(const Dataset& dataset) {
  const Recording* first = nullptr;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    if (first == nullptr) first = &record.recording;
    const auto expected = zeroed_channels(*first);
    const auto found = zeroed_channels(record.recording);
    if (found == expected) continue;
    const auto list = [](const std::set<std::string>& channels) {
      return channels.empty() ? std::string("none") : fmt::format("{}", fmt::join(channels, ", "));
    };
    throw Error({.place = record.recording.name() + ": zero",
                 .problem = "the training recordings disagree about which channels are zeroed",
                 .expected = list(expected) + ", as in " + first->name(),
                 .found = list(found),
                 .advice = "Give all of them the same zero: rules."});
  }
  return first == nullptr ? std::vector<ZeroRule>{} : first->zeros;
}

namespace {

/// The statement on the sensor of the target; null: none.
const SensorUncertainty* stated_uncertainty(const Dataset& dataset, const DatasetRecord& record) {
  const auto& stated = record.recording.uncertainties;
  const auto of_target = stated.find(dataset.target);
  return of_target == stated.end() ? nullptr : &of_target->second;
}

}  // namespace

SensorUncertainty training_uncertainty(const Dataset& dataset) {
  SensorUncertainty largest;
  if (dataset.load_target.is_used()) return largest;
  for (const DatasetRecord& record : dataset.records)
    if (const SensorUncertainty* const stated = stated_uncertainty(dataset, record);
        stated != nullptr && record.has_role(Role::train))
      largest = larger_of(largest, *stated);
  return largest;
}

namespace {

/// The statement that the error bars contain; empty: none.
std::string note_of_target(const Dataset& dataset) {
  const SensorUncertainty largest = training_uncertainty(dataset);
  if (!largest.is_stated()) return {};
  std::size_t stating = 0;
  std::size_t all = 0;
  bool differ = false;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    ++all;
    const SensorUncertainty* const stated = stated_uncertainty(dataset, record);
    stating += stated != nullptr ? 1 : 0;
    differ = differ || (stated != nullptr && *stated != largest);
  }
  std::string note = "the error bars contain the error of the reference sensor as it was stated, " +
                     uncertainty_text(largest, dataset.target);
  if (differ) note += ", the largest of the recordings";
  if (stating < all) note += fmt::format("; {} of {} recordings state none", all - stating, all);
  return note;
}

/// The channels whose statements the error bars do not contain, each once: all but the target, and the target as well
/// where it is computed from a known load.
std::set<std::string> other_stated_channels(const Dataset& dataset) {
  std::set<std::string> channels;
  for (const DatasetRecord& record : dataset.records)
    for (const auto& [channel, stated] : record.recording.uncertainties)
      if (record.has_role(Role::train) &&
          (channel != dataset.target || dataset.load_target.is_used()))
        channels.insert(channel);
  return channels;
}

}  // namespace

std::vector<std::string> uncertainty_notes(const Dataset& dataset) {
  std::vector<std::string> notes;
  if (std::string note = note_of_target(dataset); !note.empty()) notes.push_back(std::move(note));
  if (const std::set<std::string> others = other_stated_channels(dataset); !others.empty())
    notes.push_back(fmt::format(
        "the uncertainty of {} has no effect on the error bars: only that of {} has one",
        fmt::join(others, ", "),
        dataset.load_target.is_used() ? "the known load" : "the target, " + dataset.target));
  return notes;
}

void add_training_files(ModelCard& card, const Dataset& dataset) {
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    Source source = record.recording.source;
    if (source.file.empty()) source.file = record.recording.name();  // made in memory
    if (std::ranges::find(card.training_files, source) == card.training_files.end())
      card.training_files.push_back(std::move(source));
  }
}

void require_trainable(const TrainingData& data) {
  const Range target =
      range_of(data, [](const Sequence& sequence, std::size_t n) { return sequence.target[n]; });
  // Nothing can be learned from a target that never changes, and every score of it would be 0 / 0.
  if (target.is_constant())
    throw Error({.place = data.target,
                 .expected = "a target that changes",
                 .found = fmt::format("{} in every training sample", target.lowest),
                 .advice = "Is the sensor connected? torsio check reports details."});
  require_squares(target, data.target);
  bool is_constant = true;
  for (std::size_t j = 0; j < data.input_count(); ++j) {
    const Range input = range_of(
        data, [j](const Sequence& sequence, std::size_t n) { return sequence.features(n, j); });
    require_squares(input, "input " + data.inputs[j].expression);
    is_constant = is_constant && input.is_constant();
  }
  if (is_constant)
    throw Error({.place = "input " + data.inputs.front().expression,
                 .expected = "at least one input that changes",
                 .found = "every input is constant over the training samples",
                 .advice = "Check that the sensors are connected, and --inputs."});
}

// A step of an encoder is not a gap, however coarse it is. A joint that is driven at one speed after another moves.
void require_motion(const TrainingData& data) {
  if (data.inputs.front().is_rate) return;
  std::vector<double> values;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.target.size(); ++n)
      if (sequence.use[n] != 0) values.push_back(sequence.features(n, 0));
  if (values.size() < kFewSamples) return;  // another rule
  std::ranges::sort(values);
  const double range = values.back() - values.front();
  double step = range;
  std::size_t codes = 1;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double gap = values[i] - values[i - 1]; gap > kSameValue * range) {
      step = std::min(step, gap);
      ++codes;
    }
  const double least = std::max(kGapShare * range, codes < kFewCodes ? 0.0 : 1.5 * step);
  double in_gaps = 0.0;
  std::size_t levels = 1;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double gap = values[i] - values[i - 1]; gap > least) {
      in_gaps += gap;
      ++levels;
    }
  if (!(in_gaps > kLargestGaps * range)) return;
  throw Error({.place = "input " + data.inputs.front().expression,
               .expected = "values over its whole range",
               .found = fmt::format("{} levels, and nothing between them in {:.0f} % of the range",
                                    levels, 100.0 * in_gaps / range),
               .advice = "Record motions: load and unload slowly and without a stop. Such data "
                         "determine a stiffness only (--model linear)."});
}

void refuse_motion_without_return(const TrainingData& data) {
  throw Error(
      {.place = "input " + data.inputs.front().expression,
       .expected = "a motion that comes back to where it was",
       .found = fmt::format("{} samples, of which the last third is beyond all others",
                            data.usable_samples()),
       .advice = "Load and unload several times: otherwise nothing shows the error of a model with "
                 "memory. Or fit one without memory, such as polynomial:branch=false."});
}

std::vector<std::string> unused_recordings(const TrainingData& data) {
  std::vector<std::string> names;
  for (const Sequence& sequence : data.sequences)
    if (std::ranges::none_of(sequence.use, [](std::uint8_t use) { return use != 0; }))
      names.push_back(sequence.recording);
  return names;
}

}  // namespace torsio
