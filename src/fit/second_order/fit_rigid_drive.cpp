#include "fit/second_order/fit_rigid_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/report_progress.hpp"
#include "data/names.hpp"
#include "fit/common/fitted.hpp"
#include "fit/second_order/inverse_dynamics.hpp"
#include "fit/second_order/simulation_fit.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Samples of a free run that determine its start: in the fit as in a score (`--initialise`).
constexpr std::size_t kStartSamples = 50;

/// What the motion of the training records is like, to size the search by.
struct Scale {
  double travel = 0.0;  ///< range of the target
  double speed = 0.0;   ///< largest
  std::string force_unit;
  std::string target_unit;
  std::vector<SearchedParameter> further_gains;

  [[nodiscard]] std::string per_target(const char* seconds) const {
    return force_unit + seconds + (target_unit.empty() ? "" : "/" + target_unit);
  }
};

/// A number of `RigidDrive::Parameters` that may be searched for.
struct Field {
  SearchedParameter searched;
  double& (*place)(RigidDrive::Parameters&);
  double start = 0.0;
};

/// The place of a number of `RigidDrive::Parameters`.
template <double RigidDrive::Parameters::*Member>
double& of_drive(RigidDrive::Parameters& parameters) {
  return parameters.*Member;
}

/// The place of a number of its `VariableFriction`, which it has from then on.
template <double VariableFriction::*Member>
double& of_variable(RigidDrive::Parameters& parameters) {
  if (!parameters.variable_friction) parameters.variable_friction.emplace();
  return (*parameters.variable_friction).*Member;
}

std::vector<Field> basic_fields(const RigidDrive::Parameters& p, const Scale& scale) {
  return {{{.name = "inertia",
            .unit = scale.per_target(" s^2"),
            .typical = p.inertia,
            .lowest = 1e-3 * p.inertia},
           of_drive<&RigidDrive::Parameters::inertia>,
           p.inertia},
          {{.name = "viscous",
            .unit = scale.per_target(" s"),
            .typical = std::max(p.viscous, p.coulomb / scale.speed),
            .lowest = 0.0},
           of_drive<&RigidDrive::Parameters::viscous>,
           p.viscous},
          {{.name = "coulomb",
            .unit = scale.force_unit,
            .typical = std::max(p.coulomb, 0.1 * p.viscous * scale.speed),
            .lowest = 0.0},
           of_drive<&RigidDrive::Parameters::coulomb>,
           p.coulomb},
          {{.name = "offset",
            .unit = scale.force_unit,
            .typical = std::max(p.coulomb, 0.1 * p.viscous * scale.speed)},
           of_drive<&RigidDrive::Parameters::offset>,
           p.offset}};
}

std::string energy_unit(const Scale& scale) {
  return scale.force_unit + (scale.target_unit.empty() ? "" : " " + scale.target_unit);
}

struct Term {
  std::string_view name;
  std::vector<Field> (*fields)(const RigidDrive::Parameters&, const Scale&);
};

