#pragma once

#include <cstddef>
#include <string>

#include "fit/common/fitted.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct ViscoelasticOptions {
  std::string network = "generalised_maxwell(2)";  ///< `parse_network`
  std::size_t starts = 10;                         ///< searches, 1 or more
  double prior = 0.0;                              ///< see `fit_viscoelastic`; 0: none
  bool is_refined = true;  ///< false: the given values as they are, the offset alone is fitted
  bool is_at_rest = true;  ///< each record starts relaxed; false: from a state that is fitted too

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.network,
          {.name = "network",
           .help = "springs and dashpots, like series(kv(k1, d1), k2), or a name: hooke, maxwell, "
                   "kelvin_voigt, standard_linear_solid, burgers, generalised_maxwell(n), 003a to "
                   "003d"});
    visit(self.is_refined,
          {.name = "refine",
           .help = "false: the given values (k1=300) as they are, the offset alone is fitted"});
    visit(self.is_at_rest,
          {.name = "at_rest",
           .help = "each record starts relaxed; false: from a state that is fitted too"});
    visit(self.starts, {.name = "starts", .minimum = 1, .maximum = 1000, .help = "of the search"});
    visit(self.prior, {.name = "prior",
                       .maximum = 1000,
                       .help = "draws the logarithm of each parameter towards its start value, "
                               "within this; 0: off"});
  }
};

/// Least squares over the free run:
///
///     min_(p, b) sum (y_n(p, b) - target_n)^2,    p_j = 1e-4 s_j + exp(q_j) > 0
///
/// Each record starts relaxed at its first deflection, or from the state z_0 with the least error:
/// z_0 enters linearly and is eliminated exactly. A slow branch can then explain what the network
/// cannot, so this is for records that start in motion. s: std(target) / std(u) for springs, that
/// times the geometric mean of sample period and longest record for dashpots. Levenberg-Marquardt
/// by Levenberg-Marquardt over q and b from several starts (the given values first, then random ones with
/// relaxation times from two samples to a quarter of the longest record); all are searched with few
/// iterations, the best three to the end. Of more than 30 000 usable samples every m-th is scored.
/// Parallel networks of one shape are interchangeable: the fastest comes first.
///
/// With `prior` each ln p_j is drawn towards its start value (s_j, if none is given) as if that had
/// been measured once with this standard deviation, in units of the RMSE without it: a constraint
/// on the parameters that the data do not determine.
///
/// Source: specification 3.6. The standard errors hold for white residuals and are too small for
/// coloured ones. The notes state which combinations of parameters the data do not determine, which
/// they hardly determine, and which relaxation times lie outside of the band that the records
/// excite.
/// @throws UsageError for the network's text, a number of starts or a prior out of range; Error if
/// deflection or target are constant, or the search does not converge; Cancelled.
[[nodiscard]] Fitted<Viscoelastic> fit_viscoelastic(const TrainingData& data,
                                                    const ViscoelasticOptions& options,
                                                    const FitContext& context = {});

}  // namespace torsio
