#include "torsio/evaluate/slow_cycle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <string_view>

#include "core/report_progress.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr double kPeriod_s = 20.0;
constexpr std::size_t kPoints = 9;
constexpr std::size_t kTicksPerReport = 100;

constexpr std::string_view kGear = "gear_angle_rad";
constexpr std::string_view kJoint = "joint_angle_rad";
constexpr std::string_view kDeflection = "spring_deflection_rad";

/// The raw channels of a joint at rest whose spring has some deflection.
class RestingJoint {
 public:
  explicit RestingJoint(const ModelFile& model)
      : settings_(model.settings),
        names_(FeaturePipeline(settings_.features, settings_.sample_rate_Hz).raw_inputs()),
        raw_(names_.size(), 0.0) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (names_[i] == kGear || names_[i] == kDeflection) continue;
      const auto range = range_of(names_[i]);
      if (range) raw_[i] = std::midpoint(range->first, range->second);
      if (names_[i] == kJoint) {
        joint_rad_ = raw_[i];
      } else if (range) {
        held_.emplace_back(names_[i], raw_[i]);
      } else if (undetermined_.empty()) {
        undetermined_ = names_[i];
      }
    }
  }

  /// A channel that a cycle of the deflection does not determine; empty: none.
  [[nodiscard]] const std::string& undetermined() const noexcept { return undetermined_; }
  [[nodiscard]] const std::vector<std::pair<std::string, double>>& held() const noexcept {
    return held_;
  }
  [[nodiscard]] const std::vector<double>& raw(double deflection_rad) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (names_[i] == kGear) raw_[i] = joint_rad_ + deflection_rad;
      if (names_[i] == kDeflection) raw_[i] = deflection_rad;
    }
    return raw_;
  }

  /// The input that is the deflection.
  [[nodiscard]] std::optional<std::size_t> deflection_input() {
    constexpr double kTolerance = 0.02;  // filters have settled to about 1 %
    std::vector<bool> is_deflection(settings_.features.inputs.size(), true);
    for (const double deflection_rad : {0.01, -0.02}) {
      FeaturePipeline pipeline(settings_.features, settings_.sample_rate_Hz);
      pipeline.reset();
      std::vector<double> features;
      // A rate is 0 then, and a filter has settled.
      for (std::size_t n = 0; n <= pipeline.settling_samples(); ++n) {
        const auto stepped = pipeline.step(raw(deflection_rad));
        features.assign(stepped.begin(), stepped.end());
      }
      for (std::size_t j = 0; j < features.size(); ++j)
        if (!(std::abs(features[j] / deflection_rad - 1.0) < kTolerance)) is_deflection[j] = false;
    }
    const auto found = std::ranges::find(is_deflection, true);
    if (found == is_deflection.end()) return std::nullopt;
    return static_cast<std::size_t>(found - is_deflection.begin());
  }

 private:
  /// The range in training of a raw channel that is itself an input.
  [[nodiscard]] std::optional<std::pair<double, double>> range_of(
      const std::string& channel) const {
    const auto& inputs = settings_.features.inputs;
    const auto at = std::ranges::find(inputs, channel);
    if (at == inputs.end()) return std::nullopt;
    const auto j = static_cast<std::size_t>(at - inputs.begin());
    const std::pair range{settings_.ranges.lowest[j], settings_.ranges.highest[j]};
    if (std::abs(range.first) >= kOpenRange || std::abs(range.second) >= kOpenRange)
      return std::nullopt;
    return range;
  }

  const EstimatorSettings& settings_;
  std::vector<std::string> names_;
  std::vector<double> raw_;
  std::string undetermined_;
  std::vector<std::pair<std::string, double>> held_;
  double joint_rad_ = 0.0;
};

/// The second half of three cycles between `lowest_rad` and `highest_rad`.
struct Branches {
  std::vector<double> up;    ///< torque at lowest, ... highest
  std::vector<double> down;  ///< the same order
  Fault fault = Fault::none;
};

Branches run(Estimator estimator, RestingJoint& joint, double lowest_rad, double highest_rad,
             const Progress& progress) {
  const auto half =
      static_cast<std::size_t>(std::ceil(0.5 * kPeriod_s * estimator.settings().sample_rate_Hz));
  const auto at = [&](std::size_t tick) {
    return std::lerp(lowest_rad, highest_rad,
                     static_cast<double>(tick) / static_cast<double>(half));
  };
  const DenormalsOff denormals_off;
  estimator.reset();
  for (std::size_t n = 0; !estimator.is_settled() && n < half; ++n)
    (void)estimator.step(joint.raw(at(half / 2)));
  for (std::size_t n = half / 2; n < half; ++n) (void)estimator.step(joint.raw(at(n)));
  Branches branches{.up = std::vector<double>(half + 1), .down = std::vector<double>(half + 1)};
  constexpr int kCycles = 2;
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    const auto step = [&](std::size_t tick, std::vector<double>& torque_Nm) {
      if (tick % kTicksPerReport == 0)
        report_progress(progress, static_cast<double>(cycle) / kCycles, "slow cycle");
      const Estimate estimate = estimator.step(joint.raw(at(tick)));
      torque_Nm[tick] = estimate.value;
      if (cycle > 0 && estimate.fault != Fault::none) branches.fault = estimate.fault;
    };
    for (std::size_t tick = half + 1; tick-- > 0;) step(tick, branches.down);
    for (std::size_t tick = 0; tick <= half; ++tick) step(tick, branches.up);
  }
  return branches;
}

