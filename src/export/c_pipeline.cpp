#include "export/c_pipeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "export/c_statements.hpp"

namespace torsio {
namespace {

using Value = PipelineListing::Value;

/// A value as a sum of counted inputs: weights in SI per part of a count, and an offset in SI.
struct CountedSum {
  std::map<std::size_t, double> weights;  ///< by raw input
  double offset = 0.0;
};

CountedSum plus(const CountedSum& a, const CountedSum& b, double sign) {
  CountedSum sum = a;
  for (const auto& [input, weight] : b.weights) sum.weights[input] += sign * weight;
  sum.offset += sign * b.offset;
  return sum;
}

CountedSum times(const CountedSum& a, double factor) {
  CountedSum product{.weights = {}, .offset = a.offset * factor};
  for (const auto& [input, weight] : a.weights) product.weights[input] = weight * factor;
  return product;
}

class PipelineWriter {
 public:
  PipelineWriter(CText& c, const PipelineListing& listing, const std::vector<CInput>& inputs,
                 std::span<const double> slopes)
      : c_(c),
        listing_(listing),
        inputs_(inputs),
        slopes_(slopes),
        counted_(listing.value_count),
        names_(listing.value_count),
        has_error_(listing.value_count, false) {}

  void write() {
    for (const PipelineListing::Constant& constant : listing_.constants) {
      names_[constant.target] = c_.number(constant.value, "a constant of an expression");
      counted_[constant.target] = CountedSum{.weights = {}, .offset = constant.value};
    }
    for (std::size_t i = 0; i < inputs_.size(); ++i) write_input(i);
    for (const auto& instruction : listing_.instructions)
      std::visit([this](const auto& of) { write_instruction(of); }, instruction);
    for (std::size_t i = 0; i < listing_.features.size(); ++i)
      body_ += fmt::format("  f[{}] = {};\n", i, real(listing_.features[i]));
    if (has_unknown_start(listing_)) write_start();
    if (listing_.settling_samples > 0) {
      c_.member("uint32_t seen");
      resets_ += "  s->seen = 0U;\n";
      body_ += fmt::format("  if (s->seen < {}U) ++s->seen;\n", listing_.settling_samples);
    }
    if (resets_.empty()) resets_ = "  (void)s;\n";
    const bool uses_state = body_.find("s->") != std::string::npos;
    c_.add(R"c(
static void @reset_pipeline(@state *s) {
$RESETS$}

static void @pipeline(@state *s, const @raw *raw, @real *f) {
$UNUSED$$BODY$}
)c",
           {{"RESETS", resets_}, {"UNUSED", uses_state ? "" : "  (void)s;\n"}, {"BODY", body_}});
  }

 private:
  void write_input(std::size_t i) {
    const Value target = listing_.raw_targets[i];
    const CInput& input = inputs_[i];
    const std::string zero = input.has_zero ? fmt::format(" - s->zero_{}", input.channel) : "";
    if (input.is_counted()) {
      body_ += fmt::format("  const int64_t q{} = raw->{}{};\n", i, input.channel, zero);
      counted_[target] = CountedSum{.weights = {{i, *input.unit / kCountParts}}};
      return;
    }
    names_[target] = fmt::format("v{}", target);
    body_ +=
        c_.filled("  const @real v$T$ = raw->$CHANNEL$$ZERO$;\n",
                  {{"T", fmt::format("{}", target)}, {"CHANNEL", input.channel}, {"ZERO", zero}});
  }

  /// The name of a real value; of a sum of counts once it is needed.
  std::string real(Value value) {
    if (!names_[value].empty()) return names_[value];
    const auto [sum, scale] = fixed(*counted_[value]);
    need_fixed(c_);
    names_[value] = fmt::format("v{}", value);
    body_ +=
        c_.filled("  const @real v$T$ = @from_fixed($SUM$) * $SCALE$;\n",
                  {{"T", fmt::format("{}", value)}, {"SUM", sum}, {"SCALE", c_.number(scale)}});
    return names_[value];
  }

  /// A sum of counts as a whole number, and what one of it is in SI.
  static std::pair<std::string, double> fixed(const CountedSum& of) {
    std::vector<std::pair<std::string, double>> weighted;
    for (const auto& [input, weight] : of.weights)
      weighted.emplace_back(fmt::format("q{}", input), weight);
    return whole_sum(weighted, of.offset);
  }

