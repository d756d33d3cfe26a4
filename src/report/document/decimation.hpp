#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// The extremes of every bucket of `bucket` samples, two values for each bucket, in the order of their time: no peak is
/// lost. NaN where a bucket has no finite value. The page makes coarser levels of it itself.
[[nodiscard]] std::vector<float> overview_of(std::span<const double> values, std::size_t bucket);

/// The samples of the windows, one after the other; what is not finite is NaN.
[[nodiscard]] std::vector<float> detail_of(std::span<const double> values,
                                           const std::vector<DetailWindow>& windows);

/// A sample that deserves full resolution, and why.
struct PlaceOfInterest {
  std::size_t sample = 0;
  std::string label;
};

/// How the series of one time figure are reduced, so that it has at most about `max_values` values.
struct OverviewPlan {
  std::size_t bucket = 1;
  std::vector<DetailWindow> windows;
};

inline constexpr std::size_t kMaxWindows = 20;
/// A short recording has one window over all of it, a long one up to `kMaxWindows` windows about
/// the places, in their order; a place in an earlier window needs none.
/// @param series number of the figure's series
[[nodiscard]] OverviewPlan plan_overview(std::size_t samples, std::size_t series,
                                         const std::vector<PlaceOfInterest>& places,
                                         std::size_t max_values);

/// A curve without the points that lie within 1/600 of the drawn range of the one before; more are left out
/// until there are at most `max_points`. Gaps (points that are not finite) stay.
struct ThinnedCurve {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<std::size_t> kept;  ///< indices of the points
};
inline constexpr std::size_t kMaxCurvePoints = 4000;
[[nodiscard]] ThinnedCurve thinned(std::span<const double> x, std::span<const double> y,
                                   std::size_t max_points = kMaxCurvePoints);

/// First and last sample at which x reverses its direction by more than a twentieth of its range; none if it never
/// does.
[[nodiscard]] std::vector<PlaceOfInterest> reversals_of(std::span<const double> x);

}  // namespace torsio
