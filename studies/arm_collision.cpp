#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "arm_collision_run.hpp"
#include "core/report_progress.hpp"
#include "numerics/shared_progress.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/sim/contacts/learn_contacts.hpp"

namespace torsio {
namespace {

constexpr double kCollisionHours = 1.0;
constexpr double kQuickCollisionHours = 0.05;
constexpr std::array kCollisionPayloads_kg{0.0, 3.0, 8.0};
constexpr std::array kPlates_kg{0.0, 4.4};
constexpr std::array kDirections{"outwards", "sideways", "down"};
constexpr std::array kCompared{ContactReaction::none, ContactReaction::stop,
                               ContactReaction::floating, ContactReaction::retract};
constexpr double kRigidFactor = 300.0;
constexpr double kWantedPeak = 0.6;  // over that with stiff springs, without payload
constexpr double kWithoutForce_N = 0.5;

void add_reaction(QuantityTable& table, const std::string& condition, const ArmRun& run,
                  ContactReaction reaction) {
  const ArmImpact& impact = *run.impact;
  const auto row = [&](const char* quantity, double value, std::string remark) {
    table.rows.push_back({.condition = condition,
                          .quantity = fmt::format("{}: {}", name(reaction), quantity),
                          .value = value,
                          .unit = "N",
                          .remark = std::move(remark)});
  };
  std::string found = "not found";
  if (!run.contacts.empty())
    found = fmt::format("found in {} after {:.0f} ms", run.contacts.front().joint,
                        1e3 * run.contacts.front().latency_s.value_or(kNotMeasured));
  row("first peak", impact.first_peak_N, found);
  const double late_N = impact.largest_late_N.value_or(kNotMeasured);
  std::string remark;
  if (reaction == ContactReaction::retract)
    remark = fmt::format("wanted 0: {}", late_N < kWithoutForce_N ? "met" : "missed");
  else if (run.cause != ArmStopCause::none)
    remark = fmt::format("stopped by {} in {}", name(run.cause), run.stopped_joint);
  row("largest force later than 80 ms", late_N, remark);
  row("force after 0.5 s", impact.rest_N.value_or(kNotMeasured),
      impact.rest_N ? "" : "the run ended before");
}

void add_stiffness(QuantityTable& table, const std::string& condition,
                   const ArmCollision& collision) {
  const double elastic_N = first_peak(collision, 1.0);
  const double stiff_N = first_peak(collision, kRigidFactor);
  const double ratio = elastic_N / stiff_N;
  table.rows.push_back(
      {.condition = condition,
       .quantity = "first peak, springs 300 times as stiff",
       .value = stiff_N,
       .unit = "N",
       .remark = fmt::format("its own springs under the same loop: {:.0f} N", elastic_N)});
  std::string remark;
  if (collision.payload_kg == 0.0)
    remark = fmt::format("wanted at most {:g}: {}", kWantedPeak,
                         ratio <= kWantedPeak ? "met" : "missed");
  table.rows.push_back({.condition = condition,
                        .quantity = "first peak over that of stiff springs",
                        .value = ratio,
                        .unit = "-",
                        .remark = std::move(remark)});
}

}  // namespace

Study arm_collision(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "the flange of an arm of six elastic joints hits a plate of 75 N/mm at 0.5 m/s from a "
          "bent pose, outwards, sideways and down; the plate is clamped or moves with 4.4 kg. "
          "Thresholds of contacts are learned from motion with the same payload, the springs being "
          "straight lines of the data sheet. Springs 300 times as stiff are compared under a "
          "proportional and derivative loop on the rotors",
      .unit = "N",
      .options = options};
  const double hours = options.is_quick ? kQuickCollisionHours : kCollisionHours;
  QuantityTable table;
  const double width = 1.0 / static_cast<double>(kCollisionPayloads_kg.size());
  for (std::size_t p = 0; p < kCollisionPayloads_kg.size(); ++p) {
    const double payload_kg = kCollisionPayloads_kg[p];
    const double first = width * static_cast<double>(p);
    const LearnedContacts learned =
        learn_contacts(collision_setup(payload_kg), {.hours = hours, .seed = options.seed},
                       share_of(progress, first, first + 0.8 * width));
    for (const double plate_kg : kPlates_kg) {
      for (std::size_t axis = 0; axis < kDirections.size(); ++axis) {
        report_progress(progress, first + 0.9 * width, "collisions");
        const std::string condition =
            fmt::format("{:g} kg, {}, {}", payload_kg, plate_kg == 0.0 ? "clamped" : "free plate",
                        kDirections[axis]);
        ArmCollision collision{.axis = axis,
                               .payload_kg = payload_kg,
                               .plate_kg = plate_kg,
                               .contacts = learned.file.settings(),
                               .seed = options.seed};
        for (const ContactReaction reaction : kCompared) {
          collision.reaction = reaction;
          add_reaction(table, condition, collide(collision), reaction);
        }
        add_stiffness(table, condition, collision);
      }
    }
  }
  study.table = std::move(table);
  for (const char* actuator : {"dfki-300", "dfki-120", "dfki-28"})
    study.plants.push_back(study_plant(actuator));
  study.notes.push_back(
      fmt::format("{:g} h of motion per payload for the thresholds. Without a reaction the arm is "
                  "stopped where the "
                  "external torque of a joint exceeds its rating for 20 ms.",
                  hours));
  return study;
}

}  // namespace torsio
