#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/aligned_vector.hpp"
#include "torsio/model/model.hpp"
#include "torsio/model/network_layers.hpp"

namespace torsio {

/// A network with memory: GRU layers, then dense ones, evaluated in float32. Source: SPEC section 3.4.
///
/// One call is one sample: the state goes on from call to call (SPEC section 3.4, streaming a). It
/// starts at zero, and until `warm_up_samples` steps after a reset the value carries
/// `Fault::warming_up`. A discrete model: it runs at the sample period that it was trained at and at
/// no other.
class Gru {
 public:
  static constexpr std::string_view kFamily = "gru";

  struct Parameters {
    NetworkScaling scaling;
    std::vector<GruLayer> layers;
    std::vector<DenseLayer> head;
    double sample_period_s = 0.0;
    std::size_t warm_up_samples = 0;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("scaling", self.scaling);
      visit("layers", self.layers);
      visit("head", self.head);
      visit("sample_period_s", self.sample_period_s);
      visit("warm_up_samples", self.warm_up_samples);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no layer, shapes do not fit together, the last layer has not one output
  /// or is not linear, an activation is unknown, a number is not finite, or the period is not positive.
  explicit Gru(const Parameters& parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept;
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.sample_period_s;
  }  ///< [s]

  /// To the zero state.
  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// What the last layer saw in the last step: what an adaptation of that layer learns from.
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept;

 private:
  Parameters parameters_;
};

}  // namespace torsio
