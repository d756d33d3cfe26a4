// Every option of every family has an effect: set to two values, it gives two models, or two notes on
// them. One test per family, so that none is missing; options that are not listed below get a
// second value by their kind.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "laws/law_data.hpp"
#include "support/dump_any.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"

namespace torsio::test {
namespace {

using Settings = std::map<std::string, std::string>;

/// How the effect of an option is seen.
struct Trial {
  std::string value = {};   ///< besides the one in force; empty: chosen by kind
  Settings given = {};      ///< under which it has an effect
  bool is_refused = false;  ///< the effect is that the fit refuses the value
};

/// Keeps the fits short. Also of `narx_` families, by the family inside.
const std::map<std::string_view, Settings> kQuick{
    {"grey_box", {{"residual", "none"}}},
    {"viscoelastic", {{"network", "standard_linear_solid"}, {"starts", "1"}}},
    {"dgmm", {{"components", "12"}, {"em_iterations", "2"}, {"initial_spread", "0.3"}}},
    {"dgmm_paper", {{"components", "50"}}},
    {"gaussian_process", {{"samples", "40"}, {"restarts", "0"}, {"iterations", "10"}}},
    {"parametric_gp", {{"updates", "300"}, {"inducing_points", "6"}}},
    {"parametric_gp_paper", {{"updates", "300"}, {"inducing_points", "6"}}},
    {"parametric_gp_variational",
     {{"inducing_points", "6"}, {"samples", "80"}, {"iterations", "5"}}},
    {"mlp", {{"layers", "4"}, {"epochs", "2"}, {"batch", "64"}}},
    {"gru", {{"layers", "2"}, {"epochs", "2"}, {"window", "40"}, {"stride", "20"}, {"batch", "8"}}},
    {"lstm",
     {{"layers", "2"}, {"epochs", "2"}, {"window", "40"}, {"stride", "20"}, {"batch", "8"}}},
    {"dynamic_bouc_wen", {{"substeps", "1"}, {"first_horizon", "100"}}},
    {"hammerstein_wiener",
     {{"structure", "given"},
      {"zeros", "0"},
      {"poles", "1"},
      {"input_degree", "1"},
      {"output_degree", "1"},
      {"knots", "3"}}},
    {"narx_polynomial", {{"terms", "6"}}},
    {"narx_dgmm", {{"rounds", "1"}}},
    {"narx_mlp", {{"rounds", "1"}}},
    {"narx_lstm", {{"rounds", "1"}}},
    {"narx_gaussian_process", {{"rounds", "1"}}},
    {"narx_parametric_gp", {{"rounds", "1"}}},
    {"narx_parametric_gp_paper", {{"rounds", "1"}}},
    {"narx_parametric_gp_variational", {{"rounds", "1"}}},
};

/// By option, or by family and option.
const std::map<std::string_view, Trial> kTrials{
    {"schedule", {.value = "support_m"}},
    {"iterations", {.value = "1", .is_refused = true}},
    {"dead_band", {.value = "0.02"}},
    {"grey_box.residual", {.value = "dgmm"}},
    {"grey_box.bound", {.value = "0.5", .given = {{"residual", "dgmm"}}}},
    {"viscoelastic.network", {.value = "maxwell"}},
    {"viscoelastic.refine", {.given = {{"network", "kv(k1=300, d1=1)"}}}},
    {"novelty_distance", {.value = "1"}},
    {"initial_spread", {.value = "0.6"}},
    {"prune_count", {.value = "20", .given = {{"prune_age", "50"}}}},
    {"prune_age", {.value = "50", .given = {{"prune_count", "20"}}}},
    {"kernel", {.value = "se"}},
    {"kernel_plain", {.value = "1/1/1/1/1/1/1/1/1"}},
    {"parametric_gp.mode", {.value = "nlml"}},
    {"parametric_gp_paper.theta", {.value = "plain", .given = {{"kernel", "se"}}}},
    {"parametric_gp_paper.widen", {.given = {{"updates", "1500"}}}},
    {"gaussian_process.iterations", {.value = "2"}},
    {"parametric_gp_variational.iterations", {.value = "2"}},
    {"layers", {.value = "3"}},
    {"head", {.value = "3"}},
    {"head_activation", {.given = {{"head", "3"}}}},
    {"learning_rate_schedule", {.value = "cosine"}},
    {"optimiser", {.given = {{"weight_decay", "0.1"}}}},
    {"weight_decay", {.value = "0.1"}},
    {"clip", {.value = "0.01"}},
    {"patience", {.value = "1", .given = {{"epochs", "40"}, {"learning_rate", "0.3"}}}},
    {"members", {.value = "2"}},
    {"narx_mlp.members", {.value = "2", .is_refused = true}},
    {"narx_lstm.members", {.value = "2", .is_refused = true}},
    {"structure", {.value = "search", .given = {{"input_degree", "auto"}}}},
    {"hammerstein_wiener.zeros", {.value = "1"}},
    {"hammerstein_wiener.poles", {.value = "2"}},
    {"input_degree", {.value = "2"}},
    {"output_degree", {.value = "2"}},
    {"knots", {.value = "4", .given = {{"map", "piecewise_linear"}}}},
    {"continuous", {.value = "tustin"}},
    {"restarts", {.value = "30"}},
    {"window", {.value = "30"}},
    {"dynamic_bouc_wen.substeps", {.value = "2"}},
    {"published", {.value = "discrete", .is_refused = true}},
    {"exponent", {.value = "2"}},
    {"first_horizon", {.value = "50"}},
    {"rigid_drive.terms", {.value = "quadratic"}},
    {"feedback_noise", {.value = "0.2", .given = {{"training", "noise"}}}},
};

/// Options without an effect that this little data can show, and why.
const std::map<std::string_view, std::string_view> kWithoutEffect{
    {"grey_box.average", "no other box is nearly as good: BoxAverage.IsLeftOutOnRequest"}};

/// A value within the range that is not the one in force.
std::string another(const OptionInfo& option, const std::string& value) {
  using Kind = OptionInfo::Kind;
  if (option.kind == Kind::boolean) return value == "true" ? "false" : "true";
  if (option.kind == Kind::choice)
    return std::string(*std::ranges::find_if(
        option.choices, [&](std::string_view each) { return each != value && each != "none"; }));
  if (option.kind == Kind::text) return {};  // needs a trial
  const double now = value == "auto" ? option.maximum : std::stod(value);
  const double other = now > option.minimum ? std::max(option.minimum, 0.5 * now)
                                            : std::min(option.maximum, now + 1.0);
  if (option.kind == Kind::integer) return fmt::format("{}", static_cast<std::size_t>(other));
  return fmt::format("{}", other);
}

Settings quick(const FamilyInfo& family) {
  Settings settings;
  const auto add = [&](std::string_view of) {
    if (const auto found = kQuick.find(of); found != kQuick.end())
      settings.insert(found->second.begin(), found->second.end());
  };
  add(family.name);
  if (family.name.starts_with("narx_")) add(family.name.substr(5));
  std::erase_if(settings, [&](const auto& each) { return !has_option(family, each.first); });
  return settings;
}

Trial trial_of(const FamilyInfo& family, const OptionInfo& option) {
  const std::string own = fmt::format("{}.{}", family.name, option.name);
  const std::string inner = own.substr(own.starts_with("narx_") ? 5 : 0);
  for (const std::string_view key : {std::string_view(own), std::string_view(inner), option.name})
    if (const auto found = kTrials.find(key); found != kTrials.end()) return found->second;
  return {};
}

class OptionLaws : public testing::TestWithParam<const FamilyInfo*> {
 protected:
  /// Model, notes and numbers.
  const std::string& outcome(const Settings& settings) {
    std::string& text = outcomes_[settings];
    if (!text.empty()) return text;
    const FittedModel fitted = family_.fit(data_, Options(family_.options, settings), {.seed = 5});
    text = fmt::format("{}{}", fitted.model.family(), dump(fitted.model.parameters()));
    for (const std::string& note : fitted.notes) text += '\n' + note;
    for (const FittedParameter& each : fitted.table)
      text += fmt::format("\n{} {} {}", each.name, each.value, each.std_error);
    return text;
  }

