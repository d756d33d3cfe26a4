#include "torsio/estimate/estimator_core.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "core/all_finite.hpp"
#include "core/cells.hpp"
#include "core/root_of_squares.hpp"
#include "estimate/estimator_checks.hpp"
#include "estimate/guard_listing.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio::detail {
namespace {

/// Beyond the range of the first input, as a share of its width: where the value of a model that
/// continues remains in use. As much as `widen_for_physics` gives an equation of motion.
constexpr double kReach = 1.0;
/// An error bar at twice the largest rate of a symmetric training, half a width outside, is twice that
/// at the border.
constexpr double kExcursionGain = 2.0;

/// An error bar that is positive and finite; NaN for any other.
double evidence(double std_dev) noexcept {
  return std::isfinite(std_dev) && std_dev > 0.0 ? std_dev : kNotMeasured;
}

/// What a feature may leave its range by without being another number: conditions come as float32
/// from many a bus. A feature that was 0 throughout is measured against one SI unit.
double tolerance(double lowest, double highest) noexcept {
  constexpr auto kFloatRounding = static_cast<double>(std::numeric_limits<float>::epsilon());
  const double magnitude = std::max(std::abs(lowest), std::abs(highest));
  return kFloatRounding * (magnitude > 0.0 ? magnitude : 1.0);
}

std::uint64_t identity_of(const EstimatorSettings& settings) noexcept {
  StateHash hash;
  hash.add_value(settings.features.inputs);
  for (const ChannelDefinition& each : settings.features.definitions) {
    hash.add(each.name);
    hash.add(each.expression);
  }
  hash.add_value(settings.sample_rate_Hz);
  hash.add_value(settings.target);
  hash.add_value(settings.zeroed_channels);
  hash.add_value(settings.ranges);
  hash.add_value(settings.disturbances);
  hash.add_value(settings.output);
  hash.add_value(settings.strokes);
  hash.add_value(settings.fallback);
  hash.add_value(settings.residuals);
  hash.add_value(settings.target_uncertainty);
  return hash.value();
}

}  // namespace

EstimatorCore::EstimatorCore(EstimatorSettings settings, std::size_t model_input_count,
                             const FamilyTraits& traits,
                             const std::function<ModelMemory(const InputRanges&)>& memory)
    : settings_(std::move(settings)),
      pipeline_(settings_.features, settings_.sample_rate_Hz),
      unset_zeros_(settings_.zeroed_channels),
      longest_gap_(static_cast<std::size_t>(
          std::clamp(kLongestGapSeconds * settings_.sample_rate_Hz, 1.0, 1e9))) {
  check_settings(settings_, model_input_count);
  check_zeroed(settings_.zeroed_channels, raw_inputs());
  const FeatureRanges& ranges = settings_.ranges;
  for (std::size_t i = 0; i < model_input_count; ++i) ranges_.push_back(range_of(i, traits));
  check_disturbances(settings_.disturbances, raw_inputs().size());
  first_width_ = ranges_.front().highest - ranges_.front().lowest;
  assumes_jumps_ = settings_.disturbances.largest_step.empty();
  memory_error_ = MemoryError(memory({ranges.lowest, ranges.highest}), first_width_,
                              1.0 / settings_.sample_rate_Hz, settings_.disturbances.warm_up_s);
  has_memory_ = !memory_error_.memory().is_empty();
  depends_on_rate_ = has_memory_ || pipeline_.settling_samples() > 0;
  if (settings_.output.largest_target > 0.0)
    largest_output_ = OutputGuards::kLargestOutput * settings_.output.largest_target;
  resets_model_ = !memory_error_.memory().is_declared || !has_memory_;
  previous_raw_.resize(raw_inputs().size(), kNotMeasured);
  level_.resize(raw_inputs().size());
  between_.resize(raw_inputs().size());
  jump_.resize(raw_inputs().size());
  offsets_.resize(raw_inputs().size());
  jump_limits_.resize(raw_inputs().size(), std::numeric_limits<double>::infinity());
  std::ranges::transform(settings_.disturbances.largest_step, jump_limits_.begin(),
                         [](double step) { return kJumpFactor * step; });
  raw_slopes_ = slopes_at_rest();
  if (settings_.strokes.growth > 0.0)
    longest_stroke_ = settings_.strokes.longest_s * settings_.sample_rate_Hz;
  strokes_ = StrokeClock(settings_.strokes.dead_band);
  limited_.resize(model_input_count);
  missed_parts_.resize(model_input_count);
  for (std::size_t i = 0; i < model_input_count; ++i)
    widths_.push_back(ranges.highest[i] - ranges.lowest[i]);
  state_identity_ = identity_of(settings_);
}

