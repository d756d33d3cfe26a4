#include "export/c_grey_box_inverse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "export/c_coefficients.hpp"
#include "export/c_model_inverse.hpp"
#include "export/c_statements.hpp"

namespace torsio {
namespace {

/// The terms of a grey box as if its inputs had jumped at once to where they are, from the state as it is: nothing
/// relaxes on the way (`GreyBoxTerms::visit_jump`, `InputBankTerms::jump`).
class JumpWriter {
 public:
  JumpWriter(CText& c, const GreyBox::Parameters& box)
      : c_(c),
        box_(box),
        terms_(box.terms),
        coefficients_(c, "coefficients", box.coefficients),
        banks_follow_x_(std::ranges::any_of(box.terms.banks, &InputBank::follows_x)) {}

  void write() {
    const double evaluations = root_evaluations(c_.real()).broken;
    c_.work(CWork::evaluation, evaluations);
    c_.work(CWork::evaluated, evaluations * static_cast<double>(terms_.thresholds.size()));
    c_.repeat_in_control(
        {CWork::search, CWork::cell, CWork::relaxation, CWork::schedule, CWork::scheduled},
        evaluations);
    if (box_.residual)
      c_.repeat_in_control(
          {CWork::scaled, CWork::layer, CWork::weight, CWork::unit, CWork::tangent}, 1.0);
    write_apart();
    write_error();
    write_root(c_);
    write_inverse();
  }

 private:
  [[nodiscard]] std::string coefficient(std::size_t first, std::string_view offset = {}) const {
    return coefficients_.at(offset.empty() ? counted(first)
                                           : fmt::format("{} + {}", counted(first), offset));
  }
  /// The place among knots of which the outer ones hold, in `left` and `share`.
  [[nodiscard]] std::string held_cell(const std::string& table, std::size_t knots,
                                      const std::string& at) const {
    return c_.filled(
        "  left = @cell(@$TABLE$, $COUNT$, $AT$, &share);\n  share = @limited(share, (@real)0, "
        "(@real)1);\n",
        {{"TABLE", table}, {"COUNT", counted(knots)}, {"AT", at}});
  }
  /// A coefficient for each of some slips, between knots if there are several.
  [[nodiscard]] std::string force(std::size_t first, std::size_t knots) const {
    if (knots == 1) return coefficient(first, "i");
    const std::string at = fmt::format("i * {} + left", counted(knots));
    return c_.filled("($LEFT$ * ((@real)1 - share) + $RIGHT$ * share)",
                     {{"LEFT", coefficient(first, at)}, {"RIGHT", coefficient(first + 1, at)}});
  }
  [[nodiscard]] std::string slips(const std::string& name, const std::string& moved,
                                  const std::vector<double>& thresholds,
                                  const std::vector<double>& knots, std::size_t first,
                                  const std::string& z) const {
    if (thresholds.empty()) return {};
    return (knots.size() > 1 ? held_cell(name + "_knots", knots.size(), z) : "") +
           c_.filled(
               "  for (i = 0U; i < $COUNT$; ++i)\n    value += $FORCE$ * @limited(s->$NAME$[i] + "
               "$MOVED$ * @$NAME$_stiffness[i], (@real)-1, (@real)1);\n",
               {{"COUNT", counted(thresholds.size())},
                {"FORCE", force(first, knots.size())},
                {"NAME", name},
                {"MOVED", moved}});
  }
  [[nodiscard]] std::string relaxations(const std::string& name, const std::string& moved,
                                        std::size_t count, std::size_t first) const {
    if (count == 0) return {};
    return c_.filled("  for (i = 0U; i < $COUNT$; ++i) value += $C$ * (s->$NAME$[i] + $MOVED$);\n",
                     {{"COUNT", counted(count)},
                      {"C", coefficient(first, "i")},
                      {"NAME", name},
                      {"MOVED", moved}});
  }

