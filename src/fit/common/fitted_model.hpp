#pragma once

#include <concepts>
#include <string>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/option_fields.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The result of a family's fitter in the form of the table of families.
template <class Family>
FittedModel fitted_model(Fitted<Family> fitted) {
  return {Family(std::move(fitted.parameters)),
          std::move(fitted.notes),
          std::move(fitted.table),
          fitted.held_out_rmse,
          fitted.held_out_records,
          fitted.has_held_out_fifths,
          fitted.stroke_growth};
}
inline FittedModel fitted_model(FittedModel fitted) { return fitted; }

namespace detail {

template <class Fitter>
struct OptionsOfFitter;
template <class Result, class Own, class... Rest>
struct OptionsOfFitter<Result (*)(const TrainingData&, const Own&, Rest...)> {
  using Type = Own;
};

/// Progress text "fitting linear" for fitters that report no progress of their own.
template <class Family>
void report_start(const Progress& progress, const Fitted<Family>* /*result*/) {
  report_progress(progress, 0.0, "fitting " + std::string(Family::kFamily));
}

template <auto kFit>
using OptionsOf = typename OptionsOfFitter<decltype(kFit)>::Type;

template <auto kFit>
FittedModel fit_with(const TrainingData& data, const OptionsOf<kFit>& own,
                     const FitContext& context) {
  using Own = OptionsOf<kFit>;
  if constexpr (std::invocable<decltype(kFit), const TrainingData&, const Own&,
                               const FitContext&>) {
    return fitted_model(kFit(data, own, context));
  } else if constexpr (std::invocable<decltype(kFit), const TrainingData&, const Own&,
                                      const Progress&>) {
    return fitted_model(kFit(data, own, context.progress));
  } else {
    report_start(context.progress, static_cast<decltype(kFit(data, own))*>(nullptr));
    return fitted_model(kFit(data, own));
  }
}

template <auto kFit>
FittedModel fit_with_options(const TrainingData& data, const Options& given,
                             const FitContext& context) {
  return fit_with<kFit>(data, filled<OptionsOf<kFit>>(given), context);
}

}  // namespace detail

/// A row of the table of families, its options and their adapter made from the fitter's signature:
/// (data, options), followed by nothing, a `Progress` or a `FitContext`.
template <auto kFit>
[[nodiscard]] FamilyInfo family_of(FamilyInfo stated) {
  stated.options = options_of<detail::OptionsOf<kFit>>();
  stated.fit = detail::fit_with_options<kFit>;
  return stated;
}

}  // namespace torsio