  void expect_effect(const OptionInfo& option) {
    const std::string own = fmt::format("{}.{}", family_.name, option.name);
    const Trial trial = trial_of(family_, option);
    Settings first = quick(family_);
    for (const auto& [name, value] : trial.given) first[name] = value;
    const std::string in_force = first.contains(std::string(option.name))
                                     ? first[std::string(option.name)]
                                     : std::string(option.default_value);
    Settings second = first;
    std::string& value = second[std::string(option.name)];
    value = trial.value.empty() ? another(option, in_force) : trial.value;
    ASSERT_FALSE(value.empty()) << own << " is a text: kTrials needs a second value of it";
    ASSERT_NE(value, in_force) << own;
    const std::string& before = outcome(first);
    if (trial.is_refused) {
      EXPECT_THROW(outcome(second), Error) << own << "=" << value;
      return;
    }
    const bool has_effect = outcome(second) != before;
    EXPECT_NE(has_effect, kWithoutEffect.contains(own))
        << own << ": " << in_force << " and " << value
        << (has_effect ? " give different models: remove it from kWithoutEffect"
                       : " give the same model: the option is not passed on, or needs a line in "
                         "kTrials or kWithoutEffect");
  }

  const FamilyInfo& family_ = *GetParam();
  TrainingData data_ = data_for(family_, 600);
  std::map<Settings, std::string> outcomes_;  ///< fits that were made
};

TEST_P(OptionLaws, EachOptionHasAnEffect) {
  for (const OptionInfo& option : family_.options) {
    SCOPED_TRACE(option.name);
    EXPECT_NO_THROW(expect_effect(option)) << family_.name << "." << option.name;
  }
}

std::vector<const FamilyInfo*> every_family() {
  std::vector<const FamilyInfo*> all;
  for (const FamilyInfo& family : families()) all.push_back(&family);
  return all;
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, OptionLaws, testing::ValuesIn(every_family()),
                         [](const auto& row) { return std::string(row.param->name); });

}  // namespace
}  // namespace torsio::test
