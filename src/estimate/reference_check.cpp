#include <algorithm>
#include <cmath>
#include <utility>

#include "torsio/estimate/adaptive_estimator.hpp"

namespace torsio::detail {
namespace {

constexpr double kChangeTime_s = 0.04;
constexpr double kDeadShare = 0.25;
constexpr double kOpposite = -0.5;
constexpr double kLeastCorrelation = 0.8;
constexpr double kLargestGain = 1.45;
constexpr double kLargestDelay_s = 0.01;
constexpr double kDelayRemaining = 0.7;
constexpr double kGeneratingRemaining = 0.97;
constexpr double kOutlier = 4.0;
/// The least standard deviation of the residuals, as a share of the least spread.
constexpr double kStdDevFloor = 0.1;
/// Largest ratios of the gain to what it was in the last minute, and of the residuals between two confirmations.
constexpr double kLargestChange = 1.2;
constexpr double kGainTime_s = 60.0;
constexpr double kLargestSpreading = 2.0;
/// The time constant of the share of outliers, as a share of the confirmation.
constexpr double kShareTime = 0.2;

double block_time_s(const AdaptationSettings& settings) {
  return std::max(settings.comparison_s, settings.confirmation_s) / kMovingBlocks;
}

}  // namespace

void ReferenceCheck::Sums::add(const Sample& sample) noexcept {
  count += 1.0;
  for (std::size_t i = 0; i < variable_count; ++i) {
    sums[i] += sample[i];
    for (std::size_t j = 0; j <= i; ++j) products[i][j] += sample[i] * sample[j];
  }
}

void ReferenceCheck::Sums::add(const Sums& other) noexcept {
  count += other.count;
  for (std::size_t i = 0; i < variable_count; ++i) {
    sums[i] += other.sums[i];
    for (std::size_t j = 0; j <= i; ++j) products[i][j] += other.products[i][j];
  }
}

double ReferenceCheck::Sums::covariance(std::size_t a, std::size_t b) const noexcept {
  const double product = products[std::max(a, b)][std::min(a, b)];
  return product / count - (sums[a] / count) * (sums[b] / count);
}

ReferenceCheck::ReferenceCheck(const AdaptationSettings& settings, double least_spread,
                               double sample_period_s)
    : is_on_(settings.confirmation_s > 0.0),
      least_spread_(least_spread),
      blocks_(ticks_in(block_time_s(settings), sample_period_s)) {
  const std::size_t change_ticks = ticks_in(kChangeTime_s, sample_period_s);
  change_time_s_ = static_cast<double>(change_ticks) * sample_period_s;
  past_.resize(2 * change_ticks);
  confirmation_blocks_ = static_cast<std::size_t>(
      std::clamp(std::ceil(settings.confirmation_s / block_time_s(settings)), 1.0,
                 static_cast<double>(kMovingBlocks)));
  const auto block_ticks = static_cast<double>(ticks_in(block_time_s(settings), sample_period_s));
  gain_share_ = 1.0 - std::exp(-block_ticks * sample_period_s / kGainTime_s);
  share_decay_ = is_on_ ? std::exp(-sample_period_s / (kShareTime * settings.confirmation_s)) : 0.0;
}

void ReferenceCheck::reset() noexcept {
  clear();
  usual_gain_ = 0.0;
  past_filled_ = 0;
  has_origin_ = false;
}

void ReferenceCheck::clear() noexcept {
  blocks_.reset();
  confirming_ = 0;
  is_confirmed_ = false;
  verdict_ = UpdateOutcome::reference_unconfirmed;
  outlier_share_ = 0.0;
  silent_ticks_ = 0;
}

void ReferenceCheck::pass() noexcept {
  past_filled_ = 0;
  advance();
}

UpdateOutcome ReferenceCheck::step(double frozen, double first, double reference) noexcept {
  if (!is_on_) return UpdateOutcome::updated;
  if (!std::isfinite(frozen) || !std::isfinite(first)) {
    pass();
    return UpdateOutcome::reference_unconfirmed;
  }
  const double frozen_before = past_[past_next_];
  const double first_before = past_[past_next_ + 1];
  past_[past_next_] = frozen;
  past_[past_next_ + 1] = first;
  past_next_ = (past_next_ + 2) % past_.size();
  const bool has_past = past_filled_ == past_.size();
  past_filled_ = std::min(past_filled_ + 2, past_.size());
  UpdateOutcome outcome = verdict_;
  if (has_past && std::isfinite(reference)) {
    if (!has_origin_) origin_ = {frozen, 0.0, first, 0.0, reference};
    has_origin_ = true;
    const Sample sample{frozen - origin_[frozen_value], frozen - frozen_before,
                        first - origin_[first_feature], first - first_before,
                        reference - origin_[reference_value]};
    blocks_.current().all.add(sample);
    if (is_confirmed_ && is_outlier(sample))
      outcome = UpdateOutcome::reference_outlier;
    else
      blocks_.current().inliers.add(sample);
    if (outlier_share_ > 0.5) {
      clear();
      outcome = UpdateOutcome::reference_outlier;
    }
  } else {
    ++silent_ticks_;
    if (!has_past) outcome = UpdateOutcome::reference_unconfirmed;
  }
  advance();
  return outcome;
}

bool ReferenceCheck::is_outlier(const Sample& sample) noexcept {
  const double error = sample[reference_value] - line_.offset - line_.gain * sample[frozen_value];
  const bool found =
      std::abs(error) > kOutlier * std::max(line_.std_dev, kStdDevFloor * least_spread_);
  const double kept =
      std::pow(share_decay_, static_cast<double>(std::exchange(silent_ticks_, 0) + 1));
  outlier_share_ += (1.0 - kept) * ((found ? 1.0 : 0.0) - outlier_share_);
  return found;
}

void ReferenceCheck::advance() noexcept {
  if (const Block* const ended = blocks_.end_tick()) end_block(*ended);
}

void ReferenceCheck::end_block(const Block& ended) noexcept {
  if (ended.all.count > 0.0) confirming_ = std::min(confirming_ + 1, kMovingBlocks);
  if (confirming_ < confirmation_blocks_) return;
  const auto [all, inliers] = blocks_.total();
  const UpdateOutcome found = verdict(all);
  // Without motion nothing changes.
  if (found == UpdateOutcome::reference_unconfirmed) return;
  verdict_ = found;
  if (found == UpdateOutcome::updated && usual_gain_ > 0.0) verdict_ = change_to(line(all));
  const bool was_confirmed = std::exchange(is_confirmed_, verdict_ == UpdateOutcome::updated);
  if (!is_confirmed_) return;
  line_ = line(was_confirmed ? inliers : all);
  if (usual_gain_ == 0.0) usual_gain_ = line_.gain;
  usual_gain_ += gain_share_ * (line(all).gain - usual_gain_);
}

// A joint changes within minutes, a sensor within seconds.
UpdateOutcome ReferenceCheck::change_to(const Line& found) const noexcept {
  const double change = found.gain / usual_gain_;
  if (!(change <= kLargestChange && change >= 1.0 / kLargestChange))
    return UpdateOutcome::reference_scaled;
  const double usual = std::max(line_.std_dev, kStdDevFloor * least_spread_);
  if (!is_confirmed_ && !(found.std_dev <= kLargestSpreading * usual))
    return UpdateOutcome::reference_unrelated;
  return UpdateOutcome::updated;
}

UpdateOutcome ReferenceCheck::verdict(const Sums& total) const noexcept {
  if (total.count < 2.0) return UpdateOutcome::reference_unconfirmed;
  const double spread = std::sqrt(std::max(0.0, total.covariance(frozen_value, frozen_value)));
  if (!(spread > least_spread_)) return UpdateOutcome::reference_unconfirmed;
  const double measured =
      std::sqrt(std::max(0.0, total.covariance(reference_value, reference_value)));
  if (!(measured > kDeadShare * spread)) return UpdateOutcome::reference_dead;
  const double correlation = total.covariance(frozen_value, reference_value) / (spread * measured);
  if (correlation < kOpposite) return UpdateOutcome::reference_opposite;
  const Delay behind_model = delay(total, frozen_value, frozen_change);
  const Delay behind_deflection = delay(total, first_feature, first_change);
  if (behind_model.delay_s > kLargestDelay_s && behind_model.remaining < kDelayRemaining &&
      behind_deflection.delay_s > 0.0 && behind_deflection.remaining < kGeneratingRemaining)
    return UpdateOutcome::reference_delayed;
  if (!(correlation >= kLeastCorrelation)) return UpdateOutcome::reference_unrelated;
  const double gain = correlation * measured / spread;
  if (!(gain <= kLargestGain && gain >= 1.0 / kLargestGain)) return UpdateOutcome::reference_scaled;
  return UpdateOutcome::updated;
}

ReferenceCheck::Line ReferenceCheck::line(const Sums& total) noexcept {
  const double gain = total.covariance(frozen_value, reference_value) /
                      total.covariance(frozen_value, frozen_value);
  const double left = total.covariance(reference_value, reference_value) -
                      gain * total.covariance(frozen_value, reference_value);
  return {.offset = (total.sums[reference_value] - gain * total.sums[frozen_value]) / total.count,
          .gain = gain,
          .std_dev = std::sqrt(std::max(0.0, left))};
}

// v(t - T) is nearly v - (T / d) (v - v_d): the delay is that of the fitted coefficients.
ReferenceCheck::Delay ReferenceCheck::delay(const Sums& total, Variable variable,
                                            Variable change) const noexcept {
  const double vv = total.covariance(variable, variable);
  const double vc = total.covariance(variable, change);
  const double cc = total.covariance(change, change);
  const double vr = total.covariance(variable, reference_value);
  const double cr = total.covariance(change, reference_value);
  const double rr = total.covariance(reference_value, reference_value);
  const double determinant = vv * cc - vc * vc;
  if (!(determinant > 1e-9 * vv * cc)) return {};
  const double gain = (cc * vr - vc * cr) / determinant;
  const double change_gain = (vv * cr - vc * vr) / determinant;
  const double alone = rr - vr * vr / vv;
  const double with_change = rr - gain * vr - change_gain * cr;
  if (!(alone > 0.0) || gain == 0.0) return {};
  return {.delay_s = -change_time_s_ * change_gain / gain,
          .remaining = std::max(0.0, with_change) / alone};
}

}  // namespace torsio::detail
