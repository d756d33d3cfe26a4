#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// A fitted number with a physical meaning: a stiffness, a time constant.
struct FittedParameter {
  std::string name;    ///< "k1"
  std::string unit;    ///< "Nm/rad"; empty for a number without
  double value = 0.0;  ///< in that unit
  double std_error =
      kNotMeasured;  ///< from the curvature of the error at the optimum; NaN if unknown
};

/// A fitted model of any family, the messages about the fit for the user, and its parameters.
struct FittedModel {
  AnyModel model;
  std::vector<std::string> notes;
  std::vector<FittedParameter> table = {};
  /// RMSE on training data that the fit held out for its choices; NaN for families that hold out
  /// none. Where error bars cannot be estimated on validation records, they are not smaller than
  /// this.
  double held_out_rmse = kNotMeasured;
  /// Recordings that were held out for it one after the other; 0: parts of recordings were.
  std::size_t held_out_records = 0;
  bool has_held_out_fifths =
      false;                   ///< contiguous fifths of the only recording, one after the other
  double stroke_growth = 0.0;  ///< `StrokeGuard::growth`; 0: not known
};

/// One setting that a structure search tries in addition to the defaults.
struct OptionVariation {
  std::string_view option;
  std::string_view value;
};

/// The meaning of a model's parameters, for display.
struct ParameterDescription {
  std::vector<std::string> lines = {};             ///< "kernel se (length 1)"
  std::string covered = {};                        ///< prefix of the fields that the lines state
  std::vector<FittedParameter> coefficients = {};  ///< if a table of them states everything
};

/// How one family is trained: the information for `fit --list`, the command line, cross-validation,
/// `compare` and the structure search.
struct FamilyInfo {
  std::string_view name;
  std::string_view summary;              ///< one line
  std::string_view model_family = name;  ///< family of the fitted models: "dgmm" for "dgmm_paper"
  std::span<const OptionInfo> options = {};
  /// Deterministic for a seed. @throws Error if the data do not suffice, Cancelled.
  FittedModel (*fit)(const TrainingData&, const Options&, const FitContext&) = nullptr;
  bool is_spring = true;                         ///< `FamilyTraits::is_spring` of its models
  bool takes_levels = false;                     ///< held levels determine its models
  bool can_resume = false;                       ///< uses `FitContext::resume` and `keep`
  bool only_if_named = false;                    ///< not in `all`: slow, or made for special data
  bool in_search = !only_if_named;               ///< a structure search tries it
  std::vector<OptionVariation> variations = {};  ///< orders, sizes, structures that a search tries
  /// About how long a fit on 85 000 samples takes: only for the order of the fits of a search and
  /// its remaining time.
  double typical_fit_s = 0.2;
  /// Describes its models' parameters; null: their fields are sufficient.
  ParameterDescription (*describe)(const AnyParameters&, const EstimatorSettings&) = nullptr;
};

}  // namespace torsio
