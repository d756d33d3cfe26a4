#include "sim/sensors/truth_channels.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string_view>
#include <utility>
#include <variant>

#include "torsio/core/dispatch.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {
namespace {

struct PartNames {
  std::string_view first;
  std::string_view middle;  ///< the body between the stages
  std::string_view second;
};

PartNames part_names(ActuatorFamily family) {
  switch (family) {
    case ActuatorFamily::series_elastic: break;
    case ActuatorFamily::elastomer: return {"gear", "gear", "coupling"};
    case ActuatorFamily::rubber_clutch: return {"clutch", "clutch_output", "rubber"};
    case ActuatorFamily::harmonic_drive: return {"tube", "wave_generator", "gear"};
  }
  return {"gear", "gear", "spring"};
}

/// Collects the channels of one plant.
class TruthWriter {
 public:
  using Value = std::function<double(const BenchTruth&)>;

  void add(std::string_view part, std::string_view what, Value value) {
    const std::string_view joint = part.empty() ? "" : "_";
    channels_.push_back(
        {fmt::format("{}{}{}{}", kTruthPrefix, part, joint, what), std::move(value)});
  }
  /// One channel for each number of an array: `what` holds its place, from 1.
  template <class Array>
  void write_each(std::string_view part, std::string_view what, Array (*values)(const Plant&)) {
    for (std::size_t i = 0; i < std::tuple_size_v<Array>; ++i) {
      add(part, fmt::format(fmt::runtime(what), i + 1),
          [=](const BenchTruth& truth) { return values(truth.plant)[i]; });
    }
  }
  std::vector<TruthChannel> channels() && { return std::move(channels_); }

