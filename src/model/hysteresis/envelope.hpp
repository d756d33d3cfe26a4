#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace torsio {

/// Two curves of x that a hysteresis loop runs between:
///
///     f(x) = m(z) +- h(z),   z = (x - centre) / half_range,   h >= 0
///
/// m and h are polynomials within the training range, z in -1..1; outside, m is extrapolated
/// linearly and h keeps its value at the end, so that neither diverges.
struct Envelope {
  std::vector<double> middle = {};      ///< m, constant first, in the target's unit
  std::vector<double> half_width = {};  ///< h, likewise; a value below 0 counts as 0
  double centre = 0.0;                  ///< x's unit
  double half_range = 1.0;              ///< x's unit, > 0

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("middle", self.middle);
    visit("half_width", self.half_width);
    visit("centre", self.centre);
    visit("half_range", self.half_range);
  }
  bool operator==(const Envelope&) const = default;

  /// @throws Error if a polynomial is empty or above `kHighestDegree`, something is not finite, or
  /// half_range is not positive.
  void check(std::string_view family) const;
  static constexpr std::size_t kHighestDegree = 20;

  struct At {
    double middle = 0.0;
    double half_width = 0.0;
    [[nodiscard]] double upper() const noexcept { return middle + half_width; }
    [[nodiscard]] double lower() const noexcept { return middle - half_width; }
  };
  [[nodiscard]] At at(double x) const noexcept;
  /// Largest h of `kSamples` equally spaced x.
  [[nodiscard]] double widest(double lowest, double highest) const noexcept;
  static constexpr int kSamples = 200;
};

}  // namespace torsio
