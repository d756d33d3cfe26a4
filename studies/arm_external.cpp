#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "arm_springs.hpp"
#include "core/report_progress.hpp"
#include "numerics/quantile.hpp"
#include "sim/contacts/arm_free_motion.hpp"
#include "studies.hpp"
#include "study_rows.hpp"

namespace torsio {
namespace {

constexpr std::size_t kExternalArms = 10;
constexpr std::size_t kQuickExternalArms = 1;
constexpr double kMotion_s = 60.0;
constexpr double kQuickMotion_s = 15.0;
constexpr std::array kPayloads_kg{8.0, 0.0};
// At most so many times the error of straight lines: joints 2 to 5, and those that carry little.
constexpr double kLoadedRatio = 0.5;
constexpr double kUnloadedRatio = 1.05;

/// Whose springs a model is fitted to.
struct SpringSource {
  const char* name;
  std::size_t arms_further;  ///< from the arm that moves
};
constexpr std::array kSpringSources{SpringSource{"own bench", 0},
                                    SpringSource{"bench of another specimen", kExternalArms}};
constexpr std::array kSpringFamilies{"linear", "grey_box"};

using ExternalErrors = std::array<double, kMaxArmJoints>;

/// The root mean square of the external torque of each joint in random motion without contacts.
ExternalErrors free_errors(const ArmSetup& setup, const std::vector<ModelFile>& models,
                           double duration_s, std::uint64_t seed) {
  ArmFreeMotion motion(setup, settings_with(setup, models), FirstStageForm::elastic, seed);
  ExternalErrors squares = {};
  const auto ticks = static_cast<std::size_t>(duration_s * kBenchRate_Hz);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const ArmController::Output& output = motion.control();
    for (std::size_t j = 0; j < setup.joints.size(); ++j)
      squares[j] += output.joints[j].external_Nm * output.joints[j].external_Nm;
    motion.act({});
  }
  for (double& square : squares) square = std::sqrt(square / static_cast<double>(ticks));
  return squares;
}

/// Errors of all arms under one condition.
struct ExternalCase {
  std::vector<ExternalErrors> lines = {};
  std::vector<ExternalErrors> learned = {};

  [[nodiscard]] static double median(const std::vector<ExternalErrors>& of, std::size_t joint) {
    std::vector<double> values;
    values.reserve(of.size());
    for (const ExternalErrors& errors : of) values.push_back(errors[joint]);
    return quantile(std::move(values), 0.5);
  }
  [[nodiscard]] std::vector<double> ratios(std::size_t joint) const {
    std::vector<double> values;
    values.reserve(lines.size());
    for (std::size_t k = 0; k < lines.size(); ++k)
      values.push_back(learned[k][joint] / lines[k][joint]);
    return values;
  }
};

void write_rows(QuantityTable& table, const ExternalCase& of, double payload_kg,
                const SpringSource& source, std::size_t joints) {
  for (std::size_t j = 0; j < joints; ++j) {
    const std::string condition =
        fmt::format("joint {}, {:g} kg, {}", j + 1, payload_kg, source.name);
    const auto row = [&](const char* quantity, double value, const char* unit, std::string remark) {
      table.rows.push_back({.condition = condition,
                            .quantity = quantity,
                            .value = value,
                            .unit = unit,
                            .remark = std::move(remark)});
    };
    row("RMSE of the external torque, linear", ExternalCase::median(of.lines, j), "Nm", {});
    row("RMSE of the external torque, grey_box", ExternalCase::median(of.learned, j), "Nm", {});
    const std::vector<double> ratios = of.ratios(j);
    const double median = quantile(ratios, 0.5);
    const double limit = j == 0 || j == 5 ? kUnloadedRatio : kLoadedRatio;
    std::string remark =
        fmt::format("{:.2f} to {:.2f}", std::ranges::min(ratios), std::ranges::max(ratios));
    if (source.arms_further == 0)
      remark += fmt::format("; wanted at most {:g}: {}", limit, median <= limit ? "met" : "missed");
    row("ratio of the two", median, "-", remark);
  }
}

}  // namespace

Study arm_external(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "arms of six elastic joints with manufacturing tolerances move at random without "
          "contacts. "
          "The external torque is that of the momentum observer with two poles of 100 rad/s; its "
          "value is the error. Models of the springs are fitted to four recordings of 50 s of a "
          "bench with a load cell: of each joint, or of another specimen of its type. Medians over "
          "the arms",
      .unit = "Nm",
      .options = options};
  const std::size_t arms = options.is_quick ? kQuickExternalArms : kExternalArms;
  const double duration_s = options.is_quick ? kQuickMotion_s : kMotion_s;
  std::array<std::array<ExternalCase, kSpringSources.size()>, kPayloads_kg.size()> cases;
  const std::size_t parts = arms * kSpringSources.size() * kSpringFamilies.size();
  std::size_t part = 0;
  for (std::size_t arm = 0; arm < arms; ++arm) {
    for (std::size_t s = 0; s < kSpringSources.size(); ++s) {
      for (const char* family : kSpringFamilies) {
        // The recordings do not depend on what the arm carries.
        const std::vector<ModelFile> models = bench_models(
            arm_of_specimens(arm + kSpringSources[s].arms_further, kPayloads_kg.front()), family,
            options.seed + 100 * arm,
            nth_of(progress, part++, parts, fmt::format("arm {} of {}", arm + 1, arms)));
        for (std::size_t p = 0; p < kPayloads_kg.size(); ++p) {
          ExternalCase& of = cases[p][s];
          (family == kSpringFamilies.front() ? of.lines : of.learned)
              .push_back(free_errors(arm_of_specimens(arm, kPayloads_kg[p]), models, duration_s,
                                     options.seed + 1000 + arm));
        }
      }
    }
  }
  QuantityTable table;
  for (std::size_t p = 0; p < kPayloads_kg.size(); ++p)
    for (std::size_t s = 0; s < kSpringSources.size(); ++s)
      write_rows(table, cases[p][s], kPayloads_kg[p], kSpringSources[s],
                 arm6_setup().joints.size());
  study.table = std::move(table);
  for (const char* actuator : {"dfki-300", "dfki-120", "dfki-28"})
    study.plants.push_back(study_plant(actuator));
  study.notes.push_back(
      fmt::format("{} arms, {:g} s of motion each; payload, masses and lengths of the links are "
                  "exact, the friction of the bearings is that of the data sheet.",
                  arms, duration_s));
  return study;
}

}  // namespace torsio
