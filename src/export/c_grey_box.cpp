#include "export/c_grey_box.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "export/c_coefficients.hpp"
#include "export/c_kernel.hpp"
#include "export/c_networks.hpp"
#include "export/c_statements.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Writes `real NAME_products(x)`: as `InputProducts`.
void write_products(CText& c, const InputProducts::Parameters& p) {
  const std::vector<std::size_t> used = p.used();
  std::vector<std::string> inputs;
  std::vector<double> centres;
  std::vector<double> factors;
  for (const std::size_t i : used) {
    inputs.push_back(fmt::format("x[{}]", i));
    centres.push_back(p.centres[i]);
    factors.push_back(1.0 / p.scales[i]);
  }
  const bool is_cubic = p.degree == 3;
  c.work(CWork::scaled, static_cast<double>(used.size()));
  c.work(CWork::term, static_cast<double>(p.coefficients.size()));
  c.local_reals(used.size());
  c.add(
      R"c(
static @real @products(const @real *x) {
  const @real used[$USED$] = {$INPUTS$};
  const @real *c = $COEFFICIENTS$;
  @real z[$USED$], value;
  uint32_t i, j$ALSO_K$;
  for (i = 0U; i < $USED$U; ++i) z[i] = (used[i] - $CENTRES$[i]) * $FACTORS$[i];
  value = *c++;
  for (i = 0U; i < $USED$U; ++i) {
    @real of_first = *c++;
    for (j = i; j < $USED$U; ++j) {
      @real of_pair = *c++;
$THIRD$      of_first += z[j] * of_pair;
    }
    value += z[i] * of_first;
  }
  return value;
}
)c",
      {{"USED", fmt::format("{}", used.size())},
       {"ALSO_K", is_cubic ? ", k" : ""},
       {"THIRD", is_cubic ? fmt::format("      for (k = j; k < {}U; ++k) of_pair += *c++ * z[k];\n",
                                        used.size())
                          : std::string()},
       {"INPUTS", fmt::format("{}", fmt::join(inputs, ", "))},
       {"COEFFICIENTS", c.table("product_coefficients", p.coefficients)},
       {"CENTRES", c.table("product_centres", centres)},
       {"FACTORS", c.table("product_factors", factors)}});
}

class GreyBoxWriter {
 public:
  GreyBoxWriter(CText& c, const GreyBox::Parameters& box)
      : c_(c), box_(box), terms_(box.terms), coefficients_(c, "coefficients", box.coefficients) {}

