#include "fleet/joint_traits.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "evaluate/drift/joint_difference.hpp"
#include "evaluate/drift/verdicts.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kIntervalOverError = 1.96;

JointTraits::Value relative(const DriftQuantity& of) {
  if (!(std::abs(of.before) > 0.0)) return {};
  return {.value = of.relative,
          .std_error = 0.5 * (of.highest - of.lowest) / kIntervalOverError / std::abs(of.before)};
}

JointTraits::Value absolute(const DriftQuantity& of) {
  return {.value = of.change,
          .std_error = 0.5 * (of.highest - of.lowest) / kIntervalOverError,
          .unit = of.unit};
}

/// The work until friction slides: its torque times its break-away angles, which are 2^`break_away` times the base's.
/// Where these are unknown, the torque.
JointTraits::Value friction_work(const JointTraits::Value& friction,
                                 const JointTraits::Value& break_away) {
  if (!std::isfinite(friction.value) || !std::isfinite(break_away.value)) return friction;
  constexpr double kLeastTorque = 0.01;  // friction that has vanished, or an estimate below it
  const double torque = std::max(kLeastTorque, 1.0 + friction.value);
  const double work = torque * std::exp2(break_away.value);
  return {.value = work - 1.0,
          .std_error = work * std::hypot(friction.std_error / torque,
                                         std::numbers::ln2 * break_away.std_error)};
}

/// Samples of the residual over one angle.
struct AngleSamples {
  std::vector<double> angle_rad;
  std::vector<double> error_rad;  ///< the residual over the stiffness
};

AngleSamples samples_over(const std::string& channel, const Drift& drift, const Dataset& dataset) {
  constexpr std::size_t kEnough = 4000;
  AngleSamples samples;
  const std::size_t step = std::max<std::size_t>(1, drift.residual.size() / kEnough);
  for (std::size_t i = 0; i < drift.residual.size(); i += step) {
    const DriftResidual& at = drift.residual[i];
    const Recording& recording = dataset.records[at.record].recording;
    if (!recording.has(channel)) continue;
    const double angle_rad = recording.channel(channel).values[at.sample];
    if (!std::isfinite(angle_rad) || !(std::abs(at.stiffness) > 0.0)) continue;
    samples.angle_rad.push_back(angle_rad);
    samples.error_rad.push_back(at.value / at.stiffness);
  }
  return samples;
}

/// The least squares of the error on a parabola and, from the second on, a wave.
class PeriodicFit {
 public:
  explicit PeriodicFit(const AngleSamples& samples) : samples_(samples) {
    const auto [lowest, highest] = std::ranges::minmax(samples.angle_rad);
    middle_ = 0.5 * (lowest + highest);
    half_ = 0.5 * (highest - lowest);
    parabola_ = sum_of_squares(0).first;
  }

  [[nodiscard]] double turns() const { return half_ / std::numbers::pi; }

  [[nodiscard]] PeriodicError at(std::size_t periods) const {
    const auto [sum, amplitude_rad] = sum_of_squares(periods);
    return {.amplitude_rad = amplitude_rad,
            .periods = periods,
            .share = parabola_ > 0.0 ? 1.0 - sum / parabola_ : 0.0};
  }

 private:
  static constexpr Eigen::Index kColumns = 5;

  /// The remaining sum of squares, and the amplitude of the wave.
  [[nodiscard]] std::pair<double, double> sum_of_squares(std::size_t periods) const {
    const Eigen::Index columns = periods == 0 ? 3 : kColumns;
    Eigen::MatrixXd products = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(columns);
    Eigen::VectorXd row(columns);
    double total = 0.0;
    for (std::size_t n = 0; n < samples_.angle_rad.size(); ++n) {
      const double z = (samples_.angle_rad[n] - middle_) / half_;
      row.head(3) << 1.0, z, z * z;
      if (periods > 0) {
        const double phase = static_cast<double>(periods) * samples_.angle_rad[n];
        row.tail(2) << std::cos(phase), std::sin(phase);
      }
      products.noalias() += row * row.transpose();
      right += samples_.error_rad[n] * row;
      total += samples_.error_rad[n] * samples_.error_rad[n];
    }
    const Eigen::VectorXd found = products.ldlt().solve(right);
    return {total - found.dot(right), periods == 0 ? 0.0 : found.tail(2).norm()};
  }

  const AngleSamples& samples_;
  double middle_ = 0.0;
  double half_ = 0.0;
  double parabola_ = 0.0;
};

