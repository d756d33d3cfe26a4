#pragma once

#include <cstddef>
#include <span>
#include <variant>
#include <vector>

#include "model/gaussian_process/parametric_gp.hpp"
#include "model/grey_box/input_products.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A learned correction to a grey box: a small model of the inputs and of the slips s_i / r_i, bounded, and faded out
/// where an input leaves what it was trained on.
struct GreyBoxResidual {
  std::variant<Mlp::Parameters, Dgmm::Parameters, InputProducts::Parameters,
               ParametricGp::Parameters>
      model = {};
  double bound = 0.0;               ///< largest |correction|, target's unit
  std::vector<double> lowest = {};  ///< per input, in training
  std::vector<double> highest = {};
  static constexpr double kBorder = 0.1;  ///< share of the range: end of the fading beyond it

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("model", self.model);
    visit("bound", self.bound);
    visit("lowest", self.lowest);
    visit("highest", self.highest);
  }
};

/// Evaluates a residual.
class GreyBoxCorrection {
 public:
  /// @throws Error if the model makes no sense, has other inputs than there are limits, or a limit or the bound is none.
  explicit GreyBoxCorrection(const GreyBoxResidual& residual);

  [[nodiscard]] std::size_t input_count() const noexcept { return lowest_.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  /// 0 where an input is more than a tenth of its range outside, or the model's value is not finite.
  [[nodiscard]] double value(std::span<const double> inputs) noexcept TORSIO_REALTIME;

 private:
  std::variant<std::monostate, Mlp, Dgmm, InputProducts, ParametricGp> model_;
  double bound_ = 0.0;
  std::vector<double> lowest_;
  std::vector<double> highest_;
};

}  // namespace torsio
