#include "fit/second_order/second_order_families.hpp"

#include <array>

#include "fit/common/fitted_model.hpp"
#include "fit/second_order/fit_dynamic_bouc_wen.hpp"
#include "fit/second_order/fit_friction_drive.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr OptionInfo substeps(std::string_view default_value) {
  return {"substeps", Kind::integer, default_value,
          1,          1000,          "of the integrator in one sample period"};
}
constexpr OptionInfo kInputOrder{
    "input_order",
    Kind::integer,
    "3",
    0,
    CausalPolynomial::kHighestOrder,
    "of the polynomial that tells the force between its samples; 0: held"};
constexpr OptionInfo first_horizon(std::string_view default_value) {
  return {"first_horizon",
          Kind::integer,
          default_value,
          10,
          1e9,
          "samples that the first search sees; each further one sees four times as many"};
}
constexpr OptionInfo kIterations{
    "iterations", Kind::integer, "200", 1, 1e6, "at most, of the last search"};

constexpr std::array kBoucWenOptions{
    OptionInfo{"exponent", Kind::number, "1", 1, 10,
               "n: how sharply the hysteretic force bends; auto: searched for"},
    substeps("4"), kInputOrder, first_horizon("500"), kIterations};

constexpr std::array kDriveOptions{
    OptionInfo{"gain", Kind::number, "1", -1e12, 1e12,
               "force of one unit of the first input; known beforehand, it scales the others"},
    OptionInfo{"terms", Kind::text, "none", 0, 0,
               "besides inertia, viscous and Coulomb friction and offset: some of stribeck, lugre, "
               "asymmetry, quadratic, spring, position, joined by +; auto: by held-out blocks"},
    substeps("1"),
    kInputOrder,
    first_horizon("2000"),
    kIterations};

FittedModel dynamic_bouc_wen(const TrainingData& data, const Options& options,
                             const FitContext& context) {
  return fitted_model(fit_dynamic_bouc_wen(data,
                                           {.exponent = options.number("exponent"),
                                            .substeps = options.integer("substeps"),
                                            .input_order = options.integer("input_order"),
                                            .first_horizon = options.integer("first_horizon"),
                                            .iterations = options.integer("iterations")},
                                           context.progress));
}

FittedModel friction_drive(const TrainingData& data, const Options& options,
                           const FitContext& context) {
  return fitted_model(fit_friction_drive(data,
                                         {.gain = options.number("gain"),
                                          .terms = options.text("terms"),
                                          .substeps = options.integer("substeps"),
                                          .input_order = options.integer("input_order"),
                                          .first_horizon = options.integer("first_horizon"),
                                          .iterations = options.integer("iterations")},
                                         context.progress));
}

constexpr std::array kSecondOrderFamilies{
    FamilyInfo{.name = DynamicBoucWen::kFamily,
               .summary = "mass, damper and spring beside a Bouc-Wen element, driven by a force",
               .options = kBoucWenOptions,
               .fit = dynamic_bouc_wen,
               .only_if_named = true},
    FamilyInfo{.name = FrictionDrive::kFamily,
               .summary = "inertia with viscous and dry friction, driven by a force",
               .options = kDriveOptions,
               .fit = friction_drive,
               .only_if_named = true}};

}  // namespace

std::span<const FamilyInfo> second_order_families() noexcept { return kSecondOrderFamilies; }

}  // namespace torsio