/// The mean residual of each part between two changes of the load's sign: first those of negative load.
std::array<std::vector<double>, 2> means_by_sign(const Drift& drift) {
  constexpr double kDeadBand = 0.05;  // share of the largest elastic torque
  double largest = 0.0;
  for (const DriftResidual& at : drift.residual) largest = std::max(largest, std::abs(at.elastic));
  std::array<std::vector<double>, 2> means;
  double sum = 0.0;
  std::size_t samples = 0;
  double sign = 0.0;
  const auto end_part = [&] {
    constexpr std::size_t kLeastSamples = 10;
    if (samples >= kLeastSamples)
      means.at(sign > 0.0 ? 1 : 0).push_back(sum / static_cast<double>(samples));
    sum = 0.0;
    samples = 0;
  };
  for (std::size_t i = 0; i < drift.residual.size(); ++i) {
    const DriftResidual& at = drift.residual[i];
    const bool is_new = i > 0 && at.record != drift.residual[i - 1].record;
    if (std::abs(at.elastic) < kDeadBand * largest && !is_new) continue;
    const double now = std::copysign(1.0, at.elastic);
    if (now != sign || is_new) end_part();
    sign = now;
    sum += at.value;
    ++samples;
  }
  end_part();
  return means;
}

}  // namespace

std::string_view name(JointTrait trait) noexcept {
  switch (trait) {
    case JointTrait::stiffness: return "stiffness";
    case JointTrait::friction: return "friction";
    case JointTrait::zero: return "zero";
    case JointTrait::backlash: return "backlash";
    case JointTrait::encoder_error: return "encoder error";
    case JointTrait::loose_sensor: return "loose sensor";
    case JointTrait::asymmetry: return "asymmetry";
    case JointTrait::noise: break;
  }
  return "noise";
}

PeriodicError periodic_error(const Drift& drift, const Dataset& dataset) {
  constexpr std::size_t kMaxPeriods = 64;
  constexpr double kLeastPeriods = 1.25;  // within the motion
  constexpr std::size_t kLeastSamples = 200;
  PeriodicError best;
  for (const Channel& channel : dataset.records.front().recording.channels()) {
    if (!channel.name.ends_with("angle_rad") || channel.name.starts_with("truth_")) continue;
    const AngleSamples samples = samples_over(channel.name, drift, dataset);
    if (samples.angle_rad.size() < kLeastSamples) continue;
    const PeriodicFit fit(samples);
    for (std::size_t periods = 1; periods <= kMaxPeriods; ++periods) {
      if (static_cast<double>(periods) * fit.turns() < kLeastPeriods) continue;
      PeriodicError found = fit.at(periods);
      if (!(found.share > best.share)) continue;
      found.channel = channel.name;
      best = std::move(found);
    }
  }
  return best;
}

double zero_wander(const Drift& drift) {
  constexpr std::size_t kLeastChanges = 4;
  constexpr double kKept = 0.8;
  std::vector<double> distances;
  for (std::vector<double>& means : means_by_sign(drift)) {
    const double median = quantile(means, 0.5);
    for (const double mean : means) distances.push_back(std::abs(mean - median));
  }
  if (distances.size() < kLeastChanges) return kNotMeasured;
  std::ranges::sort(distances);
  distances.resize(
      static_cast<std::size_t>(std::ceil(kKept * static_cast<double>(distances.size()))));
  double squares = 0.0;
  for (const double distance : distances) squares += distance * distance;
  return std::sqrt(squares / static_cast<double>(distances.size()));
}

JointTraits joint_traits(const ModelFile& base, const Dataset& dataset, const Progress& progress) {
  DriftOptions options;
  options.with_residual = true;
  const Drift drift = joint_difference(base, dataset, options, progress);
  JointTraits traits;
  traits.rmse = drift.rmse;
  JointTraits::Value friction;
  JointTraits::Value break_away;
  for (const DriftQuantity& of : drift.quantities) {
    if (of.name == drift_names::kScale) traits[JointTrait::stiffness] = relative(of);
    if (of.name == drift_names::kAsymmetry) traits[JointTrait::asymmetry] = relative(of);
    if (of.name == drift_names::kFriction) friction = relative(of);
    if (of.name == drift_names::kBreakAway) break_away = relative(of);
    if (of.name == drift_names::kZero) traits[JointTrait::zero] = absolute(of);
    if (of.name == "backlash") traits[JointTrait::backlash] = absolute(of);
  }
  traits[JointTrait::friction] = friction_work(friction, break_away);
  const std::string unit = unit_label(base.settings.target);
  const PeriodicError periodic = periodic_error(drift, dataset);
  traits[JointTrait::encoder_error] = {
      .value = periodic.share > 0.0 ? periodic.amplitude_rad : kNotMeasured, .unit = "rad"};
  traits.encoder = periodic.channel;
  traits.encoder_periods = periodic.periods;
  traits[JointTrait::loose_sensor] = {.value = zero_wander(drift), .unit = unit};
  traits[JointTrait::noise] = {.value = drift.corrected_rmse, .unit = unit};
  return traits;
}

}  // namespace torsio
