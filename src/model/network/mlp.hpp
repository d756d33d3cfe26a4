#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/network/dense_stack.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// A static network: dense layers in series, the last one linear with one output, evaluated in
/// float32. Source: paper 001, specification 3.2. Cost: its weights are read once from cache.
/// Nothing is allocated after construction.
class Mlp {
 public:
  static constexpr std::string_view kFamily = "mlp";

  struct Parameters {
    using Family = Mlp;
    NetworkScaling scaling;
    std::vector<DenseLayer> layers;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("scaling", self.scaling);
      visit("layers", self.layers);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no layer, shapes do not fit together, the last layer has not one output
  /// or is not linear, an activation is unknown, a number is not finite, or a scale is not positive.
  explicit Mlp(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept {
    return parameters_.scaling.inputs.centre.size();
  }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return weight_count(parameters_.layers);
  }

  void reset() noexcept {}
  /// A value that is not finite is given back as it is.
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// What the last layer saw in the last step: what an adaptation of that layer learns from.
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept {
    return layers_.last_layer_input(input_.data());
  }

 private:
  Parameters parameters_;
  DenseStack layers_;
  detail::AlignedVector<float> input_;  ///< standardised, padded
};

}  // namespace torsio
