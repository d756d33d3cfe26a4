#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

namespace torsio {

/// Where a recording came from, for the card of whatever is trained on it.
struct Source {
  std::string file;    ///< as the user named it
  std::string sha256;  ///< hash of the file's bytes; empty for a recording that was made in memory
  bool operator==(const Source&) const = default;
};

/// A zero that is taken from each record's own start, or (offline only) from its middle.
struct ZeroRule {
  std::string channel;
  double first_s = 0.0;    ///< mean over this much of the start; 0 with `mid_range`
  bool mid_range = false;  ///< (min + max) / 2 of the record: not causal, and result rows state it
  bool operator==(const ZeroRule&) const = default;
};

/// The standard uncertainty of a sensor at the reading y, the same in all of its recordings:
///
///     u(y)^2 = constant^2 + (relative y)^2
///
/// A model that was learned from the sensor has this error, and no recording of the sensor shows it.
struct SensorUncertainty {
  double constant = 0.0;  ///< unit of the reading
  double relative = 0.0;  ///< share of the reading

  [[nodiscard]] bool is_stated() const noexcept { return constant > 0.0 || relative > 0.0; }
  [[nodiscard]] double at(double reading) const noexcept {
    const double share = relative * reading;
    return std::sqrt(constant * constant + share * share);
  }
  /// The rest of an error bar that contains it: the error against the same sensor. NaN of NaN.
  [[nodiscard]] double taken_out_of(double std_dev, double reading) const noexcept {
    if (!is_stated() || std::isnan(std_dev)) return std_dev;
    const double own = at(reading);
    return std::sqrt(std::max(0.0, (std_dev - own) * (std_dev + own)));
  }

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("constant", self.constant);
    visit("relative", self.relative);
  }
  bool operator==(const SensorUncertainty&) const = default;
};

/// The larger of each part.
[[nodiscard]] inline SensorUncertainty larger_of(const SensorUncertainty& first,
                                                 const SensorUncertainty& second) noexcept {
  return {std::max(first.constant, second.constant), std::max(first.relative, second.relative)};
}

/// "sqrt((0.21 Nm)^2 + (0.6 % of the value)^2) (standard uncertainty)", of a channel's sensor. Empty: not stated.
[[nodiscard]] std::string uncertainty_text(const SensorUncertainty& sensor,
                                           std::string_view channel);

}  // namespace torsio