EstimatorCore::Range EstimatorCore::range_of(std::size_t feature,
                                             const FamilyTraits& traits) const {
  const double low = settings_.ranges.lowest[feature];
  const double high = settings_.ranges.highest[feature];
  const double width = high - low;
  const double slack = tolerance(low, high);
  // Never 0, not even for a feature that was constant in training: no value may jump.
  const double border = settings_.ranges.margin * width + slack;
  check_finite("guards.ranges with margin",
               std::array{low - slack - border, high + slack + border});
  Range range{.lowest = low - slack,
              .highest = high + slack,
              .border = border,
              .per_width = width > 0.0 ? 1.0 / width : 0.0,
              .reach = 0.0,
              .held = border};
  // An excursion is a motion, and not a wrong sensor, only if jumps are detected.
  if (!traits.is_spring || settings_.disturbances.largest_step.empty()) return range;
  if (feature == 0 && traits.continues) {
    range.reach = kReach * width;
    range.held = range.reach + border;
  } else if (feature > 0 && pipeline_.is_rate(feature)) {
    range.reach = std::numeric_limits<double>::infinity();
  }
  return range;
}

bool EstimatorCore::set_zero(std::string_view channel, double value) {
  const bool has_changed = pipeline_.set_zero(channel, value);
  std::erase(unset_zeros_, channel);
  if (has_changed) follow_zero();
  return has_changed;
}

void EstimatorCore::reset() noexcept {
  pipeline_.reset();
  missed_ = 0;
  poisoned_ = false;
  last_value_ = 0.0;
  needs_reset_ = false;
  has_run_ = false;
  in_jump_ = false;
  level_ticks_ = 0;
  has_returned_ = false;
  zero_changed_ = false;
  excursion_ticks_ = 0.0;
  excursion_share_ = 0.0;
  previous_first_ = kNotMeasured;
  std::ranges::fill(level_, 0.0);
  std::ranges::fill(jump_, 0.0);
  std::ranges::fill(offsets_, 0.0);
  level_error_ = 0.0;
  std::ranges::fill(previous_raw_, kNotMeasured);
  is_wrong_rate_ = false;
  memory_error_.reset();
  strokes_.reset();
}

