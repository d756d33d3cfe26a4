#include "torsio/joint_load/known_load.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "joint_load/load_fact.hpp"
#include "joint_load/urdf_load.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// A fact in one recording.
struct Stated {
  std::string name;
  double value = 0.0;
  double standard_error = 0.0;
};

constexpr double kOpenEnd = 1e6;  ///< beyond every load of a joint

class FactReader {
 public:
  FactReader(const LoadSheet& sheet, const Recording& recording)
      : sheet_(sheet), recording_(recording) {}

  [[nodiscard]] Stated read(const std::string& name, const LoadFact& fact, double lowest,
                            double highest = kOpenEnd) const {
    const double value = fact_in(fact, recording_, sheet_.file, name);
    if (!(value >= lowest && value <= highest))
      throw Error({.place = fact.condition.empty()
                                ? fmt::format("{}: {}", sheet_.file, name)
                                : fmt::format("{}: {}", recording_.name(), fact.condition),
                   .expected = fmt::format("a {} of {:.4g} to {:.4g} in SI", name, lowest, highest),
                   .found = fmt::format("{:.6g}", value)});
    return {
        name, value,
        fact.relative_error > 0.0 ? fact.relative_error * std::abs(value) : fact.standard_error};
  }

 private:
  const LoadSheet& sheet_;
  const Recording& recording_;
};

using Values = std::vector<double>;

JointLoad pendulum(const Values& at) {
  const double mass_kg = at[0];
  const double length_m = at[1];
  const double arm_mass_kg = at[2];
  return {
      .gravity_Nm = (mass_kg + 0.5 * arm_mass_kg) * kLoadGravity_m_s2 * length_m * std::cos(at[3]),
      .inertia_kg_m2 = (mass_kg + arm_mass_kg / 3.0) * length_m * length_m,
      .zero_rad = 0.0};
}

/// The facts of a load and its load as their function.
struct LoadFunction {
  std::vector<Stated> facts;
  std::function<JointLoad(const Values&)> load;
};

LoadFunction function_of(const LoadSheet& sheet, const FactReader& read) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  if (const auto* const facts = std::get_if<PendulumFacts>(&sheet.facts))
    return {
        .facts = {read.read("mass", facts->mass_kg, 0.0), read.read("length", facts->length_m, 0.0),
                  read.read("arm_mass", facts->arm_mass_kg, 0.0),
                  read.read("inclination", facts->inclination_rad, -kQuarter, kQuarter)},
        .load = pendulum};
  const auto& facts = std::get<UrdfFacts>(sheet.facts);
  LoadFunction function{.facts = {}, .load = {}};
  function.facts.push_back(read.read("payload_mass", facts.payload_mass_kg, 0.0));
  function.load = [urdf = urdf_load(facts, sheet.file)](const Values& at) {
    return load_of(urdf, at[0]);
  };
  return function;
}

/// Half the difference of the loads at plus and minus one standard error.
JointLoad half_difference(const JointLoad& above, const JointLoad& below) {
  return {
      .gravity_Nm = 0.5 * (above.gravity_Nm - below.gravity_Nm),
      .inertia_kg_m2 = 0.5 * (above.inertia_kg_m2 - below.inertia_kg_m2),
      .zero_rad = 0.5 * std::remainder(above.zero_rad - below.zero_rad, 2.0 * std::numbers::pi)};
}

void require_load(const LoadSheet& sheet, const Recording& recording, const JointLoad& load) {
  if (load.gravity_Nm > 0.0 || load.inertia_kg_m2 > 0.0 || sheet.fits_joint_inertia) return;
  throw Error({.place = fmt::format("{}: {}", sheet.file, recording.name()),
               .expected = "a load with gravity or inertia",
               .found = "neither",
               .advice = "State the mass and the length of the load, or its joint_inertia."});
}

}  // namespace

KnownLoad known_load(const LoadSheet& sheet, const Recording& recording) {
  const FactReader read(sheet, recording);
  const LoadFunction function = function_of(sheet, read);
  const Stated inertia = read.read("joint_inertia", sheet.joint_inertia_kg_m2, 0.0);
  const Stated zero =
      read.read("zero", sheet.zero_rad, -2.0 * std::numbers::pi, 2.0 * std::numbers::pi);
  Values values;
  for (const Stated& fact : function.facts) values.push_back(fact.value);
  KnownLoad known{.load = function.load(values), .errors = {}};
  known.load.inertia_kg_m2 += inertia.value;
  known.load.zero_rad += zero.value;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Stated& fact = function.facts[i];
    if (!(fact.standard_error > 0.0)) continue;
    Values above = values;
    Values below = values;
    above[i] += fact.standard_error;
    below[i] -= fact.standard_error;
    known.errors.push_back(
        {fact.name, half_difference(function.load(above), function.load(below))});
  }
  if (inertia.standard_error > 0.0)
    known.errors.push_back({inertia.name, {.inertia_kg_m2 = inertia.standard_error}});
  if (zero.standard_error > 0.0)
    known.errors.push_back({zero.name, {.zero_rad = zero.standard_error}});
  require_load(sheet, recording, known.load);
  return known;
}

}  // namespace torsio