  [[nodiscard]] bool is_counted(Value value) const {
    return counted_[value] && !counted_[value]->weights.empty();
  }
  [[nodiscard]] bool is_constant(Value value) const {
    return counted_[value] && counted_[value]->weights.empty();
  }

  std::optional<CountedSum> counted_result(const PipelineListing::Computation& of) const {
    const auto& left = counted_[of.left];
    const auto& right = counted_[of.right];
    if (!left || !right || (left->weights.empty() && right->weights.empty())) return std::nullopt;
    switch (of.operation) {
      case Operation::add: return plus(*left, *right, 1.0);
      case Operation::subtract: return plus(*left, *right, -1.0);
      case Operation::negate: return times(*left, -1.0);
      case Operation::multiply:
        if (is_constant(of.left)) return times(*right, left->offset);
        if (is_constant(of.right)) return times(*left, right->offset);
        return std::nullopt;
      case Operation::divide:
        if (is_constant(of.right)) return times(*left, 1.0 / right->offset);
        return std::nullopt;
      default: return std::nullopt;
    }
  }

  void declare(Value target, const std::string& expression) {
    names_[target] = fmt::format("v{}", target);
    body_ += c_.filled("  const @real v$T$ = $WHAT$;\n",
                       {{"T", fmt::format("{}", target)}, {"WHAT", expression}});
  }

  /// An operation without memory as a C expression.
  std::string expression(const PipelineListing::Computation& of, const std::string& a,
                         const std::string& b) {
    const auto call = [&](std::string_view name) {
      return c_.filled("@$NAME$($A$)", {{"NAME", std::string(name)}, {"A", a}});
    };
    switch (of.operation) {
      case Operation::add: return fmt::format("({} + {})", a, b);
      case Operation::subtract: return fmt::format("({} - {})", a, b);
      case Operation::multiply: return fmt::format("({} * {})", a, b);
      case Operation::divide: return fmt::format("({} / {})", a, b);
      case Operation::negate: return fmt::format("(-{})", a);
      case Operation::power: return c_.filled("@power($A$, $B$)", {{"A", a}, {"B", b}});
      case Operation::sign:
        return c_.filled("($A$ > (@real)0 ? (@real)1 : $A$ < (@real)0 ? (@real)-1 : $A$)",
                         {{"A", a}});
      case Operation::min: return fmt::format("({0} < {1} || !({0} == {0}) ? {0} : {1})", a, b);
      case Operation::max: return fmt::format("({0} > {1} || !({0} == {0}) ? {0} : {1})", a, b);
      case Operation::tanh: return call("hyperbolic_tangent");
      case Operation::sin: return call("sine");
      case Operation::cos: return call("cosine");
      case Operation::atan: return call("arc_tangent");
      case Operation::abs: return call("absolute");
      case Operation::sqrt: return call("square_root");
      case Operation::exp: return call("exponential");
      default: return a;
    }
  }

  /// Counts an operation and the functions that it calls.
  void add_work(const PipelineListing::Computation& of) {
    c_.work(CWork::operation);
    switch (of.operation) {
      case Operation::power:
        if (const auto exponent = whole_exponent(of)) {
          c_.work(CWork::power, 2.0 * std::log2(1.0 + std::abs(*exponent)));
          return;
        }
        c_.work(CWork::exponential);
        c_.work(CWork::logarithm);
        return;
      case Operation::tanh: c_.work(CWork::tangent); return;
      case Operation::sin:
      case Operation::cos: c_.work(CWork::sine); return;
      case Operation::atan: c_.work(CWork::arc_tangent); return;
      case Operation::sqrt: c_.work(CWork::root); return;
      case Operation::exp: c_.work(CWork::exponential); return;
      default: return;
    }
  }

