#include "fit/linear/named_coefficients.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string_view>
#include <utility>

#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "numerics/nnls.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A coefficient's column: its name and its unit.
struct Column {
  std::string name;
  std::string unit;
};

/// The argument of `function(...)`, if that is the whole expression; else empty.
std::string_view argument_of(std::string_view expression, std::string_view function) {
  if (!expression.starts_with(function) || !expression.ends_with(')')) return {};
  const std::string_view inner =
      expression.substr(function.size(), expression.size() - function.size() - 1);
  int depth = 0;
  for (const char c : inner) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (depth < 0) return {};
  }
  return inner;
}

/// Unit of a channel, of its rate, or of either after a filter; empty for other expressions.
std::string unit_of_input(std::string_view expression) {
  if (const auto filtered = argument_of(expression, "lowpass("); !filtered.empty())
    return unit_of_input(filtered.substr(0, filtered.find_last_of(',')));
  if (const auto changing = argument_of(expression, "rate("); !changing.empty()) {
    const std::string unit = unit_of_input(changing);
    return unit.empty() || unit.find('/') != std::string::npos ? std::string() : unit + "/s";
  }
  const bool is_channel = expression.find_first_of("()*/+-^, ") == std::string_view::npos;
  return is_channel ? unit_label(expression) : std::string();
}

std::string per(const std::string& unit, std::string_view input) {
  const std::string below = unit_of_input(input);
  if (below.empty()) return unit;
  const std::string above = unit.empty() ? "1" : unit;
  return below.find('/') == std::string::npos ? above + "/" + below : above + "/(" + below + ")";
}

class Names {
 public:
  Names(std::span<const std::string> inputs, const std::string& target)
      : inputs_(inputs), unit_(unit_label(target)) {}

  [[nodiscard]] std::vector<Column> columns(const Linear::Parameters& /*of*/) const {
    std::vector<Column> all{{"b", unit_}};
    add_slopes(all, 1);
    return all;
  }
  [[nodiscard]] std::vector<Column> columns(const LinearCoulomb::Parameters& of) const {
    std::vector<Column> all{{"b", unit_}};
    add_slopes(all, 1);
    all.push_back({fmt::format("c (tanh({} / v))", inputs_[of.rate_feature]), unit_});
    return all;
  }
  [[nodiscard]] std::vector<Column> columns(const Polynomial::Parameters& of) const {
    std::vector<Column> all;
    for (std::size_t curve = 0; curve < of.curves(); ++curve)
      for (std::size_t power = 0; power <= of.degree; ++power)
        all.push_back({fmt::format("a{}{}", power,
                                   !of.by_direction ? ""
                                   : curve == 0     ? "+ (rising)"
                                                    : "- (falling)"),
                       unit_});
    add_slopes(all, 0);
    return all;
  }

  void others(const Linear::Parameters& /*of*/, std::vector<FittedParameter>& /*list*/) const {}
  void others(const LinearCoulomb::Parameters& of, std::vector<FittedParameter>& list) const {
    list.push_back({"v", unit_of_input(inputs_[of.rate_feature]), of.rate_scale});
  }
  void others(const Polynomial::Parameters& of, std::vector<FittedParameter>& list) const {
    const std::string unit = unit_of_input(inputs_[0]);
    list.push_back({"centre m of z = (x - m) / h", unit, of.centre});
    list.push_back({"half range h", unit, of.half_range});
  }

  [[nodiscard]] std::string at_knot(const CoefficientSchedule& of, std::size_t row) const {
    if (!of.scheduled) return {};
    const std::string unit = unit_of_input(inputs_[of.feature]);
    return fmt::format(" at {} = {:.4g}{}{}", inputs_[of.feature], of.knots[row],
                       unit.empty() ? "" : " ", unit);
  }

 private:
  void add_slopes(std::vector<Column>& all, std::size_t first) const {
    for (std::size_t j = 0; j < inputs_.size(); ++j)
      all.push_back({fmt::format("k{} ({})", j + first, inputs_[j]), per(unit_, inputs_[j])});
  }

  std::span<const std::string> inputs_;
  std::string unit_;
};

}  // namespace

std::vector<FittedParameter> named_coefficients(const AnyModel::Parameters& parameters,
                                                std::span<const std::string> inputs,
                                                const std::string& target,
                                                std::span<const double> errors) {
  const Names names(inputs, target);
  std::vector<FittedParameter> all;
  const auto add = [&]<class Parameters>(const Parameters* of) {
    if (of == nullptr) return;
    const std::vector<Column> columns = names.columns(*of);
    const Matrix& values = of->coefficients.values;
    for (std::size_t row = 0; row < values.rows; ++row)
      for (std::size_t j = 0; j < columns.size(); ++j)
        if (values(row, j) != 0.0)
          all.push_back({columns[j].name + names.at_knot(of->coefficients, row), columns[j].unit,
                         values(row, j), j < errors.size() ? errors[j] : kNotMeasured});
    names.others(*of, all);
  };
  add(parameters.get_if<Linear::Parameters>());
  add(parameters.get_if<LinearCoulomb::Parameters>());
  add(parameters.get_if<Polynomial::Parameters>());
  return all;
}

ParameterDescription describe_coefficients(const AnyParameters& parameters,
                                           const EstimatorSettings& settings) {
  return {.coefficients =
              named_coefficients(parameters, settings.features.inputs, settings.target)};
}

std::vector<FittedParameter> fitted_coefficients(const AnyModel::Parameters& parameters,
                                                 const Matrix& coefficients, const Design& design,
                                                 const TrainingData& data) {
  std::vector<std::string> inputs;
  for (const InputInfo& input : data.inputs) inputs.push_back(input.expression);
  std::vector<double> errors;
  if (coefficients.rows == 1)
    errors = standard_errors(normal_equations(design.columns, design.target), coefficients.values);
  return named_coefficients(parameters, inputs, data.target, errors);
}

}  // namespace torsio