  [[nodiscard]] std::string bank(std::size_t k, std::size_t first, const std::string& z) const {
    const InputBank& own = terms_.banks[k];
    const std::string name = fmt::format("bank_{}", k);
    const std::string u = fmt::format("x[{}]", own.input);
    const std::string du = fmt::format("du_{}", k);
    std::string text =
        c_.filled("  const @real $DU$ = s->model_is_started ? $U$ - s->$NAME$_last : (@real)0;\n",
                  {{"DU", du}, {"U", u}, {"NAME", name}});
    std::string travel = du;
    if (own.is_integrated)
      travel = c_.filled("(s->model_is_started ? $PERIOD$ * $U$ : (@real)0)",
                         {{"PERIOD", c_.number(terms_.sample_period_s)}, {"U", u}});
    declarations_ += text;
    if (own.time_constants_s.empty() && (own.is_integrated || own.thresholds.empty()))
      declarations_ += fmt::format("  (void){};\n", du);
    text = slips(name + "_slip", travel, own.thresholds, own.force_knots, first, z);
    if (!own.curve_knots.empty()) {
      const std::size_t knots = own.curve_knots.size();
      const std::size_t column = first + own.first_curve();
      text += c_.filled(R"c(  if ($U$ >= @$TABLE$[0] && $U$ <= @$TABLE$[$LAST$]) {
    left = @cell(@$TABLE$, $COUNT$, $U$, &share);
    if (left > 0U) value += $LEFT$ * ((@real)1 - share);
    if (left < $INNER$) value += $RIGHT$ * share;
  }
)c",
                        {{"U", u},
                         {"TABLE", name + "_curve_knots"},
                         {"LAST", counted(knots - 1)},
                         {"COUNT", counted(knots)},
                         {"INNER", counted(knots - 2)},
                         {"LEFT", coefficient(column, "left - 1U")},
                         {"RIGHT", coefficient(column, "left")}});
    }
    if (!own.product_knots.empty()) {
      const std::size_t column = first + own.first_product();
      text += held_cell(name + "_product_knots", own.product_knots.size(),
                        own.product_input == 0 ? z : fmt::format("x[{}]", own.product_input)) +
              c_.filled("  value += $U$ * ($LEFT$ * ((@real)1 - share) + $RIGHT$ * share);\n",
                        {{"U", u},
                         {"LEFT", coefficient(column, "left")},
                         {"RIGHT", coefficient(column, "left + 1U")}});
    }
    return text + relaxations(name + "_relaxed", du, own.time_constants_s.size(),
                              first + own.first_relaxation());
  }
  [[nodiscard]] std::string banks(const std::string& z) const {
    std::string text;
    std::size_t column = terms_.first_bank();
    for (std::size_t k = 0; k < terms_.banks.size(); ++k) {
      text += bank(k, column, z);
      column += terms_.banks[k].columns();
    }
    return text;
  }
  /// Declarations that the statements need, and those of the banks before them.
  [[nodiscard]] std::string declared(const std::string& body) {
    std::string text = std::exchange(declarations_, {});
    if (body.find("share") != std::string::npos)
      text = c_.filled("  @real share;\n  uint32_t left;\n") + text;
    if (body.find("i = 0U") != std::string::npos) text = "  uint32_t i;\n" + text;
    return text;
  }

