#include "joint_load/load_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "data/channel_names.hpp"
#include "data/names.hpp"
#include "joint_load/local_quartic.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kWidthStep = 1.2;
constexpr double kNarrower = 2.0 / 3.0;
constexpr double kLongest_s = 0.5;         ///< half-width: joints move faster than that
constexpr std::size_t kLeastWindows = 10;  ///< in the shortest recording
constexpr std::size_t kEnough = 20000;     ///< samples of an angle
constexpr double kCertain = 1.05;    ///< share of the noise above which a difference is a loss
constexpr double kHopeless = 100.0;  ///< times the least square

/// Straight lines over the samples at which the value was only held.
void bridge_held(const Channel& channel, std::vector<double>& values) {
  if (channel.fresh.empty()) return;
  std::size_t last = values.size();
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!channel.is_fresh(n)) continue;
    for (std::size_t i = last + 1; last < n && i < n; ++i)
      values[i] = std::lerp(values[last], values[n],
                            static_cast<double>(i - last) / static_cast<double>(n - last));
    last = n;
  }
}

/// Mean square of body(n) over some samples that have `margin` samples on either side; NaN values are passed over.
template <class Body>
double mean_square(std::size_t samples, std::size_t margin, const Body& body) {
  const std::size_t stride = samples / kEnough + 1;
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t n = margin; n + margin < samples; n += stride)
    if (const double value = body(n); std::isfinite(value)) {
      sum += value * value;
      count += 1.0;
    }
  return count > 0.0 ? sum / count : 0.0;
}

double square_of_difference(std::span<const double> angle_rad, const LocalQuartic& wide,
                            const LocalQuartic& narrow) {
  return mean_square(angle_rad.size(), wide.half_width(), [&](std::size_t n) {
    return wide.curvature(angle_rad, n) - narrow.curvature(angle_rad, n);
  });
}

/// Variance of the encoder's noise.
double noise_variance(std::span<const double> angle_rad, double sample_rate_Hz) {
  const LocalQuartic wide(6, sample_rate_Hz);
  const LocalQuartic narrow(4, sample_rate_Hz);
  return square_of_difference(angle_rad, wide, narrow) / wide.variance_of_difference(narrow);
}

/// The errors of one angle from narrow to wide polynomials.
class WidthScan {
 public:
  WidthScan(std::span<const double> angle_rad, double sample_rate_Hz)
      : angle_rad_(angle_rad),
        sample_rate_Hz_(sample_rate_Hz),
        variance_(noise_variance(angle_rad, sample_rate_Hz)) {}

  /// @param half_width wider than before
  AccelerationError next(std::size_t half_width) {
    const auto narrower = std::max(
        LocalQuartic::kLeastHalfWidth,
        static_cast<std::size_t>(std::lround(kNarrower * static_cast<double>(half_width))));
    const LocalQuartic wide(half_width, sample_rate_Hz_);
    const LocalQuartic narrow(narrower, sample_rate_Hz_);
    const double square = square_of_difference(angle_rad_, wide, narrow);
    const double of_noise = variance_ * wide.variance_of_difference(narrow);
    const double share =
        1.0 - std::pow(static_cast<double>(narrower) / static_cast<double>(half_width), 4);
    const double loss_rad_s2 = std::sqrt(std::max(0.0, square - of_noise)) / share;
    // What a narrower polynomial has lost for certain does not come back where both have lost it.
    if (square > kCertain * of_noise) lost_rad_s2_ = std::max(lost_rad_s2_, loss_rad_s2);
    return {.noise_rad_s2 = std::sqrt(variance_ * wide.curvature_variance()),
            .loss_rad_s2 = std::max(loss_rad_s2, lost_rad_s2_)};
  }

 private:
  std::span<const double> angle_rad_;
  double sample_rate_Hz_;
  double variance_;
  double lost_rad_s2_ = 0.0;
};

