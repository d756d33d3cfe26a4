#pragma once

#include <cstddef>

#include "fit/common/fitted.hpp"
#include "model/second_order/dynamic_bouc_wen.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Options of the searches over free runs of both second-order families.
template <class Self, class Visit>
void visit_free_run_options(Self& self, const Visit& visit) {
  visit(self.substeps, {.name = "substeps",
                        .minimum = 1,
                        .maximum = 1000,
                        .help = "of the integrator in one sample period"});
  visit(self.input_order,
        {.name = "input_order",
         .maximum = CausalPolynomial::kHighestOrder,
         .help = "of the polynomial that interpolates the force between its samples; 0: held"});
  visit(self.first_horizon,
        {.name = "first_horizon",
         .minimum = 10,
         .maximum = 1e9,
         .help = "samples that the first search uses; each further one uses four times as many"});
  visit(
      self.iterations,
      {.name = "iterations", .minimum = 1, .maximum = 1e6, .help = "at most, of the last search"});
}

struct DynamicBoucWenOptions {
  double exponent = 1.0;  ///< n; NaN: searched for
  std::size_t substeps = 4;
  std::size_t input_order = 3;
  std::size_t first_horizon = 500;  ///< samples that the first of the growing searches uses
  std::size_t iterations = 200;     ///< limit of the last search

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.exponent, {.name = "exponent",
                          .minimum = 1,
                          .maximum = 10,
                          .help = "n: how sharply the hysteretic force bends; auto: searched for",
                          .takes_auto = true});
    visit_free_run_options(self, visit);
  }
};

/// Least squares of free runs over masses, springs and the Bouc-Wen element, each record's start
/// searched for too. First a mass on a spring from a grid of frequencies and dampings; then from it
/// twelve shares and shapes of the hysteretic part over a short horizon, the best of them over longer
/// ones. Source of the equations: specification 3.7; the search is ours.
/// @throws Error unless the first input and the target move, and the search converges;
/// Cancelled.
[[nodiscard]] Fitted<DynamicBoucWen> fit_dynamic_bouc_wen(const TrainingData& data,
                                                          const DynamicBoucWenOptions& options,
                                                          const Progress& progress = {});

}  // namespace torsio
