#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/common/fitted.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What becomes of G after the fit in discrete time.
enum class ContinuousForm : std::uint8_t {
  none,
  tustin,   ///< G by Tustin in continuous time, run by an exact first-order hold
  refined,  ///< second stage: refined in continuous time, the curves as found
};

inline constexpr std::array<std::string_view, 3> kContinuousForms{"none", "tustin", "refined"};
inline constexpr std::array<std::string_view, 2> kStructures{"given", "search"};
inline constexpr std::array<std::string_view, 2> kMaps{"polynomial", "piecewise_linear"};
inline constexpr std::array<std::string_view, 4> kPublished{"none", "discrete", "tustin",
                                                            "refined"};

struct HammersteinWienerOptions {
  /// Empty: searched for, or 1 zero, 2 poles (in 1/z), degrees 2 and 3, as (2) to (6) of paper 003.
  std::optional<std::size_t> zeros = {};
  std::optional<std::size_t> poles = {};
  std::optional<std::size_t> input_degree = {};
  std::optional<std::size_t> output_degree = {};
  bool is_piecewise_linear = false;
  std::size_t knots = 5;  ///< per curve, if piecewise linear
  bool is_searched = true;
  ContinuousForm continuous = ContinuousForm::none;
  std::size_t iterations = 200;            ///< limit of one search
  std::optional<Paper003> published = {};  ///< the paper's own numbers in place of a fit

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.is_searched,
          {.name = "structure",
           .help = "search: options at auto are chosen by the error on held-out blocks; given: "
                   "auto is 1 zero, 2 poles (in 1/z), degrees 2 and 3, as (2) to (6) of paper 003",
           .choices = kStructures});
    visit(self.zeros, {.name = "zeros", .maximum = 100, .help = "of the linear part"});
    visit(self.poles, {.name = "poles", .maximum = 100, .help = "of the linear part"});
    visit(self.is_piecewise_linear,
          {.name = "map", .help = "curves before and after the linear part", .choices = kMaps});
    visit(self.input_degree,
          {.name = "input_degree", .minimum = 1, .maximum = 20, .help = "of the curve before it"});
    visit(self.output_degree,
          {.name = "output_degree", .minimum = 1, .maximum = 20, .help = "of the curve after it"});
    visit(self.knots, {.name = "knots",
                       .minimum = 3,
                       .maximum = 100,
                       .help = "of each curve, of map=piecewise_linear"});
    visit(self.continuous,
          {.name = "continuous",
           .help = "tustin: the linear part as Tustin's continuous form runs between samples; "
                   "refined: refined in continuous time, the curves as found",
           .choices = kContinuousForms});
    visit(
        self.iterations,
        {.name = "iterations", .minimum = 1, .maximum = 100000, .help = "of one search, at most"});
    visit(self.published,
          {.name = "published",
           .help = "what paper 003 prints of its coupling in place of a fit; first input in rad, "
                   "target in Nm, 200 Hz",
           .choices = kPublished});
  }
};

/// A Hammerstein-Wiener model of the first input by least simulation error (output error: what is
/// predicted is what is simulated), in two stages.
///
/// 1. Structure: where it is not given, orders and then degrees by the simulation error on held-out
///    blocks (5 folds of 10 interleaved blocks); the smallest within 1 % of the best.
/// 2. Parameters: G by Steiglitz-McBride and from a grid of time constants, curves by least squares, then
///    all of them together by Levenberg-Marquardt with sensitivities run as filters. Gauges are held, poles stay inside
///    the unit circle, each record starts from a state of its own (at rest where that would be more than
///    64 numbers).
///
/// Source: specification 3.5. The table contains the coefficients with standard errors; notes state
/// poles, zeros, the form in continuous time and what the data cannot distinguish.
/// @throws Error if the first input is constant, there are fewer than ten samples per parameter or
/// no record outlasts the lags, no start of the search is stable, or it does not converge;
/// UsageError for an order or a degree out of range, or more zeros than poles in
/// continuous time.
[[nodiscard]] Fitted<HammersteinWiener> fit_hammerstein_wiener(
    const TrainingData& data, const HammersteinWienerOptions& options,
    const FitContext& context = {});

/// G in continuous time by Tustin where it has at most three poles, and the reasons against this
/// interpretation (`continuous_warning`); one line each.
[[nodiscard]] std::vector<std::string> continuous_notes(
    const HammersteinWiener::Parameters& parameters);

}  // namespace torsio
