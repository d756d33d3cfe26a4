#pragma once

#include <string>

#include "fit/common/fitted.hpp"
#include "fit/common/shared_options.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct LinearOptions {
  bool rates = false;         ///< give inputs that are rates a slope too
  std::string schedule = {};  ///< expression of the input to schedule over; empty: constant

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.rates, kRatesOption);
    visit(self.schedule, kScheduleOption);
  }
};

/// Least squares over the usable samples; scheduled, one fit at each distinct value of the
/// scheduling input, which has no slope of its own. Inputs that are constant or depend linearly on
/// those before them get no term, and a note reports it.
/// @throws Error if no input may have a slope, samples are too few, or the scheduling input has
/// less than 2 or more than 64 values; UsageError if there is no such input.
[[nodiscard]] Fitted<Linear> fit_linear(const TrainingData& data, const LinearOptions& options);

struct LinearCoulombOptions {
  bool rates = false;
  std::string schedule = {};
  double rate_scale = kNotMeasured;  ///< v, in the rate's unit; NaN: searched for

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.rate_scale,
          {.name = "rate_scale",
           .minimum = 1e-12,
           .maximum = 1e12,
           .help = "rate at which friction reaches 76 % of its full value; auto: searched for"});
    visit(self.rates, kRatesOption);
    visit(self.schedule, kScheduleOption);
  }
};

/// The same with a friction term on the first input that is a rate. v minimises the total sum of
/// squares of all groups: a logarithmic grid from a thousandth of the rate's RMS to its maximum,
/// then golden section, the linear coefficients eliminated at each step (variable projection, Golub
/// & Pereyra 1973). Deterministic.
/// @throws Error as `fit_linear`, and if no input is a rate or it never moves.
[[nodiscard]] Fitted<LinearCoulomb> fit_linear_coulomb(const TrainingData& data,
                                                       const LinearCoulombOptions& options);

}  // namespace torsio