const std::array<Term, 9> kTerms{{
    {"stribeck",
     [](const RigidDrive::Parameters&, const Scale& scale) {
       return std::vector<Field>{
           {{.name = "static_ratio", .unit = "", .typical = 1.0, .lowest = 1.0, .highest = 20.0},
            of_drive<&RigidDrive::Parameters::static_ratio>,
            1.3},
           {{.name = "stribeck_speed",
             .unit = scale.target_unit.empty() ? "" : scale.target_unit + "/s",
             .typical = 0.05 * scale.speed,
             .lowest = 1e-3 * scale.speed,
             .highest = scale.speed},
            of_drive<&RigidDrive::Parameters::stribeck_speed>,
            0.05 * scale.speed}};
     }},
    {"lugre",
     [](const RigidDrive::Parameters&, const Scale& scale) {
       return std::vector<Field>{{{.name = "bristle",
                                   .unit = scale.target_unit,
                                   .typical = 1e-3 * scale.travel,
                                   .lowest = 1e-6 * scale.travel,
                                   .highest = 0.1 * scale.travel},
                                  of_drive<&RigidDrive::Parameters::bristle>,
                                  1e-3 * scale.travel}};
     }},
    {"asymmetry",
     [](const RigidDrive::Parameters& p, const Scale& scale) {
       return std::vector<Field>{{{.name = "viscous_asymmetry",
                                   .unit = scale.per_target(" s"),
                                   .typical = 0.1 * std::max(p.viscous, p.coulomb / scale.speed)},
                                  of_drive<&RigidDrive::Parameters::viscous_asymmetry>,
                                  0.0}};
     }},
    {"quadratic",
     [](const RigidDrive::Parameters& p, const Scale& scale) {
       const double size = std::max(p.viscous, p.coulomb / scale.speed) / scale.speed;
       return std::vector<Field>{
           {{.name = "viscous_quadratic",
             .unit = scale.per_target(" s^2") + (scale.target_unit.empty() ? "" : "^2"),
             .typical = size,
             .lowest = 0.0},
            of_drive<&RigidDrive::Parameters::viscous_quadratic>,
            0.05 * size}};
     }},
    {"spring",
     [](const RigidDrive::Parameters& p, const Scale& scale) {
       return std::vector<Field>{
           {{.name = "spring",
             .unit = scale.per_target(""),
             .typical = std::max(p.coulomb, 0.1 * p.viscous * scale.speed) / scale.travel},
            of_drive<&RigidDrive::Parameters::spring>,
            0.0}};
     }},
    {"position",
     [](const RigidDrive::Parameters&, const Scale& scale) {
       return std::vector<Field>{
           {{.name = "coulomb_slope",
             .unit = scale.target_unit.empty() ? "" : fmt::format("1/{}", scale.target_unit),
             .typical = 1.0 / scale.travel},
            of_drive<&RigidDrive::Parameters::coulomb_slope>,
            0.0}};
     }},
    {"load",
     [](const RigidDrive::Parameters&, const Scale&) {
       return std::vector<Field>{
           {{.name = "load_share", .unit = "", .typical = 0.05, .lowest = 0.0, .highest = 0.9},
            of_variable<&VariableFriction::load_share>,
            0.02}};
     }},
    {"dwell",
     [](const RigidDrive::Parameters&, const Scale&) {
       return std::vector<Field>{
           {{.name = "dwell_gain", .unit = "", .typical = 0.2, .lowest = 0.0, .highest = 20.0},
            of_variable<&VariableFriction::dwell_gain>,
            0.1},
           {{.name = "dwell_time", .unit = "s", .typical = 0.5, .lowest = 0.01, .highest = 100.0},
            of_variable<&VariableFriction::dwell_time_s>,
            0.5}};
     }},
    {"heating",
     [](const RigidDrive::Parameters& p, const Scale& scale) {
       const double power = scale.speed * (p.coulomb + p.viscous * scale.speed);
       const double size = 0.1 / (10.0 * std::max(power, 1e-300));  // 10 % after 10 s
       return std::vector<Field>{
           {{.name = "heating",
             .unit = fmt::format("1/({})", energy_unit(scale)),
             .typical = size,
             .lowest = 0.0},
            of_variable<&VariableFriction::heating>,
            0.2 * size},
           {{.name = "heating_time", .unit = "s", .typical = 20.0, .lowest = 0.5, .highest = 1e4},
            of_variable<&VariableFriction::heating_time_s>,
            20.0}};
     }},
}};

using TermSet = std::vector<const Term*>;

std::optional<TermSet> terms_named(const std::string& text) {
  if (text == "auto") return std::nullopt;
  TermSet set;
  if (text == "none") return set;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('+', at), text.size());
    const std::string name = text.substr(at, end - at);
    const auto* term = std::ranges::find(kTerms, name, &Term::name);
    if (term == kTerms.end()) {
      std::vector<std::string> names{"none", "auto"};
      for (const Term& each : kTerms) names.emplace_back(each.name);
      throw UsageError({.place = "terms",
                        .problem = "no term of rigid_drive is called \"" + name + '"',
                        .expected = "some of " + joined(names) + ", joined by +",
                        .advice = did_you_mean(name, names)});
    }
    if (std::ranges::find(set, term) == set.end()) set.push_back(term);
    at = end + 1;
  }
  return set;
}