  void write() {
    need_cell(c_);
    c_.member("@real last_x");
    c_.member("int model_is_started");
    write_curve();
    write_slips("slip", "dx", terms_.thresholds, terms_.friction_knots, terms_.first_slip());
    write_relaxations("relaxed", "dx", terms_.time_constants_s, terms_.first_relaxation());
    write_rates();
    std::size_t column = terms_.first_bank();
    for (std::size_t k = 0; k < terms_.banks.size(); ++k) {
      write_bank(k, column);
      column += terms_.banks[k].columns();
    }
    if (box_.residual) write_residual();
    c_.add(R"c(
static void @reset_model(@state *s) {
$RESETS$  s->model_is_started = 0;
}
static @estimate @model(@state *s, const @real *x) {
$LOCATE$$MOVED$  @real value, share;
  uint32_t $INDICES$left;
$BODY$  s->last_x = x[0];
  s->model_is_started = 1;
$RESIDUAL$  return @plain(value);
}
)c",
           {{"RESETS", resets_},
            {"LOCATE", coefficients_.locate()},
            {"MOVED",
             terms_.thresholds.empty() && terms_.time_constants_s.empty()
                 ? ""
                 : c_.filled(
                       "  const @real dx = s->model_is_started ? x[0] - s->last_x : (@real)0;\n")},
            {"INDICES", body_.find("i = 0U") == std::string::npos ? "" : "i, "},
            {"BODY", body_},
            {"RESIDUAL", box_.residual ? c_.filled("  value += @residual(s, x);\n") : ""}});
  }

 private:
  [[nodiscard]] std::string coefficient(std::size_t first, const std::string& offset = {}) const {
    return coefficients_.at(offset.empty() ? counted(first)
                                           : fmt::format("{} + {}", counted(first), offset));
  }
  /// Whether a column that is not scheduled is 0: a term that is not there.
  [[nodiscard]] bool is_absent(std::size_t column) const {
    const Matrix& values = box_.coefficients.values;
    for (std::size_t k = 0; k < values.rows; ++k)
      if (values(k, column) != 0.0) return false;
    return true;
  }

  void add_cell(const std::vector<double>& knots) {
    c_.work(CWork::search);
    c_.work(CWork::cell, std::log2(static_cast<double>(knots.size())));
  }

  /// A step evaluates so many coefficients.
  void add_coefficients(double count) {
    c_.work(coefficients_.is_scheduled() ? CWork::scheduled : CWork::term, count);
  }

  void write_curve() {
    const std::string knots = c_.table("curve_knots", terms_.curve_knots);
    add_cell(terms_.curve_knots);
    add_coefficients(2.0);
    body_ += fmt::format(R"c(  left = @cell({}, {}, x[0], &share);
  value = {} * ((@real)1 - share) + {} * share;
)c",
                         knots, counted(terms_.curve_knots.size()), coefficients_.at("left"),
                         coefficients_.at("left + 1U"));
  }

  /// Stops over one coordinate, with forces that depend on x. @param moved its increment, a C expression
  void write_slips(const std::string& name, const std::string& moved,
                   const std::vector<double>& thresholds, const std::vector<double>& knots,
                   std::size_t first) {
    if (thresholds.empty()) return;
    c_.work(CWork::element, static_cast<double>(thresholds.size()));
    add_coefficients(static_cast<double>(thresholds.size()) * (knots.size() > 1 ? 2.0 : 1.0));
    if (knots.size() > 1) add_cell(knots);
    std::vector<double> stiffness;
    stiffness.reserve(thresholds.size());
    for (const double threshold : thresholds) stiffness.push_back(1.0 / threshold);
    const std::string table = c_.table(name + "_stiffness", stiffness);
    c_.member(fmt::format("@real {}[{}]", name, thresholds.size()));
    resets_ += cleared(c_, "s->" + name, thresholds.size());
    std::string force = coefficient(first, "i");
    if (knots.size() > 1) {
      body_ += fmt::format(
          "  left = @cell({}, {}, x[0], &share);\n  share = @limited(share, (@real)0, (@real)1);\n",
          c_.table(name + "_knots", knots), counted(knots.size()));
      const std::string at = fmt::format("i * {} + left", counted(knots.size()));
      force = fmt::format("({} * ((@real)1 - share) + {} * share)", coefficient(first, at),
                          coefficient(first + 1, at));
    }
    body_ += fmt::format(R"c(  for (i = 0U; i < {0}; ++i) {{
    s->{1}[i] = @limited(s->{1}[i] + {2} * {3}[i], (@real)-1, (@real)1);
    value += {4} * s->{1}[i];
  }}
)c",
                         counted(thresholds.size()), name, moved, table, force);
  }

  void write_relaxations(const std::string& name, const std::string& moved,
                         const std::vector<double>& time_constants_s, std::size_t first) {
    if (time_constants_s.empty()) return;
    std::vector<double> gain;
    std::vector<double> loss;
    for (const double time_constant_s : time_constants_s) {
      const double periods = terms_.sample_period_s / time_constant_s;
      loss.push_back(-std::expm1(-periods));
      gain.push_back(loss.back() / periods);
    }
    c_.work(CWork::relaxation, static_cast<double>(gain.size()));
    add_coefficients(static_cast<double>(gain.size()));
    const std::string gains = c_.table(name + "_gain", gain);
    const std::string losses = c_.table(name + "_loss", loss);
    c_.member(fmt::format("@real {}[{}]", name, gain.size()));
    resets_ += cleared(c_, "s->" + name, gain.size());
    body_ += fmt::format(R"c(  for (i = 0U; i < {0}; ++i) {{
    s->{1}[i] += {2}[i] * {3} - {4}[i] * s->{1}[i];
    value += {5} * s->{1}[i];
  }}
)c",
                         counted(gain.size()), name, gains, moved, losses, coefficient(first, "i"));
  }

  void write_rates() {
    for (std::size_t j = 1; j < terms_.inputs(); ++j) {
      if (!is_absent(terms_.first_slope() + j)) add_coefficients(1.0);
      if (!is_absent(terms_.first_slope() + j))
        body_ += fmt::format("  value += {} * x[{}];\n", coefficient(terms_.first_slope() + j), j);
      const double scale = terms_.rate_scales[j];
      if (!(scale > 0.0) || is_absent(terms_.first_coulomb() + j)) continue;
      c_.work(CWork::tangent);
      add_coefficients(1.0);
      body_ += fmt::format("  value += {} * @hyperbolic_tangent(x[{}] * {});\n",
                           coefficient(terms_.first_coulomb() + j), j, c_.number(1.0 / scale));
    }
  }

  void write_bank(std::size_t k, std::size_t first) {
    const InputBank& bank = terms_.banks[k];
    const std::string name = fmt::format("bank_{}", k);
    const std::string u = fmt::format("x[{}]", bank.input);
    c_.member(fmt::format("@real {}_last", name));
    c_.work(CWork::bank);
    body_ += c_.filled(
        "  {\n    const @real du = s->model_is_started ? $U$ - s->$NAME$_last : (@real)0;\n",
        {{"U", u}, {"NAME", name}});
    std::string travel = "du";
    if (bank.is_integrated) {
      travel = "dq";
      body_ += c_.filled("    const @real dq = s->model_is_started ? $PERIOD$ * $U$ : (@real)0;\n",
                         {{"PERIOD", c_.number(terms_.sample_period_s)}, {"U", u}});
    }
    if (bank.time_constants_s.empty() && (bank.is_integrated || bank.thresholds.empty()))
      body_ += "    (void)du;\n";
    if (bank.is_integrated && bank.thresholds.empty()) body_ += "    (void)dq;\n";
    write_slips(name + "_slip", travel, bank.thresholds, bank.force_knots, first);
    if (!bank.curve_knots.empty()) write_bank_curve(name, u, bank, first);
    if (!bank.product_knots.empty()) write_bank_product(name, u, bank, first);
    write_relaxations(name + "_relaxed", "du", bank.time_constants_s,
                      first + bank.first_relaxation());
    body_ += fmt::format("    s->{}_last = {};\n  }}\n", name, u);
  }

  void write_bank_curve(const std::string& name, const std::string& u, const InputBank& bank,
                        std::size_t first) {
    const std::size_t knots = bank.curve_knots.size();
    const std::string table = c_.table(name + "_curve_knots", bank.curve_knots);
    add_cell(bank.curve_knots);
    add_coefficients(2.0);
    const std::size_t column = first + bank.first_curve();
    body_ += fmt::format(R"c(    if ({0} >= {1}[0] && {0} <= {1}[{2}]) {{
      left = @cell({1}, {3}, {0}, &share);
      if (left > 0U) value += {4} * ((@real)1 - share);
      if (left < {5}) value += {6} * share;
    }}
)c",
                         u, table, knots - 1, counted(knots), coefficient(column, "left - 1U"),
                         counted(knots - 2), coefficient(column, "left"));
  }

  void write_bank_product(const std::string& name, const std::string& u, const InputBank& bank,
                          std::size_t first) {
    const std::string table = c_.table(name + "_product_knots", bank.product_knots);
    add_cell(bank.product_knots);
    add_coefficients(2.0);
    const std::size_t column = first + bank.first_product();
    body_ += fmt::format(R"c(    left = @cell({0}, {1}, x[{2}], &share);
    share = @limited(share, (@real)0, (@real)1);
    value += {3} * ({4} * ((@real)1 - share) + {5} * share);
)c",
                         table, counted(bank.product_knots.size()), bank.product_input, u,
                         coefficient(column, "left"), coefficient(column, "left + 1U"));
  }

  /// How C calls the model of a residual at the inputs `y`.
  struct ResidualCall {
    std::string declaration = {};
    std::string before = {};  ///< statements
    std::string value;
  };

  ResidualCall write_residual_model() {
    const GreyBoxResidual& learned = *box_.residual;
    if (const auto* network = std::get_if<Mlp::Parameters>(&learned.model)) {
      const std::size_t all = network->scaling.inputs.scale.size();
      c_.local_floats(all);
      write_dense(c_, "network", network->layers);
      return {.declaration = fmt::format("  float in[{}];\n", all),
              .before = standardised(c_, "input", network->scaling, "y", "in"),
              .value = destandardised(c_, network->scaling, "@network(in)")};
    }
    if (const auto* products = std::get_if<InputProducts::Parameters>(&learned.model)) {
      write_products(c_, *products);
      return {.value = "@products(y)"};
    }
    if (const auto* process = std::get_if<ParametricGp::Parameters>(&learned.model)) {
      write_gp_mean(c_, *process);
      return {.value = "@mean(y)"};
    }
    throw UsageError({.place = "the model",
                      .expected = "a grey_box without a mixture as its residual",
                      .found = "a mixture as its residual",
                      .advice = "Fit it again with --set residual=auto or residual=none."});
  }

  void write_residual() {
    const GreyBoxResidual& learned = *box_.residual;
    const std::size_t inputs = terms_.inputs();
    const std::size_t all = inputs + terms_.thresholds.size();
    std::vector<double> border;
    for (std::size_t j = 0; j < all; ++j)
      border.push_back(GreyBoxResidual::kBorder * (learned.highest[j] - learned.lowest[j]));
    c_.work(CWork::border, static_cast<double>(all));
    c_.local_reals(all);
    const ResidualCall call = write_residual_model();
    c_.add(
        R"c(
/* A bounded correction, faded out where an input leaves what it was trained on. */
static @real @residual(const @state *s, const @real *x) {
  @real y[$ALL$], share = (@real)1, correction;
$DECLARATION$  uint32_t j;
  for (j = 0U; j < $INPUTS$U; ++j) y[j] = x[j];
$SLIPS$  for (j = 0U; j < $ALL$U; ++j) {
    const @real below = $LOWEST$[j] - y[j], above = y[j] - $HIGHEST$[j];
    const @real left_by = below > above ? below : above;
    if (left_by <= (@real)0) continue;
    if (!(left_by < $BORDER$[j])) return (@real)0;
    if ((@real)1 - left_by / $BORDER$[j] < share) share = (@real)1 - left_by / $BORDER$[j];
  }
$BEFORE$  correction = $VALUE$;
  if (!(correction - correction == (@real)0)) return (@real)0;
  return share * @limited(correction, -$BOUND$, $BOUND$);
}
)c",
        {{"ALL", fmt::format("{}", all)},
         {"INPUTS", fmt::format("{}", inputs)},
         {"SLIPS", terms_.thresholds.empty()
                       ? "  (void)s;\n"
                       : fmt::format("  for (j = {0}U; j < {1}U; ++j) y[j] = s->slip[j - {0}U];\n",
                                     inputs, all)},
         {"LOWEST", c_.table("residual_lowest", learned.lowest)},
         {"HIGHEST", c_.table("residual_highest", learned.highest)},
         {"BORDER", c_.table("residual_border", border)},
         {"DECLARATION", call.declaration},
         {"BEFORE", call.before},
         {"VALUE", call.value},
         {"BOUND", c_.number(learned.bound)}});
  }

  CText& c_;
  const GreyBox::Parameters& box_;
  const GreyBoxTerms::Structure& terms_;
  CCoefficients coefficients_;
  std::string body_;
  std::string resets_;
};

}  // namespace

void write_grey_box(CText& c, const GreyBox::Parameters& parameters) {
  GreyBoxWriter(c, parameters).write();
}

}  // namespace torsio
