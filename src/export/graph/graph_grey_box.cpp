#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "export/graph/graph_coefficients.hpp"
#include "export/graph/graph_families.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// As `InputProducts`: each product is one of three factors, which are inputs or 1.
Row products_row(GraphBuilder& graph, const InputProducts::Parameters& p, Row x) {
  const std::vector<std::size_t> used = p.used();
  const std::size_t inputs = x.width();
  std::vector<double> factors(inputs, 0.0);
  for (const std::size_t i : used) factors[i] = 1.0 / p.scales[i];
  std::array<Matrix, InputProducts::kHighestDegree> chosen;
  for (Matrix& of_factor : chosen) of_factor = Matrix(inputs + 1, p.coefficients.size());
  std::size_t column = 0;
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
    chosen[0](i, column) = chosen[1](j, column) = chosen[2](k, column) = 1.0;
    ++column;
  };
  add(inputs, inputs, inputs);
  for (std::size_t i = 0; i < used.size(); ++i) {
    add(used[i], inputs, inputs);
    for (std::size_t j = i; j < used.size(); ++j) {
      add(used[i], used[j], inputs);
      for (std::size_t k = j; p.degree == InputProducts::kHighestDegree && k < used.size(); ++k)
        add(used[i], used[j], used[k]);
    }
  }
  const Row z = (x - graph.constant(p.centres)) * graph.constant(factors);
  const Row z_and_one = joined(std::vector<Row>{z, graph.constant(1.0)});
  Row terms = product(z_and_one, graph.constant(chosen[0]));
  for (std::size_t f = 1; f < chosen.size(); ++f)
    terms = terms * product(z_and_one, graph.constant(chosen[f]));
  return dot(terms, graph.constant(p.coefficients));
}

class GreyBoxGraph {
 public:
  GreyBoxGraph(GraphBuilder& graph, const GreyBox::Parameters& box, Row x)
      : graph_(graph),
        box_(box),
        terms_(box.terms),
        x_(x),
        u_(x.part(0)),
        coefficients_(coefficients(graph, box.coefficients, x)),
        value_(graph.constant(0.0)) {}

  GraphEstimate add() {
    value_ = curve(u_, terms_.curve_knots, 0, terms_.curve_knots.size());
    const bool has_motion = !terms_.thresholds.empty() || !terms_.time_constants_s.empty();
    const Row change = has_motion ? motion(graph_, "x", u_).change : graph_.constant(0.0);
    Row slips = change;
    if (!terms_.thresholds.empty())
      slips =
          add_slips("slip", change, terms_.thresholds, terms_.friction_knots, terms_.first_slip());
    add_relaxations("relaxed", change, terms_.time_constants_s, terms_.first_relaxation());
    add_rates();
    std::size_t column = terms_.first_bank();
    for (std::size_t k = 0; k < terms_.banks.size(); ++k) {
      add_bank(k, column);
      column += terms_.banks[k].columns();
    }
    if (box_.residual) value_ = value_ + residual(slips);
    return plain_estimate(value_);
  }

 private:
  [[nodiscard]] bool is_scheduled() const { return !coefficients_.is_constant(); }

  [[nodiscard]] double constant(std::size_t column) const {
    return graph_.at(coefficients_.index).values(0, column);
  }

  /// Hats of x over the knots, times the coefficients from `first` on.
  Row curve(Row x, const std::vector<double>& knots, std::size_t first, std::size_t count) {
    Matrix table(count, is_scheduled() ? count : 1);
    for (std::size_t k = 0; k < count; ++k) {
      if (is_scheduled())
        table(k, k) = 1.0;
      else
        table(k, 0) = constant(first + k);
    }
    const Row hats = interpolated(x, knots, graph_.constant(std::move(table)), false);
    return is_scheduled() ? dot(coefficients_.part(first, count), hats) : hats;
  }

