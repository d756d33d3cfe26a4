#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/report_progress.hpp"
#include "paper_figures.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "turned_sensor.hpp"

// Paper 002, section IV-B: 2.5 kg on a link fall from the horizontal and strike the output of the sensor, whose
// input is fixed, when the link is vertical. What the paper does not print is varied; nothing here is derived from
// the forces that it prints.

namespace torsio {
namespace {

constexpr double kMass_kg = 2.5;
constexpr double kGravity_m_s2 = 9.81;
constexpr double kDropStep_s = 2e-6;
constexpr double kDuration_s = 0.6;
constexpr double kQuickDuration_s = 0.05;
constexpr double kContactDamping = 0.05;  // share of the critical one of the mass on the contact
constexpr double kPassed_rad = 1.2;       // the arm has turned out of the way

constexpr std::array kArms_m{0.04, 0.06, 0.08};
constexpr std::array kLinks_m{0.1, 0.2, 0.3};
constexpr std::array kContacts_N_m{1e3, 1e4, 1e5};
/// The output with its arm; the last is that of the data sheet.
constexpr std::array kInertias_kg_m2{1e-5, 1e-4, 5e-4};

constexpr PaperFigure kPrintedReduction =
    paper_figure("002", "section IV-B", "with against without clutch", "force reduction");

struct Drop {
  double arm_m;
  double link_m;
  double contact_N_m;
  double inertia_kg_m2;
};

/// The first contact.
struct Impact {
  double largest_N = 0.0;  ///< between mass and arm
  double twist_rad = 0.0;  ///< largest of the rubber
};

/// A pendulum whose mass meets the end of an arm at the vertical, until they part or the arm has turned away:
///
///     F = max(0, k d + c d'),   d = l sin(phi) - a sin(q)
///     m l^2 phi'' = -m g l sin(phi) - F l cos(phi),   J q'' = tau + F a cos(q)
Impact drop(const DataSheet& sheet, const Drop& of, double duration_s) {
  TurnedSensor sensor(sheet, kDropStep_s, of.inertia_kg_m2);
  const double damping_Ns_m = kContactDamping * 2.0 * std::sqrt(of.contact_N_m * kMass_kg);
  double angle_rad = 0.0;
  double speed_rad_s = std::sqrt(2.0 * kGravity_m_s2 / of.link_m);  // a quarter turn from rest
  Impact impact;
  const auto steps = static_cast<std::size_t>(duration_s / kDropStep_s);
  for (std::size_t n = 0; n < steps; ++n) {
    const double arm_rad = sensor.output_rad();
    const double depth_m = of.link_m * std::sin(angle_rad) - of.arm_m * std::sin(arm_rad);
    const double rate_m_s = of.link_m * speed_rad_s * std::cos(angle_rad) -
                            of.arm_m * sensor.output_speed_rad_s() * std::cos(arm_rad);
    if (depth_m < 0.0 || std::abs(arm_rad) > kPassed_rad) break;
    const double force_N = std::max(0.0, of.contact_N_m * depth_m + damping_Ns_m * rate_m_s);
    impact.largest_N = std::max(impact.largest_N, force_N);
    impact.twist_rad = std::max(impact.twist_rad, std::abs(sensor.twist_rad()));
    sensor.step(0.0, force_N * of.arm_m * std::cos(arm_rad));
    speed_rad_s -=
        kDropStep_s *
        (kGravity_m_s2 * std::sin(angle_rad) + force_N * std::cos(angle_rad) / kMass_kg) /
        of.link_m;
    angle_rad += kDropStep_s * speed_rad_s;
  }
  return impact;
}

/// One value for each case.
struct Impacts {
  std::vector<double> with_N;
  std::vector<double> without_N;
  std::vector<double> reduction_percent;
  std::vector<double> twist_rad;