// One variable is returned everywhere: a copy of it would cost a third of the step of a linear model.
EstimatorCore::Conditioned EstimatorCore::condition(std::span<const double> raw) noexcept {
  Conditioned input;
  if (raw.size() != raw_inputs().size()) {
    input.fault = Fault::input_count_wrong;
  } else if (!all_finite(raw)) {
    input.fault = Fault::input_not_finite;
  }
  if (input.fault != Fault::none) {
    ++missed_;
    return input;
  }
  const bool is_new = is_new_level(raw);
  if (is_new && missed_ < longest_gap_) {
    // It may return at once: nothing has received it then.
    ++missed_;
    in_jump_ = true;
    input.fault = Fault::outside_training_range;
    return input;
  }
  if (poisoned_ || missed_ > longest_gap_ || level_ticks_ > 0) pipeline_.reset();
  const Features features = pipeline_.step(raw);
  // Finite inputs can still overflow a product or leave a root's domain; differences and lags hold
  // such a value for some ticks, so the next usable tick starts afresh.
  poisoned_ = !all_finite(features);
  start_std_dev_ = pipeline_.is_settled() ? 0.0 : start_std_dev_now();
  if (poisoned_) {
    ++missed_;
    input.fault = Fault::input_not_finite;
    return input;
  }
  input.features = features;
  input.for_model = features;
  input.excursion = excursion(features);
  const bool is_outside = input.excursion.is_outside();
  // An unknown zero explains an excursion without a jump.
  const bool may_have_jumped = in_jump_ || (assumes_jumps_ && unset_zeros_.empty());
  in_jump_ = is_new || is_wrong_rate_ || (is_outside && may_have_jumped);
  if (in_jump_) {
    exclude(input);
    has_run_ = has_run_ || !has_memory_;
    return input;
  }
  if (missed_ > 0 || zero_changed_) resume(features[0]);
  if (is_outside) {
    limit(input);
  } else {
    if (excursion_ticks_ > 0.0) end_excursion();
    memory_error_.follow(features);
  }
  std::ranges::copy(raw, previous_raw_.begin());
  previous_first_ = features[0];
  if (has_strokes()) strokes_.follow(features[0]);
  input.restarted = needs_reset_;
  needs_reset_ = false;
  has_run_ = true;
  return input;
}

Estimate EstimatorCore::held(Fault fault) const noexcept {
  // A forged state may contain any number.
  return {.value = std::isfinite(last_value_) ? last_value_ : 0.0, .fault = fault};
}

Estimate EstimatorCore::apply_guards(const Conditioned& input,
                                     const Estimate& raw_estimate) noexcept {
  const Features features = input.features;
  const Excursion& excursion = input.excursion;
  const double std_dev = model_std_dev(raw_estimate);
  const double novelty = has_strokes() ? stroke_novelty() : 0.0;
  Estimate out;
  out.fault = replaced_for(excursion, raw_estimate, std_dev);
  if (out.fault == Fault::none && !excursion.is_outside() &&
      std::abs(raw_estimate.value) > largest_output_)
    out.fault = Fault::diverged;
  if (out.fault == Fault::none) {
    if (excursion.verdict() == Verdict::blend) {
      out = blended(features, raw_estimate.value, std_dev, excursion.fallback);
    } else {
      out.value = raw_estimate.value;
      out.std_dev = std_dev;
    }
    if (!memory_error_.is_zero()) out.std_dev = root_of_squares(out.std_dev, memory_error_.bound());
    if (start_std_dev_ > 0.0) out.std_dev = root_of_squares(out.std_dev, start_std_dev_);
    if (level_error_ > 0.0) out.std_dev = root_of_squares(out.std_dev, level_error_);
    if (novelty > 0.0)
      out.std_dev = root_of_squares(
          out.std_dev, std::min(settings_.strokes.growth * novelty, settings_.strokes.limit));
    if (excursion.share > 0.0)
      out.std_dev = widened(out.std_dev, excursion, out.value - fallback_value(features));
    if (excursion.is_outside()) out.fault = Fault::outside_training_range;
  } else {
    out.value = fallback_value(features);
    // The fallback's residuals are evidence only where it was fitted.
    if (!excursion.is_outside() && !is_wrong_rate_)
      out.std_dev = evidence(settings_.fallback.residual_std);
  }
  if (settings_.target_uncertainty.is_stated())
    out.std_dev = root_of_squares(out.std_dev, settings_.target_uncertainty.at(out.value));
  out.novelty = has_strokes() && std::isnan(raw_estimate.novelty) ? novelty : raw_estimate.novelty;
  if (!unset_zeros_.empty()) {
    // With an unknown zero, the range of a channel cannot be checked. A warm-up ends by itself, the want of a
    // zero does not: it is reported from the first tick on.
    if (!is_wrong_rate_) out.fault = Fault::zero_not_set;
    out.std_dev = kNotMeasured;
  }
  last_value_ = out.value;
  return out;
}

