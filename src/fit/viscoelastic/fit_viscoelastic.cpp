#include "fit/viscoelastic/fit_viscoelastic.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/excited_band.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/viscoelastic/network_order.hpp"
#include "fit/viscoelastic/viscoelastic_error.hpp"
#include "fit/viscoelastic/viscoelastic_search.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxScored = 30'000;

/// "Nm/rad" for torque_Nm and spring_deflection_rad; empty where the names contain no units.
std::string stiffness_unit(const TrainingData& data) {
  const std::string& input = data.inputs.front().expression;
  const bool is_sum = input.find_first_of("*/^(.") == std::string::npos;
  const std::string above = unit_label(data.target);
  const std::string below = is_sum ? unit_label(input) : std::string();
  return above.empty() || below.empty() ? std::string() : fmt::format("{}/{}", above, below);
}

std::vector<FittedParameter> table_of(const SpringDashpotNetwork& network, double offset,
                                      const std::vector<double>& std_error,
                                      const TrainingData& data) {
  const std::string unit = stiffness_unit(data);
  const std::size_t slash = unit.find('/');
  const std::string damping_unit =
      unit.empty() ? unit : unit.substr(0, slash) + " s" + unit.substr(slash);
  std::vector<FittedParameter> table;
  for (const NetworkNode* element : elements_of(network))
    table.push_back({.name = element->name(),
                     .unit = element->is(NetworkKind::spring) ? unit : damping_unit,
                     .value = element->value,
                     .std_error = std_error[table.size()]});
  table.push_back({.name = "offset",
                   .unit = unit_label(data.target),
                   .value = offset,
                   .std_error = std_error.back()});
  return table;
}

/// Elements that determine a branch's rate: |d ln p / d ln value| of a fifth or more.
std::vector<std::string> elements_after(const SpringDashpotNetwork& network, std::size_t branch) {
  constexpr double kMoved = 1.01;
  constexpr double kShare = 0.2;
  const RelaxationSpectrum spectrum = relaxation_spectrum(network);
  const std::vector<double> values = network.values();
  const std::vector<std::string> names = network.names();
  std::vector<std::string> sensitive;
  for (std::size_t j = 0; j < values.size(); ++j) {
    std::vector<double> moved = values;
    moved[j] *= kMoved;
    SpringDashpotNetwork other = network;
    other.set_values(moved);
    const auto branches = relaxation_spectrum(other).branches;
    if (branch >= branches.size()) continue;
    const double change = std::log(branches[branch].rate_1_s / spectrum.branches[branch].rate_1_s);
    if (std::abs(change) >= kShare * std::log(kMoved)) sensitive.push_back(names[j]);
  }
  return sensitive;
}

void note_relaxation(std::vector<std::string>& notes, const SpringDashpotNetwork& network,
                     const TrainingData& data) {
  const auto branches = relaxation_spectrum(network).branches;
  if (branches.empty()) return;
  std::vector<std::string> times;
  times.reserve(branches.size());
  for (const RelaxationBranch& branch : branches)
    times.push_back(fmt::format("{:.3g} s", 1.0 / branch.rate_1_s));
  notes.push_back(fmt::format("relaxes within {}", fmt::join(times, ", ")));
  const ExcitedBand band = excited_band(data);
  for (std::size_t i = 0; i < branches.size(); ++i) {
    const std::string place = outside_of(band, branches[i].rate_1_s);
    if (place.empty()) continue;
    notes.push_back(fmt::format(
        "relaxation {} ({:.2g} Hz) lies {}: {} may be far off; add a {} record, or a prior",
        times[i], branches[i].rate_1_s / (2.0 * std::numbers::pi), place,
        fmt::join(elements_after(network, i), ", "), place.starts_with("below") ? "slow" : "fast"));
  }
}