  /// What does not depend on the first input.
  void write_apart() {
    std::string body;
    for (std::size_t j = 1; j < terms_.inputs(); ++j) {
      body += fmt::format("  value += {} * x[{}];\n", coefficient(terms_.first_slope() + j), j);
      if (const double scale = terms_.rate_scales[j]; scale > 0.0)
        body += c_.filled("  value += $C$ * @hyperbolic_tangent(x[$J$] * $PER_SCALE$);\n",
                          {{"C", coefficient(terms_.first_coulomb() + j)},
                           {"J", fmt::format("{}", j)},
                           {"PER_SCALE", c_.number(1.0 / scale)}});
    }
    if (!banks_follow_x_) body += banks("x[0]");
    if (box_.residual) {
      body += c_.filled(R"c(  for (j = 0U; j < $INPUTS$; ++j) y[j] = x[j];
  y[0] = s->model_is_started ? s->last_x : (@real)0;
  value += @residual(s, y);
)c",
                        {{"INPUTS", counted(terms_.inputs())}});
      declarations_ += fmt::format("  @real y[{}];\n  uint32_t j;\n", terms_.inputs());
    }
    c_.add(R"c(
static @real @apart(const @state *s, const @real *x) {
$LOCATE$  @real value = (@real)0;
$DECLARED$  (void)s;
  (void)x;
$BODY$  return value;
}
)c",
           {{"LOCATE", coefficients_.locate()}, {"DECLARED", declared(body)}, {"BODY", body}});
  }

  void write_error() {
    std::string body = c_.filled(R"c(  left = @cell(@curve_knots, $COUNT$, z, &share);
  value += $LEFT$ * ((@real)1 - share) + $RIGHT$ * share;
)c",
                                 {{"COUNT", counted(terms_.curve_knots.size())},
                                  {"LEFT", coefficients_.at("left")},
                                  {"RIGHT", coefficients_.at("left + 1U")}});
    body += slips("slip", "dx", terms_.thresholds, terms_.friction_knots, terms_.first_slip(), "z");
    body += relaxations("relaxed", "dx", terms_.time_constants_s.size(), terms_.first_relaxation());
    if (banks_follow_x_) body += banks("z");
    c_.add(R"c(
/* The terms that depend on the first input, if that were z at once, less the wanted value. */
static @real @error_at(const @state *s, const @real *x, @real wanted, @real z) {
$LOCATE$  const @real dx = s->model_is_started ? z - s->last_x : (@real)0;
  @real value = -wanted;
$DECLARED$  (void)dx;
  (void)x;
$BODY$  return value;
}
)c",
           {{"LOCATE", coefficients_.locate()}, {"DECLARED", declared(body)}, {"BODY", body}});
  }

  void write_inverse() {
    const std::size_t knots = terms_.curve_knots.size();
    const double low = terms_.curve_knots.front();
    const double high = terms_.curve_knots.back();
    const double beyond = GreyBox::kInversionReach * (high - low);
    c_.add(R"c(
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
  const @real wanted = target - @apart(s, x);
  @real low = @curve_knots[0], high = @curve_knots[$LAST$];
  @real error_low = @error_at(s, x, wanted, low), error_high = @error_at(s, x, wanted, high);
  if (!(error_low * error_high <= (@real)0)) {
    /* Beyond its ends the curve continues; the nearer one is left. */
    const int is_low = @absolute(error_low) < @absolute(error_high);
    const @real end = is_low ? low : high;
    if (is_low) {
      high = low;
      error_high = error_low;
      low -= $BEYOND$;
      error_low = @error_at(s, x, wanted, low);
    } else {
      low = high;
      error_low = error_high;
      high += $BEYOND$;
      error_high = @error_at(s, x, wanted, high);
    }
    if (!(error_low * error_high <= (@real)0)) {
      *inverse = end;
      return @OUTSIDE_TRAINING_RANGE;
    }
  }
  *inverse = @root(s, x, wanted, low, high, error_low, error_high);
  return @NONE;
}
)c",
           {{"LAST", counted(knots - 1)}, {"BEYOND", c_.number(beyond)}});
  }

  CText& c_;
  const GreyBox::Parameters& box_;
  const GreyBoxTerms::Structure& terms_;
  CCoefficients coefficients_;
  bool banks_follow_x_;
  mutable std::string declarations_;
};

}  // namespace

void write_grey_box_inverse(CText& c, const GreyBox::Parameters& parameters) {
  JumpWriter(c, parameters).write();
}

}  // namespace torsio