EstimatorCore::Excursion EstimatorCore::excursion(Features features) const noexcept {
  Excursion worst;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Range& range = ranges_[i];
    const double left_by = std::max(range.lowest - features[i], features[i] - range.highest);
    if (!(left_by > 0.0)) continue;
    worst.borders = std::max(worst.borders, left_by / range.border);
    worst.fallback = std::max(worst.fallback, (left_by - range.reach) / range.border);
    if (!(range.reach > 0.0)) continue;
    worst.share = std::max(worst.share, left_by * range.per_width);
    if (i == 0) {
      worst.first = left_by * range.per_width;
    } else {
      worst.rate = std::max(worst.rate, left_by / range.border);
    }
  }
  return worst;
}

// Two extrapolations: the further beyond the range, the less evidence there is for either.
double EstimatorCore::widened(double std_dev, const Excursion& excursion,
                              double departure) noexcept {
  return root_of_squares(std_dev * (1.0 + kExcursionGain * excursion.share),
                         std::min(excursion.first, 1.0) * departure);
}

double EstimatorCore::model_std_dev(const Estimate& raw_estimate) noexcept {
  const double own = evidence(settings_.output.error_bar_factor * raw_estimate.std_dev);
  return std::isnan(own) ? residual_std_at(raw_estimate.value) : own;
}

Estimate EstimatorCore::blended(Features features, double value, double std_dev,
                                double weight) const noexcept {
  const double fallback = fallback_value(features);
  // The second moment about the mean of a draw from the model with probability 1 - w, else from
  // the fallback: the two variances, and how far the two disagree.
  const double of_fallback = evidence(settings_.fallback.residual_std);
  const double apart = value - fallback;
  const double spread =
      std::sqrt((1.0 - weight) * std_dev * std_dev +
                weight * (of_fallback * of_fallback + (1.0 - weight) * apart * apart));
  return {.value = std::lerp(value, fallback, weight), .std_dev = evidence(spread)};
}

double EstimatorCore::fallback_value(Features features) const noexcept {
  double value = settings_.fallback.intercept;
  for (std::size_t i = 0; i < features.size(); ++i)
    value += settings_.fallback.slope[i] * features[i];
  return std::isfinite(value) ? value : last_value_;
}

double EstimatorCore::start_std_dev_now() const noexcept {
  const std::span<const double> errors = pipeline_.state_errors();
  double sum = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (errors[i] > 0.0) sum += std::abs(settings_.fallback.slope[i]) * errors[i];
  return sum / std::numbers::sqrt3;
}

double EstimatorCore::stroke_novelty() const noexcept {
  const double share = strokes_.longest() / longest_stroke_;
  return share > 1.0 ? (share - 1.0) * (share - 1.0) / share : 0.0;
}

double EstimatorCore::residual_std_at(double value) noexcept {
  const ResidualTable& table = settings_.residuals;
  if (table.std_dev.empty()) return kNotMeasured;
  residual_region_ = cell_of(table.edges, value, residual_region_);
  return evidence(table.std_dev[residual_region_]);
}

GuardListing EstimatorCore::listing() const {
  GuardListing listing{.widths = widths_,
                       .first_width = first_width_,
                       .assumes_jumps = assumes_jumps_,
                       .longest_gap = longest_gap_,
                       .has_memory = has_memory_,
                       .resets_model = resets_model_,
                       .depends_on_rate = depends_on_rate_,
                       .largest_output = largest_output_,
                       .jump_limits = jump_limits_,
                       .raw_slopes = raw_slopes_,
                       .longest_stroke = longest_stroke_};
  for (const Range& range : ranges_)
    listing.ranges.push_back(
        {range.lowest, range.highest, range.border, range.per_width, range.reach, range.held});
  memory_error_.list(listing);
  return listing;
}

}  // namespace torsio::detail