/// The slope of the least-squares line through values at equal distances.
double slope(const std::vector<double>& values, double distance) {
  const auto n = static_cast<double>(values.size());
  const double middle = 0.5 * (n - 1.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i)
    sum += (static_cast<double>(i) - middle) * values[i];
  return 12.0 * sum / (n * (n * n - 1.0) * distance);
}

void evaluate(const Branches& branches, SlowCycle& cycle) {
  const std::size_t samples = branches.up.size();
  const std::size_t last = samples - 1;
  std::vector<double> mean(samples);
  std::vector<double> width(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    mean[i] = std::midpoint(branches.up[i], branches.down[i]);
    width[i] = branches.up[i] - branches.down[i];
  }
  const double range_rad = cycle.highest_rad - cycle.lowest_rad;
  const auto deflection = [&](std::size_t i) {
    return cycle.lowest_rad + range_rad * static_cast<double>(i) / static_cast<double>(last);
  };
  cycle.stiffness_Nm_rad = slope(mean, range_rad / static_cast<double>(last));
  const auto largest = static_cast<std::size_t>(
      std::ranges::max_element(width, {}, [](double each) { return std::abs(each); }) -
      width.begin());
  cycle.largest_width_Nm = width[largest];
  cycle.largest_width_at_rad = deflection(largest);
  if (cycle.lowest_rad <= 0.0 && cycle.highest_rad >= 0.0)
    cycle.width_at_zero_Nm = width[static_cast<std::size_t>(
        std::round(-cycle.lowest_rad / range_rad * static_cast<double>(last)))];
  double sum = 0.0;
  for (const double each : width) sum += each;
  cycle.friction_Nm = 0.5 * sum / static_cast<double>(samples);
  const std::size_t part = last / (kPoints + 1);
  const std::size_t near = std::max<std::size_t>(1, part / 2);
  for (std::size_t k = 1; k <= kPoints; ++k) {
    const std::size_t i = last * k / (kPoints + 1);
    cycle.points.push_back({.deflection_rad = deflection(i),
                            .torque_Nm = mean[i],
                            .stiffness_Nm_rad = (mean[i + near] - mean[i - near]) /
                                                (deflection(i + near) - deflection(i - near)),
                            .loop_width_Nm = width[i],
                            .friction_Nm = 0.5 * width[i]});
  }
}

SlowCycle undetermined(std::string reason) {
  SlowCycle cycle;
  cycle.reason = std::move(reason);
  return cycle;
}

}  // namespace

SlowCycle slow_cycle(const ModelFile& model, const Progress& progress) {
  const EstimatorSettings& settings = model.settings;
  if (unit_label(settings.target) != "Nm")
    return undetermined(fmt::format("the model estimates {}, not a torque", settings.target));
  RestingJoint joint(model);
  if (!joint.undetermined().empty())
    return undetermined(
        fmt::format("the inputs depend on {}, which a cycle of the deflection "
                    "does not determine",
                    joint.undetermined()));
  const auto input = joint.deflection_input();
  if (!input) return undetermined("no input is the deflection of the spring");
  SlowCycle cycle{.reason = {},
                  .period_s = kPeriod_s,
                  .lowest_rad = settings.ranges.lowest[*input],
                  .highest_rad = settings.ranges.highest[*input],
                  .held = joint.held(),
                  .points = {}};
  if (std::abs(cycle.lowest_rad) >= kOpenRange || std::abs(cycle.highest_rad) >= kOpenRange)
    return undetermined("the range of the deflection in training is not known");
  if (!(cycle.lowest_rad < cycle.highest_rad))
    return undetermined("the deflection did not change in training");
  Estimator estimator = make_estimator(model);
  for (const std::string& channel : settings.zeroed_channels) estimator.set_zero(channel, 0.0);
  const Branches branches =
      run(std::move(estimator), joint, cycle.lowest_rad, cycle.highest_rad, progress);
  if (branches.fault != Fault::none)
    return undetermined(
        fmt::format("the model reports {} during a slow cycle", name(branches.fault)));
  evaluate(branches, cycle);
  return cycle;
}

}  // namespace torsio