  /// Stops over one coordinate, with forces that depend on x. @returns s_i / r_i
  Row add_slips(const std::string& name, Row change, const std::vector<double>& thresholds,
                const std::vector<double>& knots, std::size_t first) {
    const std::size_t count = thresholds.size();
    std::vector<double> stiffness;
    stiffness.reserve(count);
    for (const double threshold : thresholds) stiffness.push_back(1.0 / threshold);
    const Row slips =
        limited(graph_.state(name, count) + change * graph_.constant(stiffness), -1.0, 1.0);
    graph_.set_state(name, slips);
    if (knots.size() == 1) {
      value_ = value_ + dot(coefficients_.part(first, count), slips);
    } else if (!is_scheduled()) {
      Matrix forces(knots.size(), count);
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < knots.size(); ++k)
          forces(k, i) = constant(first + i * knots.size() + k);
      value_ =
          value_ + dot(interpolated(u_, knots, graph_.constant(std::move(forces)), true), slips);
    } else {
      // Each hat beside each slip.
      Matrix hats(knots.size(), count * knots.size());
      Matrix copies(count, count * knots.size());
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < knots.size(); ++k) {
          hats(k, i * knots.size() + k) = 1.0;
          copies(i, i * knots.size() + k) = 1.0;
        }
      const Row products = interpolated(u_, knots, graph_.constant(std::move(hats)), true) *
                           product(slips, graph_.constant(std::move(copies)));
      value_ = value_ + dot(coefficients_.part(first, count * knots.size()), products);
    }
    return slips;
  }

  void add_relaxations(const std::string& name, Row change,
                       const std::vector<double>& time_constants_s, std::size_t first) {
    if (time_constants_s.empty()) return;
    std::vector<double> gain;
    std::vector<double> kept;
    for (const double time_constant_s : time_constants_s) {
      const double periods = terms_.sample_period_s / time_constant_s;
      gain.push_back(-std::expm1(-periods) / periods);
      kept.push_back(std::exp(-periods));
    }
    const Row relaxed =
        graph_.state(name, gain.size()) * graph_.constant(kept) + change * graph_.constant(gain);
    graph_.set_state(name, relaxed);
    value_ = value_ + dot(coefficients_.part(first, gain.size()), relaxed);
  }

  /// Whether a column that is not scheduled is 0: a term that is not there.
  [[nodiscard]] bool is_absent(std::size_t column) const {
    const Matrix& values = box_.coefficients.values;
    for (std::size_t k = 0; k < values.rows; ++k)
      if (values(k, column) != 0.0) return false;
    return true;
  }

  void add_rates() {
    for (std::size_t j = 1; j < terms_.inputs(); ++j) {
      if (const std::size_t column = terms_.first_slope() + j; !is_absent(column))
        value_ = value_ + coefficients_.part(column) * x_.part(j);
      const double scale = terms_.rate_scales[j];
      if (const std::size_t column = terms_.first_coulomb() + j; scale > 0.0 && !is_absent(column))
        value_ = value_ + coefficients_.part(column) * tangent(x_.part(j) * (1.0 / scale));
    }
  }

  void add_bank(std::size_t k, std::size_t first) {
    const InputBank& bank = terms_.banks[k];
    const std::string name = fmt::format("bank_{}", k);
    const Row u = x_.part(bank.input);
    const bool has_motion = !bank.thresholds.empty() || !bank.time_constants_s.empty();
    if (has_motion) {
      const auto [change, has_started] = motion(graph_, name, u);
      if (!bank.thresholds.empty()) {
        // An integral begins with the second sample, as a difference does.
        const Row travel =
            bank.is_integrated ? select(has_started, u * terms_.sample_period_s, 0.0) : change;
        add_slips(name + "_slip", travel, bank.thresholds, bank.force_knots, first);
      }
      add_relaxations(name + "_relaxed", change, bank.time_constants_s,
                      first + bank.first_relaxation());
    }
    if (!bank.curve_knots.empty()) {
      // Straight between the inner knots, 0 at the ends and beyond.
      const std::size_t inner = bank.curve_knots.size() - 2;
      Matrix table(inner + 2, is_scheduled() ? inner : 1);
      for (std::size_t i = 0; i < inner; ++i) {
        if (is_scheduled())
          table(i + 1, i) = 1.0;
        else
          table(i + 1, 0) = constant(first + bank.first_curve() + i);
      }
      const Row hats = interpolated(u, bank.curve_knots, graph_.constant(std::move(table)), true);
      value_ = value_ + (is_scheduled()
                             ? dot(coefficients_.part(first + bank.first_curve(), inner), hats)
                             : hats);
    }
    if (!bank.product_knots.empty()) {
      const std::size_t count = bank.product_knots.size();
      Matrix table(count, is_scheduled() ? count : 1);
      for (std::size_t i = 0; i < count; ++i) {
        if (is_scheduled())
          table(i, i) = 1.0;
        else
          table(i, 0) = constant(first + bank.first_product() + i);
      }
      const Row hats = interpolated(x_.part(bank.product_input), bank.product_knots,
                                    graph_.constant(std::move(table)), true);
      value_ =
          value_ + u * (is_scheduled()
                            ? dot(coefficients_.part(first + bank.first_product(), count), hats)
                            : hats);
    }
  }

  Row residual_model(Row y) {
    const auto& model = box_.residual->model;
    if (const auto* network = std::get_if<Mlp::Parameters>(&model))
      return network_row(graph_, *network, y);
    if (const auto* products = std::get_if<InputProducts::Parameters>(&model))
      return products_row(graph_, *products, y);
    if (const auto* process = std::get_if<ParametricGp::Parameters>(&model))
      return gp_mean_row(graph_, *process, y);
    throw UsageError({.place = "the model",
                      .expected = "a grey_box without a mixture as its residual",
                      .found = "a mixture as its residual",
                      .advice = "Fit it again with --set residual=auto or residual=none."});
  }

  /// A bounded correction, faded out where an input leaves what it was trained on.
  Row residual(Row slips) {
    const GreyBoxResidual& learned = *box_.residual;
    std::vector<Row> inputs{x_};
    if (!terms_.thresholds.empty()) inputs.push_back(slips);
    const Row y = joined(inputs);
    // An input that was constant in training has no border: any other value leaves it by more.
    constexpr double kNoBorder = 1e30;
    std::vector<double> per_border;
    for (std::size_t j = 0; j < y.width(); ++j) {
      const double border = GreyBoxResidual::kBorder * (learned.highest[j] - learned.lowest[j]);
      per_border.push_back(border > 0.0 ? 1.0 / border : kNoBorder);
    }
    const Row left_by =
        maximum(graph_.constant(learned.lowest) - y, y - graph_.constant(learned.highest));
    const Row borders = maximum(left_by, 0.0) * graph_.constant(per_border);
    const Row share = maximum(1.0 - largest(borders), 0.0);
    const Row correction = residual_model(y);
    const Row is_usable = both(is_finite(correction), 0.0 < share);
    return select(is_usable, share * limited(correction, -learned.bound, learned.bound), 0.0);
  }

  GraphBuilder& graph_;
  const GreyBox::Parameters& box_;
  const GreyBoxTerms::Structure& terms_;
  Row x_;
  Row u_;
  Row coefficients_;
  Row value_;
};

}  // namespace

GraphEstimate add_grey_box(GraphBuilder& graph, const GreyBox::Parameters& p, Row x) {
  return GreyBoxGraph(graph, p, x).add();
}

}  // namespace torsio
