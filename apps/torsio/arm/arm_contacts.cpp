#include <fmt/format.h>

#include <memory>
#include <string>

#include "arm/arm_source.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/contacts/learn_contacts.hpp"
#include "verbs.hpp"

void ArmSource::add(CLI::App& verb) {
  verb.add_option("ARM", arm,
                  "arm6, the arm of six joints of paper 000, or your own: FILE.yaml, which names a "
                  "URDF file and the actuator of each joint")
      ->capture_default_str();
  verb.add_option("--payload", payload, "mass in place of that of the arm's file: 3kg");
  verb.add_option("--tilt", tilt, "tilt of the base about its y axis: 30deg");
}

torsio::ArmSetup ArmSource::setup(const torsio::Progress& progress) const {
  torsio::ArmSetup setup = arm_of(arm, progress);
  if (!tilt.empty())
    setup.arm.gravity_m_s2 =
        torsio::tilted_gravity(torsio::signed_quantity_with_unit(tilt, "rad", "--tilt"));
  if (!payload.empty()) {
    // The centre of mass stays; the inertia is that of a body of the same shape.
    const double mass_kg = torsio::signed_quantity_with_unit(payload, "kg", "--payload");
    torsio::BodyInertia& body = setup.arm.payload;
    const double scale = body.mass_kg > 0.0 ? mass_kg / body.mass_kg : 0.0;
    for (double& moment : body.inertia_kg_m2) moment *= scale;
    body.mass_kg = mass_kg;
  }
  torsio::require_carriable(setup, payload.empty() ? arm : "--payload " + payload);
  return setup;
}

namespace {

struct LearnContactsFlags {
  ArmSource source;
  std::string output;
  torsio::ContactLearning learning;
};

std::string learned_text(const torsio::LearnedContacts& learned) {
  torsio::TextTable table;
  table.header({"joint", "external torque [Nm]", "largest error bar [Nm]", "mean (e/sigma)^2",
                "largest e/sigma", "k"});
  for (std::size_t j = 0; j < learned.joints.size(); ++j) {
    const torsio::LearnedContacts::Joint& of = learned.joints[j];
    const torsio::ContactsFile::Joint& joint = learned.file.joints[j];
    table.row({joint.name, fmt::format("{:.3f}", of.rmse_Nm),
               fmt::format("{:.2f}", of.largest_std_dev_Nm),
               fmt::format("{:.2f}", of.mean_variance_ratio),
               fmt::format("{:.2f}", of.largest_ratio),
               fmt::format("{:.2f}", joint.detector.factor)});
  }
  return fmt::format(
      "{}external torque: RMSE in motion without contacts; a contact is more than k error bars\n"
      "{:g} hours, chosen for {:.3g} false alarms per hour (at most {:.3g} with 95 % confidence if "
      "none occurs in these hours)\n",
      table.text(), learned.file.hours, learned.file.false_alarms_per_hour,
      learned.file.upper_bound_per_hour);
}

void run(const LearnContactsFlags& flags) {
  DataFlags().check_outputs(
      {flags.output}, {flags.source.arm == ArmSource::kReady ? std::string() : flags.source.arm});
  require_ending("--output", flags.output, {".json"});
  require_writable(flags.output);
  ProgressBar progress;
  const torsio::ArmSetup setup = flags.source.setup(progress.listener());
  const torsio::LearnedContacts learned =
      torsio::learn_contacts(setup, flags.learning, progress.listener());
  torsio::save_contacts(flags.output, learned.file);
  print(learned_text(learned));
}

}  // namespace

void add_learn_contacts(CLI::App& arm) {
  auto flags = std::make_shared<LearnContactsFlags>();
  CLI::App* verb = arm.add_subcommand(
      "learn-contacts", "move the simulated arm at random, and learn from it what is a contact");
  verb->footer(
      "Example: torsio arm learn-contacts --hours 1 -o contacts.json\n"
      "         torsio arm --contacts contacts.json --program pushes.yaml\n"
      "docs/robot/contacts.md has the method and the file.");
  flags->source.add(*verb);
  verb->add_option("-o,--output", flags->output, "file of the thresholds: contacts.json")
      ->required();
  verb->add_option("--hours", flags->learning.hours, "of motion, 0.02 to 1000")
      ->capture_default_str();
  verb->add_option("--false-alarms-per-hour", flags->learning.false_alarms_per_hour,
                   "wanted rate (default: 3 / hours, the lowest that the hours support)");
  add_seed(*verb, flags->learning.seed, "seed of moves and noise");
  verb->add_flag("--gear-stage", flags->learning.has_gear_stage,
                 "with the elasticity of the gears: slower");
  verb->callback([flags] { run(*flags); });
}