void note_uncertainty(std::vector<std::string>& notes, const ParameterUncertainty& uncertainty,
                      const std::vector<FittedParameter>& table) {
  std::vector<std::string> names;
  names.reserve(table.size());
  for (const FittedParameter& each : table) names.push_back(each.name);
  for (const auto& direction : uncertainty.null_directions)
    notes.push_back(fmt::format("the data do not determine {} (relative changes)",
                                description_of(direction, names)));
  constexpr double kHardly = 0.5;
  for (std::size_t j = 0; j + 1 < table.size(); ++j)
    if (table[j].std_error > kHardly * table[j].value)
      notes.push_back(
          fmt::format("the data hardly determine {}: its standard error is above half its value",
                      table[j].name));
}

void note_unused(std::vector<std::string>& notes, const TrainingData& data) {
  if (data.input_count() == 1) return;
  std::vector<std::string> names;
  for (std::size_t j = 1; j < data.input_count(); ++j) names.push_back(data.inputs[j].expression);
  notes.push_back(fmt::format("{} not used: the network is between both sides of {} alone",
                              fmt::join(names, ", "), data.inputs.front().expression));
}

/// Springs and dashpots push back; no values of theirs make a torque that falls.
void note_sign(std::vector<std::string>& notes, const TrainingData& data) {
  const Table table = usable_table(data);
  double covariance = 0.0;
  double mean = 0.0;
  for (std::size_t n = 0; n < table.target.size(); ++n)
    mean += table.target[n] / static_cast<double>(table.target.size());
  for (std::size_t n = 0; n < table.target.size(); ++n)
    covariance += table.features(n, 0) * (table.target[n] - mean);
  if (covariance < 0.0)
    notes.push_back(fmt::format(
        "{} falls while {} rises, which no springs and dashpots do: is one of them of the wrong "
        "sign?",
        data.target, data.inputs.front().expression));
}

void check(const ViscoelasticOptions& options) {
  if (options.starts < 1)
    throw UsageError({.place = "option starts", .expected = "1 or more", .found = "0"});
  if (!(options.prior >= 0.0))
    throw UsageError({.place = "option prior",
                      .expected = "0 or more",
                      .found = fmt::format("{}", options.prior)});
}

void require_varying(const ViscoelasticError& error, const TrainingData& data) {
  const auto require = [](double deviation, const std::string& name) {
    if (!(deviation > 0.0))
      throw Error({.problem = "a network of springs needs a deflection and a target that vary",
                   .found = name + " is constant in the training data"});
  };
  require(error.input_deviation(), data.inputs.front().expression);
  require(error.target_deviation(), data.target);
}

}  // namespace

Fitted<Viscoelastic> fit_viscoelastic(const TrainingData& data, const ViscoelasticOptions& options,
                                      const FitContext& context) {
  check(options);
  report_progress(context.progress, 0.0, "fitting viscoelastic");
  const SpringDashpotNetwork network = parse_network(options.network);
  const ViscoelasticError error(data, kMaxScored, options.is_at_rest);
  require_varying(error, data);
  ViscoelasticFit fit;
  if (options.is_refined) {
    fit = search_network(error, network, options, context);
    fit.network = fastest_first(std::move(fit.network));
  } else {
    fit = offset_of_network(error, network);
  }
  const ParameterUncertainty uncertainty = uncertainty_of(error, fit);
  Fitted<Viscoelastic> fitted{
      .parameters = {.network = fit.network,
                     .offset = fit.offset,
                     .sample_period_s = error.period_s(),
                     .inputs = data.input_count()},
      .notes = std::move(fit.notes),
      .table = table_of(fit.network, fit.offset, uncertainty.std_error, data)};
  fitted.notes.insert(fitted.notes.begin(), text_of(fit.network, 4));
  note_unused(fitted.notes, data);
  note_sign(fitted.notes, data);
  note_relaxation(fitted.notes, fit.network, data);
  note_uncertainty(fitted.notes, uncertainty, fitted.table);
  return fitted;
}

}  // namespace torsio
