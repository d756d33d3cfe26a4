#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "paper_figures.hpp"
#include "studies.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/clutch.hpp"
#include "torsio/design/rubber_spring.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {
namespace {

/// The demand of 002 section II-B.
RubberSpringDemand demand_002() {
  return {.torque_Nm = 0.5,
          .angle_rad = rad_from_deg(15.0),
          .shear_modulus_Pa = shear_modulus_of_hardness(60.0)};
}

constexpr RubberRing kPublishedRing{0.010, 0.0082, 0.004};

void add(QuantityTable& table, const char* condition, const char* quantity, double value,
         const char* unit, std::optional<PaperFigure> published = {},
         const std::string& remark = {}) {
  table.rows.push_back({condition, quantity, value, unit, published, remark});
}

/// The claims of the abstract: the sensor of the paper against the best of the others in Table I.
void add_reductions(QuantityTable& table) {
  constexpr std::string_view kProposed = "Proposed";
  double least_cm3_Nm = std::numeric_limits<double>::infinity();
  double least_g = std::numeric_limits<double>::infinity();
  const auto sensors = torque_sensors_002();
  const auto proposed = std::ranges::find(sensors, kProposed, &PublishedTorqueSensor::name);
  for (const PublishedTorqueSensor& sensor : sensors) {
    if (sensor.name == kProposed) continue;
    // Comparisons with NaN, for what is not printed, are false.
    const double ratio_cm3_Nm = sensor.volume_cm3 / sensor.torque_Nm;
    if (ratio_cm3_Nm < least_cm3_Nm) least_cm3_Nm = ratio_cm3_Nm;
    if (sensor.weight_g < least_g) least_g = sensor.weight_g;
  }
  constexpr const char* kAgainst = "against state of the art";
  const double ratio_cm3_Nm = proposed->volume_cm3 / proposed->torque_Nm;
  add(table, "Table I", "volume per torque below the least of the others by",
      100.0 * (1.0 - ratio_cm3_Nm / least_cm3_Nm), "%",
      paper_figure("002", "section V", kAgainst, "volume per torque reduction"));
  add(table, "Table I", "weight below the least of the others by",
      100.0 * (1.0 - proposed->weight_g / least_g), "%",
      paper_figure("002", "section V", kAgainst, "weight reduction"));
}

}  // namespace

Study design_002(const StudyOptions& options, const Progress& /*progress*/) {
  Study study{.protocol =
                  "the ring of rubber of section II-B by (1) to (4), the clutch by (5), "
                  "computed from the printed demands",
              .unit = "",
              .options = options};
  QuantityTable table;
  const RubberSpringDemand demand = demand_002();
  const RubberSpringDesign design = design_rubber_spring(demand);
  add(table, "optimum", "outer radius", design.exact.outer_m * 1e3, "mm",
      paper_figure("002", "section II-B", "optimised ring", "outer radius"));
  add(table, "optimum", "inner radius", design.exact.inner_m * 1e3, "mm",
      paper_figure("002", "section II-B", "optimised ring", "inner radius"));
  add(table, "optimum", "length", design.exact.length_m * 1e3, "mm",
      paper_figure("002", "section II-B", "optimised ring", "length"));
  add(table, "optimum", "objective", design.objective, "mm^3/Nm and mm");
  add(table, "printed ring", "objective", objective(kPublishedRing, demand), "mm^3/Nm and mm");
  add(table, "printed ring", "stiffness", stiffness(kPublishedRing, demand.shear_modulus_Pa),
      "Nm/rad", {}, "0.5 Nm over 15 deg is 1.910 Nm/rad");
  add(table, "printed ring", "shear stress", shear_stress(kPublishedRing, 0.5) * 1e-6, "MPa");
  ClutchDemand clutch;
  clutch.washer = read_washers({}).front();
  const DesignReport report = design_clutch(clutch);
  add(table, "clutch of 0.5 Nm", "axial force", report.at("clutch", "axial_force").value, "N",
      paper_figure("002", "section II-C", "clutch", "axial force"));
  add(table, "clutch of 0.5 Nm", "force at flat", report.at("washers", "force_at_flat").value, "N",
      paper_figure("002", "section II-C", "washer", "force at flat"));
  add(table, "clutch of 0.5 Nm", "torque at flat", report.at("clutch", "torque_at_flat").value,
      "Nm");
  for (const PaperFigure& printed : kPaperFigures) {
    if (printed.paper != "002" || printed.item != "Table I") continue;
    const auto sensors = torque_sensors_002();
    const auto sensor = std::ranges::find(sensors, printed.condition, &PublishedTorqueSensor::name);
    table.rows.push_back({"Table I", fmt::format("volume per torque, {}", printed.condition),
                          sensor->volume_cm3 / sensor->torque_Nm, "cm3/Nm", printed});
  }
  add_reductions(table);
  table.rows.push_back({"Table I",
                        "volume per torque, ring of the optimum",
                        sensor_volume_cm3(design.rounded) / demand.torque_Nm,
                        "cm3/Nm",
                        {},
                        "in the housing of 002"});
  study.table = std::move(table);
  study.notes.emplace_back(
      "The printed ring is the optimum with r2 rounded down to 0.1 mm. The multipliers of the "
      "bounds "
      "are those of torsio design rubber-spring. The objective has no printed unit; mm^3/Nm and mm "
      "are assumed, and have no influence while the stress is not reached.");
  study.notes.emplace_back(
      "Cone height and modulus of the washer are assumed: h0 = 0.3502 mm gives the printed 699 N, "
      "so that this row proves nothing. Seed and repeats have no effect.");
  return study;
}

}  // namespace torsio
