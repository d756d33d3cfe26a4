#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

struct PrintedFact {
  std::string_view actuator;
  std::string_view name;
  std::string_view unit;
  double value;
};

// 000, Tables 1 and 2 and section 6.2; 002, Table I and section II-A; 003, Table 1 and section 2; 004, sections II
// and 2.2 and Table 1, whose constant efficiencies and motor damping are friction in the plant.
constexpr auto kFacts = std::to_array<PrintedFact>({
    {"dfki-28", "rated_speed", "rad/s", rad_from_deg(190.0)},
    {"dfki-28", "motor_power", "W", 140.0},
    {"dfki-28", "mass", "kg", 0.9},
    {"dfki-50", "rated_speed", "rad/s", rad_from_deg(106.0)},
    {"dfki-50", "motor_power", "W", 145.0},
    {"dfki-50", "mass", "kg", 2.5},
    {"dfki-120", "rated_speed", "rad/s", rad_from_deg(66.0)},
    {"dfki-120", "motor_power", "W", 370.0},
    {"dfki-120", "mass", "kg", 3.9},
    {"dfki-300", "rated_speed", "rad/s", rad_from_deg(41.0)},
    {"dfki-300", "motor_power", "W", 580.0},
    {"dfki-300", "mass", "kg", 4.6},
    {"elastomer", "largest_torque", "Nm", 15.0},
    {"elastomer", "length", "m", 0.09},
    {"elastomer", "diameter", "m", 0.052},
    {"elastomer", "mass", "kg", 0.39},
    {"elastomer", "power_per_mass", "W/kg", 170.0},
    {"elastomer", "possible_power_per_mass", "W/kg", 400.0},
    {"elastomer", "electronics_supply", "V", 40.0},
    {"elastomer", "electronics_current", "A", 69.0},
    {"rubber-clutch", "length", "m", 0.0295},
    {"rubber-clutch", "width", "m", 0.018},
    {"rubber-clutch", "height", "m", 0.024},
    {"rubber-clutch", "mass", "kg", 0.023},
    {"harmonic-drive", "length", "m", 0.165},
    {"harmonic-drive", "width", "m", 0.176},
    {"harmonic-drive", "height", "m", 0.121},
    {"harmonic-drive", "mass", "kg", 5.8},
    {"harmonic-drive", "tube_mass", "kg", 0.425},
    {"harmonic-drive", "motor_damping", "Nms/rad", 0.0},
    {"harmonic-drive", "motor_efficiency", "", 1.0},
    {"harmonic-drive", "gear_efficiency", "", 0.5},
});

}  // namespace

std::vector<SheetRow> printed_facts(const DataSheet& sheet) {
  std::vector<SheetRow> rows;
  for (const PrintedFact& fact : kFacts)
    if (fact.actuator == sheet.name)
      rows.push_back({std::string(fact.name), fact.unit, printed(fact.value)});
  return rows;
}

}  // namespace torsio