std::string names_of(const TermSet& set) {
  std::string text;
  for (const Term* term : set) text += fmt::format("{}{}", text.empty() ? "" : "+", term->name);
  return text.empty() ? "none" : text;
}

/// Sets the searched parameters; the gains of the inputs after the first follow them.
RigidDrive::Parameters with_fields(RigidDrive::Parameters p, const std::vector<Field>& fields,
                                   std::span<const double> values) {
  for (std::size_t i = 0; i < fields.size(); ++i) fields[i].place(p) = values[i];
  std::ranges::copy(values.subspan(fields.size()), p.gains.begin() + 1);
  return p;
}

/// A set of terms: the model with its searched parameters, and the start values.
struct Candidate {
  std::vector<Field> fields;
  SimulatedModel model;
  RigidDrive::Parameters with;

  [[nodiscard]] RigidDrive::Parameters parameters(std::span<const double> values) const {
    return with_fields(with, fields, values);
  }
};

Candidate candidate(const RigidDrive::Parameters& with, const Scale& scale, const TermSet& set) {
  Candidate made{.fields = basic_fields(with, scale), .model = {}, .with = with};
  for (const Term* term : set) {
    const std::vector<Field> more = term->fields(with, scale);
    made.fields.insert(made.fields.end(), more.begin(), more.end());
  }
  for (const Field& field : made.fields) made.model.parameters.push_back(field.searched);
  made.model.parameters.insert(made.model.parameters.end(), scale.further_gains.begin(),
                               scale.further_gains.end());
  made.model.differences = {0.03, 3e-3};  // stops and starts make the residuals rough
  made.model.run = [with, fields = made.fields](
                       std::span<const double> values, std::span<const double> state,
                       const Sequence& sequence, std::span<double> output) {
    return run_from(model_if_valid<RigidDrive>(with_fields(with, fields, values)), state, sequence,
                    output);
  };
  return made;
}

/// The basic numbers of a guess, its further gains, and the terms where they start.
std::vector<double> start_of(const Candidate& made, RigidDrive::Parameters guess) {
  constexpr std::size_t kBasic = 4;
  std::vector<double> start;
  for (std::size_t i = 0; i < made.fields.size(); ++i)
    start.push_back(i < kBasic ? made.fields[i].place(guess) : made.fields[i].start);
  start.insert(start.end(), guess.gains.begin() + 1, guess.gains.end());
  return start;
}

/// RMSE of free runs through blocks that the fit did not see; infinite where a fit failed and where there is but
/// one block.
double held_out(const Candidate& made, const TrainingData& blocks, const Progress& progress) {
  constexpr std::size_t kFolds = 4;
  // Blocks are short, and the basic fit is a good start: one search each, not to the last digit.
  const SimulationFitOptions search{.first_horizon = longest_sequence(blocks),
                                    .tolerance = 1e-4,
                                    .start_samples = kStartSamples,
                                    .progress = progress};
  const std::size_t folds = std::min(kFolds, blocks.sequences.size());
  if (folds < 2) return HUGE_VAL;
  double sum = 0.0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    TrainingData seen = blocks;
    TrainingData unseen = blocks;
    seen.sequences.clear();
    unseen.sequences.clear();
    for (std::size_t i = 0; i < blocks.sequences.size(); ++i)
      (i % folds == fold ? unseen : seen).sequences.push_back(blocks.sequences[i]);
    try {
      const SimulationFit fit =
          fit_by_simulation(made.model, seen, {start_of(made, made.with)}, search);
      const double rmse = held_out_rmse(made.model, fit.parameters, unseen, kStartSamples);
      sum += rmse * rmse;
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {
      return HUGE_VAL;
    }
  }
  return std::sqrt(sum / static_cast<double>(folds));
}

struct Choice {
  TermSet terms;
  std::vector<std::string> notes;
};

