#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// Which members of a population may be outliers.
enum class OutlierSides : std::uint8_t { both, upper };

/// In a smaller population no member is an outlier.
inline constexpr std::size_t kLeastMembers = 8;

/// One member of a population.
struct OutlierScore {
  double distance = kNotMeasured;  ///< from the median, in the value's unit
  /// Upper 90 % bound of the probability that a sound member lies at least so far from the median on
  /// this side.
  double probability = kNotMeasured;
  double expected = kNotMeasured;  ///< that probability times the number of members
  bool is_outlier = false;
};

/// A population and its outliers.
struct OutlierTest {
  double median = kNotMeasured;
  double lowest = kNotMeasured;   ///< below it a member is an outlier; NaN: none can be
  double highest = kNotMeasured;  ///< above it a member is an outlier; NaN: none can be
  /// The tails are fitted; false: too few members for it, so that they are assumed to be those of a
  /// normal distribution.
  bool has_fitted_tails = false;
  std::vector<OutlierScore> scores = {};  ///< one a value; NaN where the value is not finite
};

struct OutlierOptions {
  OutlierSides sides = OutlierSides::both;
  /// A member is an outlier if fewer sound members than this are expected so far out.
  double max_expected = 0.1;
  /// No value nearer to the median than this is an outlier: what the use does not notice.
  double tolerance = 0.0;
};

/// Finds members that do not belong to a population, of which at most 1.5 % on each side may be outliers.
///
/// From 100 values on, the tail on each side is a generalised Pareto distribution (Pickands 1975) of
/// the excess y over the quantile u at 75 %:
///
///     P(X > u + y) = 0.25 (1 + xi y / sigma)^(-1 / xi)
///
/// fitted by maximum likelihood to the values up to the quantile at 98.5 %, those beyond being censored,
/// and again without the outliers that it shows; xi is between -1/2 (a density that falls linearly to its
/// end) and 0 (an exponential one). The probability is the largest within the likelihood region of 90 %. A
/// population with bounds (xi < 0), as one of parts within tolerances, thus has narrow limits, one with long
/// tails wide ones. Even a uniform one is given an end beyond its own, since noise rounds it where the
/// censored values are. With fewer values, from 8 on, the distance over 1.4826 times the median absolute deviation
/// is taken as Student's t with a third of n - 1 degrees of freedom, since this deviation has the
/// efficiency 0.37. With fewer than 8 no member is an outlier.
[[nodiscard]] OutlierTest find_outliers(std::span<const double> values,
                                        const OutlierOptions& options = {});

}  // namespace torsio
