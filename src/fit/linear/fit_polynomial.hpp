#pragma once

#include <cstddef>
#include <string>

#include "fit/common/fitted.hpp"
#include "fit/common/shared_options.hpp"
#include "model/linear/polynomial.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct PolynomialOptions {
  std::size_t degree = 5;  ///< 0: chosen by cross-validation, 1 to `kHighestChosenDegree`
  bool branch = true;      ///< one curve for each direction of the first input
  double dead_band =
      kNotMeasured;           ///< first input's unit; NaN: `default_dead_band`. Only by branch.
  bool rates = false;         ///< give other inputs that are rates a slope too
  std::string schedule = {};  ///< expression of the input to schedule over; empty: constant

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.degree, {.name = "degree",
                        .maximum = Polynomial::kHighestDegree,
                        .help = "of the curve; 0: chosen by cross-validation"});
    visit(self.branch,
          {.name = "branch", .help = "one curve for each direction of the first input"});
    visit(self.dead_band,
          {.name = "dead_band",
           .maximum = 1e12,
           .help = "how far the first input moves back before its direction turns"});
    visit(self.rates, kRatesOption);
    visit(self.schedule, kScheduleOption);
  }
};

inline constexpr std::size_t kHighestChosenDegree = 9;

/// Least squares over the usable samples; scheduled as `fit_linear`. By branch, samples whose
/// direction is not known yet are left out. The chosen degree is the lowest whose error is within
/// 1 % of the best, held out in 5 folds of 10 interleaved contiguous blocks (of each knot's
/// samples).
/// @throws Error if the first input is constant, moves in one direction only (by branch), or as
/// `fit_linear`.
[[nodiscard]] Fitted<Polynomial> fit_polynomial(const TrainingData& data,
                                                const PolynomialOptions& options);

/// The larger of two steps of the first input's resolution (its smallest change between two
/// samples) and half a percent of its range. Specification 3.7 requires 2 LSB; that alone would
/// follow the noise of a fine encoder.
[[nodiscard]] double default_dead_band(const TrainingData& data);

}  // namespace torsio