/// Half-widths that are tried, up to and with the longest.
std::vector<std::size_t> widths_to(std::size_t longest) {
  constexpr std::size_t kFirst = 4;
  std::vector<std::size_t> all;
  double width = kFirst;
  for (std::size_t next = kFirst; next <= longest;) {
    if (all.empty() || next > all.back()) all.push_back(next);
    width *= kWidthStep;
    next = static_cast<std::size_t>(std::lround(width));
  }
  if (all.empty() || all.back() < longest) all.push_back(std::max(longest, kFirst));
  return all;
}

std::size_t longest_width(std::span<const WeightedAngle> angles, double sample_rate_Hz) {
  std::size_t shortest = std::numeric_limits<std::size_t>::max();
  for (const WeightedAngle& angle : angles) shortest = std::min(shortest, angle.angle_rad.size());
  return std::min(static_cast<std::size_t>(kLongest_s * sample_rate_Hz),
                  shortest / (2 * kLeastWindows));
}

}  // namespace

std::vector<double> load_angle(const Recording& recording) {
  if (!recording.has(kLoadAngle))
    throw Error({.place = recording.name(),
                 .expected = fmt::format("the channel {}, with which the load turns", kLoadAngle),
                 .found = joined(channel_names(recording.channels())),
                 .advice = "Name the column of the encoder at the joint's output in a mapping."});
  const Channel& channel = recording.channel(kLoadAngle);
  std::vector<double> angle_rad = channel.values;
  bridge_held(channel, angle_rad);
  for (std::size_t n = 1; n < angle_rad.size(); ++n)
    if (std::abs(angle_rad[n] - angle_rad[n - 1]) > std::numbers::pi)
      throw Error(
          {.place = fmt::format("{}: {}, t = {:.6g} s", recording.name(), kLoadAngle,
                                recording.time_s(n)),
           .expected = "an angle without jumps, whose second derivative is the acceleration",
           .found = fmt::format("a jump by {:.4g} rad", angle_rad[n] - angle_rad[n - 1]),
           .advice = "If its column begins again after a turn, give it 'unwrap:' in a mapping "
                     "(docs/use/recordings.md)."});
  return angle_rad;
}

std::size_t choose_half_width(std::span<const WeightedAngle> angles, double sample_rate_Hz) {
  std::vector<WidthScan> scans;
  for (const WeightedAngle& angle : angles) scans.emplace_back(angle.angle_rad, sample_rate_Hz);
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t half_width : widths_to(longest_width(angles, sample_rate_Hz))) {
    std::vector<double> squares(angles.size());
    for_each_chunk(angles.size(), 0, [&](std::size_t a) {
      squares[a] = static_cast<double>(angles[a].angle_rad.size()) *
                   scans[a].next(half_width).square() * angles[a].inertia_kg_m2 *
                   angles[a].inertia_kg_m2;
    });
    const double sum = std::accumulate(squares.begin(), squares.end(), 0.0);
    if (sum > kHopeless * least) break;
    if (!(sum < least)) continue;
    least = sum;
    best = half_width;
  }
  return best;
}

AccelerationError acceleration_error(std::span<const double> angle_rad, std::size_t half_width,
                                     double sample_rate_Hz) {
  WidthScan scan(angle_rad, sample_rate_Hz);
  AccelerationError error;
  for (const std::size_t width : widths_to(half_width)) error = scan.next(width);
  return error;
}

LoadMotion load_motion(std::span<const double> angle_rad, std::size_t half_width,
                       double sample_rate_Hz) {
  const LocalQuartic quartic(half_width, sample_rate_Hz);
  const std::size_t samples = angle_rad.size();
  LoadMotion motion{.angle_rad = std::vector<double>(samples, kNotMeasured),
                    .acceleration_rad_s2 = std::vector<double>(samples, kNotMeasured)};
  for (std::size_t n = half_width; n + half_width < samples; ++n) {
    motion.angle_rad[n] = quartic.value(angle_rad, n);
    motion.acceleration_rad_s2[n] = quartic.curvature(angle_rad, n);
  }
  return motion;
}

}  // namespace torsio