  void add(const Impact& clutched, const Impact& fixed) {
    with_N.push_back(clutched.largest_N);
    without_N.push_back(fixed.largest_N);
    reduction_percent.push_back(100.0 * (1.0 - clutched.largest_N / fixed.largest_N));
    twist_rad.push_back(fixed.twist_rad);
  }
};

void add_rows(QuantityTable& table, const std::string& condition, const Impacts& impacts) {
  using Published = std::optional<PaperFigure>;
  const auto row = [&](const char* quantity, const std::vector<double>& values, const char* unit,
                       const Published& published = {}) {
    const auto [lowest, highest] = std::ranges::minmax(values);
    for (const auto& [end, value] : {std::pair("lowest", lowest), {"highest", highest}})
      table.rows.push_back({.condition = condition,
                            .quantity = fmt::format("{}, {}", quantity, end),
                            .value = value,
                            .unit = unit,
                            .published = published});
  };
  row("largest force with the clutch", impacts.with_N, "N",
      paper_figure("002", "Fig. 10", "with clutch", "peak force"));
  row("largest force without", impacts.without_N, "N",
      paper_figure("002", "Fig. 10", "without clutch", "peak force"));
  row("reduction of the largest force", impacts.reduction_percent, "%", kPrintedReduction);
  row("largest twist of the rubber without the clutch", impacts.twist_rad, "rad");
  const std::size_t cases = impacts.reduction_percent.size();
  const auto as_printed =
      static_cast<std::size_t>(std::ranges::count_if(impacts.reduction_percent, [](double percent) {
        return percent >= kPrintedReduction.value;
      }));
  table.rows.push_back(
      {.condition = condition,
       .quantity = "cases with the printed reduction or more",
       .value = 100.0 * static_cast<double>(as_printed) / static_cast<double>(cases),
       .unit = "%",
       .remark = fmt::format("{} of {}", as_printed, cases)});
}

}  // namespace

Study drop_002(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "the input of the sensor is fixed; 2.5 kg on a link fall from the horizontal and strike "
          "an arm "
          "at its output when the link is vertical; arms of 40 to 80 mm, links of 100 to 300 mm, "
          "contacts of 1 to 100 N/mm and outputs of 1e-5 to 5e-4 kg m2, none of which is printed; "
          "rubber and clutch by the equations of section II, and the same without a clutch; the "
          "first "
          "contact, until mass and arm part or the arm has turned by 1.2 rad",
      .unit = "N",
      .options = options,
      .plants = {study_plant("rubber-clutch:designed")}};
  const DataSheet with = data_sheet("rubber-clutch:designed");
  DataSheet without = with;
  std::get<ClutchSheet>(without.first).static_torque_Nm =
      std::get<ClutchSheet>(data_sheet("rubber-clutch:no-clutch").first).static_torque_Nm;
  const double duration_s = options.is_quick ? kQuickDuration_s : kDuration_s;
  Impacts all;
  std::vector<Impacts> by_contact(kContacts_N_m.size());
  for (std::size_t a = 0; a < kArms_m.size(); ++a)
    for (const double link_m : kLinks_m)
      for (std::size_t c = 0; c < kContacts_N_m.size(); ++c)
        for (const double inertia_kg_m2 : kInertias_kg_m2) {
          report_progress(progress, static_cast<double>(a) / static_cast<double>(kArms_m.size()),
                          "drops");
          const Drop of{kArms_m[a], link_m, kContacts_N_m[c], inertia_kg_m2};
          const Impact clutched = drop(with, of, duration_s);
          const Impact fixed = drop(without, of, duration_s);
          all.add(clutched, fixed);
          by_contact[c].add(clutched, fixed);
        }
  QuantityTable table;
  add_rows(table, "all", all);
  for (std::size_t c = 0; c < kContacts_N_m.size(); ++c)
    add_rows(table, fmt::format("contact of {:g} N/mm", 1e-3 * kContacts_N_m[c]), by_contact[c]);
  study.table = std::move(table);
  study.notes.emplace_back(
      "The rubber is linear in the twist here, also far beyond the 15 deg for which it was "
      "designed. Seed and "
      "repeats have no effect.");
  return study;
}

}  // namespace torsio