 private:
  std::vector<TruthChannel> channels_;
};

template <class Stage>
const Stage& second(const Plant& plant) {
  return std::get<Stage>(plant.second());
}

void write_stages(TruthWriter& to, const PartNames& names) {
  to.add(names.second, "torque_Nm",
         [](const BenchTruth& t) { return t.plant.torques().second_Nm; });
  to.add(names.second, "friction_Nm",
         [](const BenchTruth& t) { return t.plant.second_friction_torque(); });
  to.add(names.second, "deflection_rad",
         [](const BenchTruth& t) { return t.plant.second_twist(); });
  to.add(names.first, "torque_Nm", [](const BenchTruth& t) { return t.plant.torques().first_Nm; });
  to.add(names.first, "friction_Nm",
         [](const BenchTruth& t) { return t.plant.first_friction_torque(); });
  to.add(names.first, "deflection_rad", [](const BenchTruth& t) { return t.plant.first_twist(); });
}

void write_bodies(TruthWriter& to, const PartNames& names) {
  to.add("motor", "torque_Nm", [](const BenchTruth& t) { return t.plant.torques().motor_Nm; });
  to.add("motor", "current_A", [](const BenchTruth& t) { return t.plant.current(); });
  to.add("motor", "angle_rad", [](const BenchTruth& t) { return t.plant.state().rotor_angle_rad; });
  to.add("motor", "speed_rad_s",
         [](const BenchTruth& t) { return t.plant.state().rotor_speed_rad_s; });
  to.add(names.middle, "angle_rad",
         [](const BenchTruth& t) { return t.plant.state().middle_angle_rad; });
  to.add(names.middle, "speed_rad_s",
         [](const BenchTruth& t) { return t.plant.state().middle_speed_rad_s; });
  to.add("joint", "angle_rad", [](const BenchTruth& t) { return t.plant.state().joint_angle_rad; });
  to.add("joint", "speed_rad_s",
         [](const BenchTruth& t) { return t.plant.state().joint_speed_rad_s; });
}

/// The friction of a body against the frame, and its share that is in the bristle.
void write_friction(TruthWriter& to, std::string_view place, const LuGreFriction::Parameters& parts,
                    double PlantTorques::*friction,
                    const LuGreFriction& (Plant::*block)() const noexcept) {
  if (parts.coulomb_Nm == 0.0 && parts.viscous_Nms_rad == 0.0) return;
  to.add(place, "friction_Nm", [=](const BenchTruth& t) { return t.plant.torques().*friction; });
  if (parts.coulomb_Nm == 0.0) return;
  to.add(place, "bristle_Nm",
         [=](const BenchTruth& t) { return (t.plant.*block)().bristle_torque(); });
}

void write_frictions(TruthWriter& to, const PartNames& names, const PlantParameters& parts) {
  write_friction(to, "motor", parts.rotor_friction, &PlantTorques::rotor_friction_Nm,
                 &Plant::rotor_friction);
  write_friction(to, names.middle, parts.middle_friction, &PlantTorques::middle_friction_Nm,
                 &Plant::middle_friction);
  write_friction(to, "bearing", parts.bearing, &PlantTorques::bearing_Nm, &Plant::bearing);
}

void write_clutch(TruthWriter& to) {
  const auto clutch = [](const BenchTruth& t) -> const SlipClutch& {
    return std::get<SlipClutch>(t.plant.first());
  };
  to.add("clutch", "slip_rad", [=](const BenchTruth& t) { return clutch(t).slip(); });
  to.add("clutch", "is_slipping_1",
         [=](const BenchTruth& t) { return clutch(t).is_slipping() ? 1.0 : 0.0; });
}

void write_coupling(TruthWriter& to, bool is_bonded) {
  to.write_each(
      "coupling", is_bonded ? "creep{}_rad" : "positive_creep{}_rad", +[](const Plant& p) {
        return second<ElastomerCoupling>(p).creep(ElastomerCoupling::Side::positive);
      });
  if (!is_bonded) {
    to.write_each(
        "coupling", "negative_creep{}_rad", +[](const Plant& p) {
          return second<ElastomerCoupling>(p).creep(ElastomerCoupling::Side::negative);
        });
  }
  to.write_each(
      "coupling", "slip{}_Nm",
      +[](const Plant& p) { return second<ElastomerCoupling>(p).slip().forces(); });
  to.add("coupling", "glue_1",
         [](const BenchTruth& t) { return second<ElastomerCoupling>(t.plant).glue(); });
}

void write_rubber(TruthWriter& to) {
  to.write_each(
      "rubber", "branch{}_Nm",
      +[](const Plant& p) { return second<RubberSpring>(p).branches().forces(); });
  to.write_each(
      "rubber", "slip{}_Nm",
      +[](const Plant& p) { return second<RubberSpring>(p).slip().forces(); });
}

void write_drive(TruthWriter& to) {
  to.add("d_axis", "current_A",
         [](const BenchTruth& t) { return t.plant.electrical()->direct_current(); });
  to.add("copper", "temperature_K",
         [](const BenchTruth& t) { return t.plant.electrical()->copper_K(); });
}

}  // namespace

std::vector<TruthChannel> truth_channels(const DataSheet& sheet, bool is_electrical) {
  const PartNames names = part_names(sheet.family);
  const PlantParameters parts = plant_parameters(sheet);
  TruthWriter to;
  to.add("", "torque_Nm", [](const BenchTruth& t) { return t.load_cell_Nm; });
  write_stages(to, names);
  write_bodies(to, names);
  write_frictions(to, names, parts);
  if (std::holds_alternative<SlipClutch::Parameters>(parts.first)) write_clutch(to);
  if (const auto* coupling = std::get_if<ElastomerCoupling::Parameters>(&parts.second))
    write_coupling(to, coupling->bonded);
  if (std::holds_alternative<RubberSpring::Parameters>(parts.second)) write_rubber(to);
  // One bristle, or one Bouc-Wen element, is the friction channel itself; four slip elements are not.
  if (const auto* spring = std::get_if<Spring::Parameters>(&parts.second);
      spring != nullptr && std::holds_alternative<MaxwellSlip<4>::Parameters>(spring->friction)) {
    to.write_each(
        "spring", "slip{}_Nm", +[](const Plant& p) {
          return std::get<MaxwellSlip<4>>(second<Spring>(p).friction()).forces();
        });
  }
  if (is_electrical) write_drive(to);
  to.add("", "temperature_K", [](const BenchTruth& t) { return t.temperature_K; });
  return std::move(to).channels();
}

}  // namespace torsio
