#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// All products of up to `degree` inputs, smooth in all of them; of degree 2 without the c_ijk:
///
///     z_i = (x_i - m_i) / s_i
///     y = c_0 + sum_i z_i (c_i + sum_{j >= i} z_j (c_ij + sum_{k >= j} c_ijk z_k))
///
/// Known to model files as a residual of `grey_box`. Cost: a multiply-add for each coefficient.
class InputProducts {
 public:
  static constexpr std::string_view kFamily = "products";
  static constexpr std::size_t kLowestDegree = 2;
  static constexpr std::size_t kHighestDegree = 3;
  static constexpr std::size_t kMaxUsed = 32;  ///< inputs with a scale

  struct Parameters {
    using Family = InputProducts;
    std::size_t degree = kHighestDegree;  ///< 2 or 3
    std::vector<double> centres;          ///< m, one per input, in its unit
    std::vector<double> scales;           ///< s, likewise; 0: the input is not used
    std::vector<double> coefficients;     ///< c in the order of the sums above, target's unit

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("degree", self.degree);
      visit("centres", self.centres);
      visit("scales", self.scales);
      visit("coefficients", self.coefficients);
    }
    bool operator==(const Parameters&) const = default;

    /// Places of the inputs that have a scale.
    [[nodiscard]] std::vector<std::size_t> used() const;
  };

  /// Number of coefficients of `used` inputs.
  [[nodiscard]] static std::size_t count(std::size_t used, std::size_t degree) noexcept;
  /// The products themselves in the order of their coefficients, 1 first. @param products `count` of them
  static void terms(std::span<const double> z, std::size_t degree,
                    std::span<double> products) noexcept;

  /// @throws Error if shapes disagree, the degree is none, a scale is negative, all of them are 0, or a number
  /// is not finite.
  explicit InputProducts(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.scales.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return parameters_.coefficients.size();
  }

  void reset() noexcept {}
  Estimate step(Features features) noexcept TORSIO_REALTIME;

 private:
  Parameters parameters_;
  std::vector<std::size_t> used_;
  std::vector<double> z_;  ///< the inputs in use, standardised
};

}  // namespace torsio
