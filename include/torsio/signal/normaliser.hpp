#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// Scales channels to comparable size: y_j = (x_j - centre_j) / scale_j.
class Normaliser {
 public:
  /// Plain data, stored with a model.
  struct Parameters {
    std::vector<double> centre;  ///< one per channel, the channel's unit
    std::vector<double> scale;   ///< one per channel, the channel's unit, positive
    bool operator==(const Parameters&) const = default;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("centre", self.centre);
      visit("scale", self.scale);
    }
  };

  /// @throws UsageError if the lengths differ, a centre is not finite or a scale not positive and
  /// finite.
  explicit Normaliser(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t channel_count() const noexcept { return parameters_.scale.size(); }

  /// `from` and `to` hold `channel_count()` values each and may be the same.
  void apply(std::span<const double> from, std::span<double> to) const noexcept TORSIO_REALTIME {
    for (std::size_t j = 0; j < channel_count(); ++j)
      to[j] = (from[j] - parameters_.centre[j]) / parameters_.scale[j];
  }

  /// The inverse of `apply`, up to rounding.
  void undo(std::span<const double> from, std::span<double> to) const noexcept TORSIO_REALTIME {
    for (std::size_t j = 0; j < channel_count(); ++j)
      to[j] = from[j] * parameters_.scale[j] + parameters_.centre[j];
  }

 private:
  Parameters parameters_;
};

}  // namespace torsio