  void write_instruction(const PipelineListing::Computation& of) {
    if (auto sum = counted_result(of)) {
      counted_[of.target] = std::move(sum);
      return;
    }
    add_work(of);
    const std::string left = real(of.left);
    const std::string right = real(of.right);
    declare(of.target, write_power(of, left).value_or(expression(of, left, right)));
    if (!has_error_[of.left] && !has_error_[of.right]) return;
    // Each operation is evaluated at the corners of its operands.
    begin_error(of.target);
    std::string corners;
    for (const char* const from_left : {"-", "+"})
      for (const char* const from_right : {"-", "+"}) {
        const auto operand = [&](Value value, const std::string& name, const char* sign) {
          return has_error_[value] ? fmt::format("({} {} e{})", name, sign, value) : name;
        };
        corners += c_.filled("    e$T$ = @larger_error(e$T$, $CORNER$ - v$T$);\n",
                             {{"T", fmt::format("{}", of.target)},
                              {"CORNER", expression(of, operand(of.left, left, from_left),
                                                    operand(of.right, right, from_right))}});
      }
    need_larger_error();
    errors_ += corners;
  }

  [[nodiscard]] std::optional<double> whole_exponent(const PipelineListing::Computation& of) const {
    if (of.operation != Operation::power || !is_constant(of.right)) return std::nullopt;
    const double exponent = counted_[of.right]->offset;
    constexpr double kLargest = 64.0;
    if (std::abs(exponent) > kLargest || exponent != std::floor(exponent)) return std::nullopt;
    return exponent;
  }

  /// A power with a whole exponent needs no logarithm.
  std::optional<std::string> write_power(const PipelineListing::Computation& of,
                                         const std::string& base) {
    const std::optional<double> exponent = whole_exponent(of);
    if (!exponent) return std::nullopt;
    const std::string power =
        c_.filled("@whole_power($BASE$, $N$U)",
                  {{"BASE", base}, {"N", fmt::format("{:.0f}", std::abs(*exponent))}});
    return *exponent < 0.0 ? c_.filled("(@real)1 / ") + power : power;
  }

  void write_instruction(const PipelineListing::Rate& of) {
    c_.work(CWork::rate);
    const std::string last = fmt::format("rate_{}", of.target);
    if (is_counted(of.operand)) {
      const auto [sum, scale] = fixed(*counted_[of.operand]);
      need_fixed(c_);
      c_.member("int64_t " + last);
      body_ += fmt::format("  const int64_t q_{} = {};\n", of.target, sum);
      declare(of.target,
              c_.filled("s->seen == 0U ? (@real)0 : @from_fixed(q_$T$ - s->$LAST$) * $SCALE$",
                        {{"T", fmt::format("{}", of.target)},
                         {"LAST", last},
                         {"SCALE", c_.number(scale * listing_.sample_rate_Hz)}}));
      body_ += fmt::format("  s->{} = q_{};\n", last, of.target);
      return;
    }
    const std::string x = real(of.operand);
    c_.member("@real " + last);
    declare(of.target,
            c_.filled("s->seen == 0U ? (@real)0 : ($X$ - s->$LAST$) * $RATE$",
                      {{"X", x}, {"LAST", last}, {"RATE", c_.number(listing_.sample_rate_Hz)}}));
    body_ += fmt::format("  s->{} = {};\n", last, x);
    if (!has_error_[of.operand]) return;
    begin_error(of.target);
    errors_ +=
        c_.filled("    if (e$X$ != (@real)0) e$T$ = @BOUNDLESS;\n",
                  {{"T", fmt::format("{}", of.target)}, {"X", fmt::format("{}", of.operand)}});
  }

  void write_instruction(const PipelineListing::Filter& of) {
    c_.work(CWork::filter);
    need_lowpass(c_);
    const std::string t = fmt::format("{}", of.target);
    const std::string table =
        c_.table("gains_" + t, std::vector<double>{of.gains.band, of.gains.low, of.gains.high});
    c_.member("@filter lowpass_" + t);
    resets_ += fmt::format("  s->lowpass_{}.is_started = 0;\n", t);
    declare(of.target, c_.filled("@lowpass(&s->lowpass_$T$, $GAINS$, $X$)",
                                 {{"T", t}, {"GAINS", table}, {"X", real(of.operand)}}));
    copy_error(of.target, of.operand);
  }