/// Forward selection: the term that helps most, as long as one helps.
Choice chosen_terms(const RigidDrive::Parameters& with, const Scale& scale,
                    const TrainingData& data, const Progress& progress) {
  constexpr std::size_t kBlocks = 4;
  // Blocks of one record are much alike: a term that only repeats them gains some percent, too.
  constexpr double kWorthIt = 0.9;
  const TrainingData blocks = in_blocks(data, kBlocks);
  const auto score = [&](const TermSet& set) {
    return held_out(candidate(with, scale, set), blocks, progress);
  };
  const std::string unit = scale.target_unit;
  Choice choice;
  double best = score({});
  choice.notes.push_back(fmt::format("terms by held-out blocks: none {:.4g} {} RMSE", best, unit));
  while (choice.terms.size() < kTerms.size()) {
    TermSet better;
    double least = kWorthIt * best;
    for (const Term& term : kTerms) {
      if (std::ranges::find(choice.terms, &term) != choice.terms.end()) continue;
      TermSet with_it = choice.terms;
      with_it.push_back(&term);
      const double error = score(with_it);
      choice.notes.push_back(std::isfinite(error)
                                 ? fmt::format("  {}: {:.4g} {}", names_of(with_it), error, unit)
                                 : fmt::format("  {}: no convergence", names_of(with_it)));
      if (error < least) {
        least = error;
        better = with_it;
      }
    }
    if (better.empty()) break;
    choice.terms = better;
    best = least;
  }
  choice.notes.push_back(choice.terms.empty()
                             ? "no further term helps by more than 10 % on held-out blocks"
                             : "chosen terms: " + names_of(choice.terms));
  return choice;
}

}  // namespace

Fitted<RigidDrive> fit_rigid_drive(const TrainingData& data, const RigidDriveOptions& options,
                                   const Progress& progress) {
  const std::optional<TermSet> named = terms_named(options.terms);
  require_excitation(data);
  report_progress(progress, 0.0, "fitting rigid_drive");
  const EndStops stops = end_stops(data);
  const InverseDynamics inverse = inverse_dynamics(data, options.gain);
  std::vector<double> gains(data.input_count(), 0.0);
  gains[0] = options.gain;
  std::vector<RigidDrive::Parameters> guesses;
  for (const DriveGuess& guess : inverse.guesses)
    guesses.push_back({.inertia = guess.inertia,
                       .viscous = guess.viscous,
                       .coulomb = guess.coulomb,
                       .offset = guess.offset,
                       .gains = gains,
                       .time = {.sample_period_s = 1.0 / data.sample_rate_Hz,
                                .substeps = options.substeps,
                                .input_order = options.input_order},
                       .lowest = stops.lowest,
                       .highest = stops.highest});
  const Scale scale{.travel = (stops.highest - stops.lowest) / 11.0,
                    .speed = inverse.largest_speed,
                    .force_unit = unit_label(data.inputs[0].expression),
                    .target_unit = unit_label(data.target),
                    .further_gains = further_gains(data)};
  const SimulationFitOptions search{.first_horizon = options.first_horizon,
                                    .max_iterations = options.iterations,
                                    .tolerance = 1e-6,
                                    .start_samples = kStartSamples,
                                    .progress = progress};
  Candidate made = candidate(guesses.front(), scale, {});
  std::vector<std::vector<double>> starts;
  starts.reserve(guesses.size());
  for (const RigidDrive::Parameters& guess : guesses) starts.push_back(start_of(made, guess));
  SimulationFit fit = fit_by_simulation(made.model, data, starts, search);
  const RigidDrive::Parameters basic = made.parameters(fit.parameters);
  Choice choice{.terms = named.value_or(TermSet{}), .notes = {}};
  if (!named) choice = chosen_terms(basic, scale, data, progress);
  if (!choice.terms.empty()) {
    made = candidate(basic, scale, choice.terms);
    fit = fit_by_simulation(made.model, data, {start_of(made, basic)}, search);
  }
  Fitted<RigidDrive> fitted{.parameters = made.parameters(fit.parameters),
                            .notes = std::move(choice.notes),
                            .table = std::move(fit.table)};
  std::ranges::move(fit.notes, std::back_inserter(fitted.notes));
  fitted.notes.push_back(fmt::format("free runs through the training records miss {:.3g} {} RMSE",
                                     fit.rmse, scale.target_unit));
  return fitted;
}

}  // namespace torsio
