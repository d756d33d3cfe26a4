#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "fit/common/fitted.hpp"
#include "fit/common/shared_options.hpp"
#include "model/grey_box/grey_box.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What may be learned on top of the box.
enum class ResidualKind : std::uint8_t {
  none,
  mlp,        ///< a network of two layers of 16
  dgmm,       ///< a mixture of 50 components
  products,   ///< all products of up to three inputs
  gp,         ///< a sparse Gaussian process of 24 points
  automatic,  ///< the one of mlp, products and gp that predicts held-out recordings best, or none
};

inline constexpr std::array<std::string_view, 6> kResidualNames{"none",     "mlp", "dgmm",
                                                                "products", "gp",  "auto"};

struct GreyBoxOptions {
  std::string schedule = {};  ///< expression of the input to schedule over; empty: constant
  /// Only slip forces, branches and friction of rates >= 0, which take energy and never give it; no residual.
  bool passive = false;
  bool banks = true;    ///< slip elements, curves and inertias over other inputs may be added
  bool average = true;  ///< the boxes whose held-out errors are nearly as low are averaged
  double bound = 3.0;   ///< limit of the residual, in RMSE of the box
  ResidualKind residual = ResidualKind::automatic;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.schedule, kScheduleOption);
    visit(self.passive,
          {.name = "passive",
           .help = "only friction and relaxation that take energy, as true ones do; no residual"});
    visit(self.banks,
          {.name = "banks",
           .help = "slip elements, curves, products and inertias over other inputs than the first, "
                   "where held-out recordings gain; never if passive"});
    visit(self.average,
          {.name = "average",
           .help = "average the best model with those one step away whose held-out errors are at "
                   "most 2 % higher; not with banks or a schedule"});
    visit(
        self.residual,
        {.name = "residual",
         .help = "learned on what the terms leave over; auto: mlp, products or gp if it lowers the "
                 "error on held-out recordings",
         .choices = kResidualNames});
    visit(self.bound,
          {.name = "bound",
           .maximum = 1e6,
           .help = "limit of the residual model, in root mean squares of the residual"});
  }
};

/// `held_out_rmse`: root mean square error on what was held out, the residual's share taken off; of a
/// single record the larger of those on blocks and on contiguous fifths: what error bars are to be wide
/// as.
using FittedGreyBox = Fitted<GreyBox>;

/// Chooses terms by cross-validation and fits them by least squares, slip forces and branches >= 0
/// unless signed ones are clearly better.
///
/// Starting from the linear model, the step (more knots of the curve, more slip elements, more
/// knots of their forces, signed forces, relaxation, viscous and dry friction of rates, less
/// smoothing) that lowers the held-out error most is taken as long as it lowers it by 1 %. Where records are held out, passive
/// terms are searched on their own as well, and the better terms of both are taken. Held out
/// are: the records one at a time, if there are two; of a schedule the inner knots, one at a
/// time, interpolated over the others; else fifths of interleaved blocks. Every candidate is
/// evaluated on sums that are computed once (AᵀA of all terms, for each fold), so the search does
/// not read the data again. Smoothing: λ n Σ (second difference)² over the knots of curve and
/// forces. Deterministic. The average of the boxes that are nearly as good (`box_average`) is taken, if none
/// has banks. Banks over other inputs are added where they lower the folds' errors in
/// their geometric mean by a tenth (a fifth on blocks), and the terms of the first input are chosen
/// again beside them (`GreyBoxSearch::choose_banks`). A bank over a rate is not added where a lag of the
/// target explains as much (`explained_by_lag`); a note then states the lag.
/// @throws Error if the first input is constant, or as `groups_by`, or UsageError for a residual of a passive box.
[[nodiscard]] FittedGreyBox fit_grey_box(const TrainingData& data, const GreyBoxOptions& options,
                                         const FitContext& context = {});

}  // namespace torsio
