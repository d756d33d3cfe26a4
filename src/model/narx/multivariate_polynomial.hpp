#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A polynomial of many inputs, of which only the monomials that matter are there:
///
///     y = sum_j theta_j prod_i (x_i / s_i)^p_ji
///
/// s_i a scale in the unit of input i, theta_j in the target's unit, p_ji whole numbers. Known to
/// model files as the f of `narx_polynomial`, whose terms `frols` chooses. Source: specification
/// 3.3 (NARX); Billings 2013, Nonlinear System Identification, section 2. Cost: a multiplication
/// for each factor and an input in use, an addition for each term.
class MultivariatePolynomial {
 public:
  static constexpr std::string_view kFamily = "polynomial";
  static constexpr std::size_t kHighestDegree = 20;  ///< degree of one term over all inputs

  struct Parameters {
    using Family = MultivariatePolynomial;
    std::vector<double> scales;  ///< s: one per input, > 0
    Matrix powers;               ///< p: terms x inputs
    std::vector<double> coefficients;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("scales", self.scales);
      visit("powers", self.powers);
      visit("coefficients", self.coefficients);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no term or no input, shapes disagree, a scale is not positive, a
  /// coefficient not finite, a power no whole number, or a term above the highest degree.
  explicit MultivariatePolynomial(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.scales.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return parameters_.coefficients.size();
  }

  void reset() noexcept {}
  Estimate step(Features features) noexcept TORSIO_REALTIME;

 private:
  struct Used {
    std::size_t input = 0;
    double per_scale = 1.0;  ///< 1 / s_i
  };

  Parameters parameters_;
  std::vector<Used> used_;            ///< inputs that occur in a term
  std::vector<std::size_t> factors_;  ///< places in `used_`, term after term, x^2 as twice x
  std::vector<std::size_t> ends_;     ///< end of each term in `factors_`
  std::vector<double> scaled_;        ///< x_i / s_i of `used_`
};

}  // namespace torsio