  void write_instruction(const PipelineListing::Lag& of) {
    c_.work(CWork::rate);
    if (of.samples == 0) {
      declare(of.target, real(of.operand));
      copy_error(of.target, of.operand);
      return;
    }
    const std::string t = fmt::format("{}", of.target);
    const std::string x = real(of.operand);
    c_.member(fmt::format("@real lag_{}[{}]", t, of.samples));
    c_.member(fmt::format("uint32_t lag_next_{}", t));
    c_.member(fmt::format("int lag_is_full_{}", t));
    resets_ += fmt::format("  s->lag_next_{0} = 0U;\n  s->lag_is_full_{0} = 0;\n", t);
    body_ += c_.filled(R"c(  const @real leaving_$T$ = s->lag_$T$[s->lag_next_$T$];
  s->lag_$T$[s->lag_next_$T$] = $X$;
)c",
                       {{"T", t}, {"X", x}});
    declare(of.target, fmt::format("s->lag_is_full_{0} ? leaving_{0} : s->lag_{0}[0]", t));
    body_ += c_.filled(R"c(  if (++s->lag_next_$T$ == $COUNT$U) {
    s->lag_next_$T$ = 0U;
    s->lag_is_full_$T$ = 1;
  }
)c",
                       {{"T", t}, {"COUNT", fmt::format("{}", of.samples)}});
    copy_error(of.target, of.operand);
  }

  void write_instruction(const PipelineListing::Stop& of) {
    c_.work(CWork::stop);
    if (c_.claim("stop")) {
      c_.add_struct(
          "stop",
          "s <- clip(s + change of x, +-threshold), and the states with which it began at "
          "either end.",
          {"@real state", "@real lowest", "@real highest", "@real last", "int is_started"});
      c_.add(R"c(
static @real @stop_step(@stop *stop, @real threshold, @real x) {
  if (!@is_finite(x)) return x;
  if (stop->is_started) {
    const @real change = x - stop->last;
    stop->state = @limited(stop->state + change, -threshold, threshold);
    stop->lowest = @limited(stop->lowest + change, -threshold, threshold);
    stop->highest = @limited(stop->highest + change, -threshold, threshold);
  } else {
    stop->state = (@real)0;
    stop->lowest = -threshold;
    stop->highest = threshold;
  }
  stop->last = x;
  stop->is_started = 1;
  return stop->state;
}
static @real @stop_error(const @stop *stop, @real threshold, @real of_input) {
  const @real own = @larger(stop->highest - stop->state, stop->state - stop->lowest);
  return @smaller((@real)2 * threshold, own + (@real)2 * of_input);
}
)c");
    }
    const std::string t = fmt::format("{}", of.target);
    const std::string threshold = c_.number(of.threshold);
    c_.member("@stop stop_" + t);
    resets_ += fmt::format("  s->stop_{}.is_started = 0;\n", t);
    declare(of.target, c_.filled("@stop_step(&s->stop_$T$, $R$, $X$)",
                                 {{"T", t}, {"R", threshold}, {"X", real(of.operand)}}));
    begin_error(of.target);
    errors_ += c_.filled("    e$T$ = @stop_error(&s->stop_$T$, $R$, $E$);\n",
                         {{"T", t}, {"R", threshold}, {"E", error(of.operand)}});
    settled_.push_back(c_.filled("s->stop_$T$.highest - s->stop_$T$.lowest <= $LIMIT$",
                                 {{"T", t}, {"LIMIT", c_.number(kStopRounding * of.threshold)}}));
  }

  void write_instruction(const PipelineListing::Dahl& of) {
    c_.work(CWork::dahl);
    c_.work(CWork::exponential);
    if (c_.claim("dahl")) {
      c_.add_struct(
          "dahl", "The friction of Dahl over its level.",
          {"@real state", "@real travel", "@real last", "@real input_error", "int is_started"});
      c_.add(R"c(
static @real @dahl_step(@dahl *dahl, @real distance, @real x) {
  if (!@is_finite(x)) return x;
  if (!dahl->is_started) {
    dahl->state = (@real)0;
    dahl->travel = (@real)0;
    dahl->input_error = (@real)0;
  } else if (x != dahl->last) {
    const @real direction = x > dahl->last ? (@real)1 : (@real)-1;
    const @real moved = @absolute(x - dahl->last);
    dahl->state = direction + (dahl->state - direction) * @exponential(-moved / distance);
    dahl->travel += moved;
  }
  dahl->last = x;
  dahl->is_started = 1;
  return dahl->state;
}
static @real @dahl_error(@dahl *dahl, @real distance, @real of_input) {
  @real sure, start;
  dahl->input_error = @larger(dahl->input_error, of_input);
  sure = @larger((@real)0, dahl->travel - (@real)2 * dahl->input_error);
  start = (@real)1 + (@real)4 * dahl->input_error / distance;
  return @smaller((@real)2, start * @exponential(-sure / distance) + (@real)4 * of_input / distance);
}
)c");
    }
    const std::string t = fmt::format("{}", of.target);
    const std::string distance = c_.number(of.distance);
    c_.member("@dahl dahl_" + t);
    resets_ += fmt::format("  s->dahl_{}.is_started = 0;\n", t);
    declare(of.target, c_.filled("@dahl_step(&s->dahl_$T$, $D$, $X$)",
                                 {{"T", t}, {"D", distance}, {"X", real(of.operand)}}));
    begin_error(of.target);
    errors_ += c_.filled("    e$T$ = @dahl_error(&s->dahl_$T$, $D$, $E$);\n",
                         {{"T", t}, {"D", distance}, {"E", error(of.operand)}});
    constexpr double kForgotten = 3.0;  // distances after which 5 % of the start is left
    settled_.push_back(c_.filled("s->dahl_$T$.travel >= $LIMIT$",
                                 {{"T", t}, {"LIMIT", c_.number(kForgotten * of.distance)}}));
  }

  [[nodiscard]] std::string error(Value value) const {
    return has_error_[value] ? fmt::format("e{}", value) : c_.filled("(@real)0");
  }
  void begin_error(Value target) {
    has_error_[target] = true;
    errors_ += c_.filled("    @real e$T$ = (@real)0;\n", {{"T", fmt::format("{}", target)}});
  }
  void copy_error(Value target, Value operand) {
    if (!has_error_[operand]) return;
    begin_error(target);
    errors_ += fmt::format("    e{} = e{};\n", target, operand);
  }
  void need_larger_error() {
    if (!c_.claim("larger_error")) return;
    c_.add(R"c(
static @real @larger_error(@real largest, @real error) {
  const @real size = error < (@real)0 ? -error : error;
  return !(size <= largest) ? size : largest;
}
)c");
  }

  /// The error that the unknown states cause, until they have all been forgotten.
  void write_start() {
    c_.member("@real start_std_dev");
    c_.member("int has_travelled");
    resets_ += "  s->has_travelled = 0;\n";
    std::string condition;
    for (const std::string& each : settled_) condition += (condition.empty() ? "" : " && ") + each;
    std::string sum;
    for (std::size_t i = 0; i < listing_.features.size(); ++i)
      if (has_error_[listing_.features[i]] && slopes_[i] != 0.0)
        sum += c_.filled("    sum += e$F$ * $SLOPE$;\n",
                         {{"F", fmt::format("{}", listing_.features[i])},
                          {"SLOPE", c_.number(std::abs(slopes_[i]) / std::numbers::sqrt3)}});
    body_ += c_.filled(R"c(  s->has_travelled = s->has_travelled || ($CONDITION$);
  s->start_std_dev = (@real)0;
  if (!s->has_travelled) {
    @real sum = (@real)0;
$ERRORS$$SUM$    s->start_std_dev = sum;
  }
)c",
                       {{"CONDITION", condition}, {"ERRORS", errors_}, {"SUM", sum}});
  }

  static constexpr double kStopRounding = 1e-9;

  CText& c_;
  const PipelineListing& listing_;
  const std::vector<CInput>& inputs_;
  std::span<const double> slopes_;
  std::vector<std::optional<CountedSum>> counted_;
  std::vector<std::string> names_;  ///< names of the real values; empty: not written
  std::vector<bool> has_error_;
  std::string body_;
  std::string resets_;
  std::string errors_;
  std::vector<std::string> settled_;
};

}  // namespace

bool has_unknown_start(const PipelineListing& listing) noexcept {
  return std::ranges::any_of(listing.instructions, [](const auto& instruction) {
    return std::holds_alternative<PipelineListing::Stop>(instruction) ||
           std::holds_alternative<PipelineListing::Dahl>(instruction);
  });
}

void write_pipeline(CText& c, const PipelineListing& listing, const std::vector<CInput>& inputs,
                    std::span<const double> slopes) {
  PipelineWriter(c, listing, inputs, slopes).write();
}

}  // namespace torsio
