#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "arm/arm_identify_links.hpp"
#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/identify/identify_payload.hpp"
#include "torsio/report/text_table.hpp"

namespace {

using IdentifyJson = nlohmann::ordered_json;

struct IdentifyFlags {
  std::string arm = kReadyArm;
  std::vector<std::string> recordings;
  std::string tilt;
  std::string window;
  std::string links_com;
  std::optional<double> torque_within_percent = {};
  double links_within_percent = 0.0;
  bool has_links = false;
  std::vector<std::string> tests;
  std::string output;
  JsonOutput json;
};

// Assumed of the links with `--links`.
constexpr double kLinkShare = 0.1;
constexpr double kLinkCom_m = 0.01;

// How wrong the torque of a joint may be as a whole.
constexpr double kLinearPercent = 3.0;
constexpr double kLearnedPercent = 1.0;

constexpr std::array kInertiaNames{"xx", "yy", "zz", "xy", "xz", "yz"};

std::vector<torsio::ArmMotion> motions_of(const std::vector<std::string>& files,
                                          const torsio::ArmModel& arm,
                                          const torsio::Progress& progress) {
  std::vector<torsio::ArmMotion> motions;
  for (const std::string& file : files) {
    torsio::LoadOptions options;
    options.progress = progress;
    const std::vector<torsio::Recording> recordings = torsio::load_recordings(file, options);
    for (const torsio::Recording& recording : recordings) {
      DataFlags::remark_on_reading(std::array{&recording});
      motions.push_back(torsio::arm_motion(recording, arm));
      motions.back().name = file;
    }
  }
  return motions;
}

/// Whether the torque is that of the linear spring of the data sheet.
bool has_linear_spring(const torsio::ArmJointSetup& joint) {
  return joint.model.empty() && joint.monitor.empty();
}

torsio::IdentificationOptions options_of(const IdentifyFlags& flags,
                                         const torsio::ArmSetup& setup) {
  const bool has_linear = std::ranges::any_of(setup.joints, &has_linear_spring);
  const double torque_percent =
      flags.torque_within_percent.value_or(has_linear ? kLinearPercent : kLearnedPercent);
  torsio::IdentificationOptions options{.torque_scale_share = 0.01 * torque_percent,
                                        .torque_floor_share = 0.002 * torque_percent,
                                        .link_share = 0.01 * flags.links_within_percent};
  if (!flags.links_com.empty())
    options.link_com_m = torsio::signed_quantity_with_unit(flags.links_com, "m", "--links-com");
  if (!flags.window.empty())
    options.window_s = torsio::signed_quantity_with_unit(flags.window, "s", "--window");
  // A model that was trained with a load cell contains the friction of the bearing.
  for (const torsio::ArmJointSetup& joint : setup.joints) {
    options.dry_Nm.push_back(has_linear_spring(joint) ? joint.sheet.joint.bearing_friction_Nm.value
                                                      : 0.0);
    options.viscous_Nms_rad.push_back(
        has_linear_spring(joint) ? joint.sheet.joint.viscous_Nms_rad.value : 0.0);
  }
  return options;
}

void add_row(torsio::TextTable& table, const std::string& quantity, const std::string& unit,
             const torsio::IdentifiedQuantity& of, double scale, int decimals) {
  table.row({quantity, of.is_determined ? torsio::fixed_text(scale * of.value, decimals) : "-",
             of.is_determined ? torsio::fixed_text(scale * of.standard_error, decimals) : "-", unit,
             of.reason});
}

std::string payload_text(const torsio::IdentifiedPayload& found) {
  torsio::TextTable table;
  table.header({"payload", "value", "standard error", "unit", "not determined, since"});
  add_row(table, "mass", "kg", found.mass_kg, 1.0, 3);
  for (std::size_t i = 0; i < 3; ++i)
    add_row(table, fmt::format("centre of mass, {}", "xyz"[i]), "mm", found.com_m[i], 1e3, 1);
  for (std::size_t i = 0; i < kInertiaNames.size(); ++i)
    add_row(table, fmt::format("inertia, {}", kInertiaNames[i]), "kg m2", found.inertia_kg_m2[i],
            1.0, 4);
  torsio::TextTable joints;
  joints.header({"joint", "residual [Nm]", "dry friction [Nm]", "viscous friction [Nms/rad]"});
  const auto with_error = [](const torsio::IdentifiedQuantity& of) {
    return fmt::format("{:.3f} +- {:.3f}", of.value, of.standard_error);
  };
  for (const torsio::IdentifiedJoint& joint : found.joints)
    joints.row({joint.name, fmt::format("{:.3f}", joint.residual_Nm), with_error(joint.dry_Nm),
                with_error(joint.viscous_Nms_rad)});
  return fmt::format(
      "{}\n{}{} windows of {:g} s; standard errors from {} blocks of {:.3g} s; centre of mass and "
      "inertia in the frame of the flange, the inertia about the centre of mass\n",
      table.text(), joints.text(), found.data.windows, found.data.window_s, found.data.blocks,
      found.data.block_s);
}

/// The line of the arm's YAML file.
std::string payload_line(const torsio::BodyInertia& body) {
  std::string line = fmt::format(
      "payload: {{mass: {:.4g}kg, center_of_mass: [{:.2f}mm, {:.2f}mm, "
      "{:.2f}mm]",
      body.mass_kg, 1e3 * body.com_m[0], 1e3 * body.com_m[1], 1e3 * body.com_m[2]);
  bool has_inertia = false;
  std::vector<std::string> inertia;
  inertia.reserve(body.inertia_kg_m2.size());
  for (const double moment : body.inertia_kg_m2) {
    has_inertia = has_inertia || moment != 0.0;
    inertia.push_back(fmt::format("{:.5f}", moment));
  }
  if (has_inertia) line += fmt::format(", inertia_kg_m2: [{}]", fmt::join(inertia, ", "));
  return line + "}\n";
}

IdentifyJson quantity_json(const torsio::IdentifiedQuantity& of) {
  IdentifyJson json{{"value", of.value},
                    {"standard_error", of.standard_error},
                    {"is_determined", of.is_determined}};
  if (!of.is_determined) json["reason"] = of.reason;
  return json;
}

IdentifyJson identified_json(const IdentifyFlags& flags, const torsio::IdentifiedPayload& found) {
  IdentifyJson document{{"arm", flags.arm},
                        {"recordings", flags.recordings},
                        {"duration_s", found.data.duration_s},
                        {"windows", found.data.windows},
                        {"blocks", found.data.blocks},
                        {"block_s", found.data.block_s},
                        {"mass_kg", quantity_json(found.mass_kg)},
                        {"center_of_mass_m", IdentifyJson::array()},
                        {"inertia_kg_m2", IdentifyJson::object()},
                        {"joints", IdentifyJson::array()}};
  for (const torsio::IdentifiedQuantity& com : found.com_m)
    document["center_of_mass_m"].push_back(quantity_json(com));
  for (std::size_t i = 0; i < kInertiaNames.size(); ++i)
    document["inertia_kg_m2"][kInertiaNames[i]] = quantity_json(found.inertia_kg_m2[i]);
  for (const torsio::IdentifiedJoint& joint : found.joints)
    document["joints"].push_back({{"joint", joint.name},
                                  {"residual_Nm", joint.residual_Nm},
                                  {"dry_Nm", quantity_json(joint.dry_Nm)},
                                  {"viscous_Nms_rad", quantity_json(joint.viscous_Nms_rad)}});
  return document;
}

/// A torque with the wrong sign, unit or joint fits no payload.
constexpr double kPlausibleShare = 0.1;  // residual over the largest torque of a joint
constexpr double kSurely = 3.0;          // standard errors
constexpr double kSmallShare =
    0.05;  // share of the mass of all links, by which linear springs may err

/// @throws Error if the mass is negative
void require_plausible(const torsio::ArmSetup& setup, const torsio::IdentifiedPayload& found) {
  const torsio::IdentifiedQuantity& mass = found.mass_kg;
  double links_kg = 0.0;
  for (const torsio::ArmJoint& joint : setup.arm.joints) links_kg += joint.body.mass_kg;
  if (mass.value < -kSurely * mass.standard_error && mass.value < -kSmallShare * links_kg)
    throw torsio::Error(
        {.place = setup.arm.name,
         .problem = "the torques fit a payload of negative mass",
         .expected = "a mass of 0 kg or more",
         .found = fmt::format("{:.3f} +- {:.3f} kg", mass.value, mass.standard_error),
         .advice =
             "Check the signs and units of the torques, the order of the joints, the tilt of the "
             "base (--tilt) and the masses of the links in the URDF file."});
  for (std::size_t j = 0; j < found.joints.size(); ++j) {
    const double share = found.joints[j].residual_Nm / setup.arm.joints[j].effort_Nm;
    if (share > kPlausibleShare)
      remark(fmt::format(
          "warning: the torque of {} differs from that of the arm by {:.3g} Nm, {:.0f} % "
          "of its largest one: check its sign, its unit, the order of the joints and "
          "the URDF file",
          found.joints[j].name, found.joints[j].residual_Nm, 100.0 * share));
  }
}

/// What the standard errors do not contain.
void remark_on_springs(const torsio::ArmSetup& setup) {
  std::vector<std::string> linear;
  for (std::size_t j = 0; j < setup.joints.size(); ++j)
    if (setup.joints[j].model.empty() && setup.joints[j].monitor.empty())
      linear.push_back(setup.arm.joints[j].name);
  if (linear.empty()) return;
  remark(
      fmt::format("warning: the arm's file has no model of {}: a linear spring without hysteresis "
                  "estimates small torques too small, by up to half, which the standard errors do "
                  "not contain; train models (docs/robot/arm.md)",
                  fmt::join(linear, ", ")));
}

void write_payload(const IdentifyFlags& flags, torsio::ArmSetup setup,
                   const torsio::IdentifiedPayload& found) {
  if (!found.mass_kg.is_determined)
    throw torsio::Error({.place = flags.output,
                         .problem = "no payload is written: its mass is not determined",
                         .expected = "a motion that determines the mass",
                         .found = found.mass_kg.reason,
                         .advice = "Record the program that 'torsio arm excite' writes."});
  setup.arm.payload = found.body();
  torsio::require_carriable(setup,
                            fmt::format("identified payload of {:.3g} kg", found.mass_kg.value));
  write_text(flags.output, payload_line(found.body()));
  remark(fmt::format("{}: the line 'payload' for the arm's file", flags.output));
}

/// `--links`: the payload is that of the arm's file.
void identify_links_of(const IdentifyFlags& flags, const torsio::ArmSetup& setup,
                       const std::vector<torsio::ArmMotion>& motions,
                       const torsio::Progress& progress) {
  torsio::IdentificationOptions options = options_of(flags, setup);
  if (flags.links_within_percent == 0.0) options.link_share = kLinkShare;
  if (flags.links_com.empty()) options.link_com_m = kLinkCom_m;
  const torsio::IdentifiedLinks found = torsio::identify_links(setup.arm, motions, options);
  std::vector<double> before;
  std::vector<double> after;
  if (!flags.tests.empty()) {
    const std::vector<torsio::ArmMotion> tests = motions_of(flags.tests, setup.arm, progress);
    before = torsio::torque_residuals(setup.arm, found.modelled_joints, tests, options);
    after = torsio::torque_residuals(found.arm, found.joints, tests, options);
  }
  if (flags.json.wants_tables()) print(links_text(found, before, after));
  flags.json.write(torsio::json_text(links_json(found, before, after)));
}

void identify(IdentifyFlags& flags) {
  if (!flags.has_links && !flags.tests.empty())
    throw torsio::UsageError(
        {.place = "--test", .expected = "--links beside it", .found = "--test alone"});
  if (flags.has_links && !flags.output.empty())
    throw torsio::UsageError({.place = "--output",
                              .expected = "no output beside --links: it is for the payload",
                              .found = "'" + flags.output + "'"});
  for (std::size_t n = 1; n < flags.recordings.size(); ++n)
    if (std::find(flags.recordings.begin(),
                  flags.recordings.begin() + static_cast<std::ptrdiff_t>(n),
                  flags.recordings[n]) != flags.recordings.begin() + static_cast<std::ptrdiff_t>(n))
      throw torsio::UsageError({.place = "torsio arm identify",
                                .expected = "each recording once",
                                .found = "'" + flags.recordings[n] + "' again"});
  DataFlags data;
  data.recordings = flags.recordings;
  data.check_outputs({flags.output, flags.json.destination},
                     {flags.arm == kReadyArm ? std::string() : flags.arm});
  if (!flags.output.empty()) require_writable(flags.output);
  ProgressBar progress;
  torsio::ArmSetup setup = arm_of(flags.arm, progress.listener());
  data.check_outputs({flags.output, flags.json.destination}, setup.files);
  if (!flags.tilt.empty())
    setup.arm.gravity_m_s2 =
        torsio::tilted_gravity(torsio::signed_quantity_with_unit(flags.tilt, "rad", "--tilt"));
  const std::vector<torsio::ArmMotion> motions =
      motions_of(flags.recordings, setup.arm, progress.listener());
  if (flags.has_links) return identify_links_of(flags, setup, motions, progress.listener());
  const torsio::IdentifiedPayload found =
      torsio::identify_payload(setup.arm, motions, options_of(flags, setup));
  require_plausible(setup, found);
  remark_on_springs(setup);
  if (flags.json.wants_tables()) print(payload_text(found));
  flags.json.write(torsio::json_text(identified_json(flags, found)));
  if (!flags.output.empty()) write_payload(flags, std::move(setup), found);
}

}  // namespace

void add_arm_identify(CLI::App& arm) {
  auto flags = std::make_shared<IdentifyFlags>();
  CLI::App* verb = arm.add_subcommand(
      "identify", "mass, centre of mass and inertia of what an arm carries, from a recording");
  verb->footer(
      "Example: torsio arm --program moves.yaml -o moves.csv\n"
      "         torsio arm identify moves.csv -o payload.yaml\n"
      "         torsio arm identify moves.csv --arm my_arm.yaml --links-within 1 --links-com 2mm\n"
      "The channels are those of 'torsio arm -o': angle of the link and estimated torque of each "
      "joint. docs/robot/arm_identification.md has the method.");
  verb->add_option("RECORDING", flags->recordings,
                   "recordings of the arm with one payload, in any format that is read")
      ->required();
  verb->add_option("--arm", flags->arm,
                   "arm6, or FILE.yaml of your own; its payload is not used but with --links")
      ->capture_default_str();
  verb->add_option("--tilt", flags->tilt,
                   "tilt of the base about its y axis, in place of that of the arm's file: 30deg");
  verb->add_option("--window", flags->window, "length of the windows (default: 0.25s)");
  verb->add_option(
      "--torque-within", flags->torque_within_percent,
      "percent by which the torque of a joint may be wrong as a whole (default: 3 if a "
      "joint of the arm's file has no model, else 1)");
  verb->add_option("--links-within", flags->links_within_percent,
                   "percent by which mass and inertia of each link may differ from the URDF file")
      ->capture_default_str();
  verb->add_option("--links-com", flags->links_com,
                   "distance by which the centre of mass of each link may differ from it: 2mm");
  verb->add_flag("--links", flags->has_links,
                 "correct the links instead: the payload is that of the arm's file, the links may "
                 "differ by --links-within (default: 10) and --links-com (default: 10mm)");
  verb->add_option("--test", flags->tests,
                   "with --links: recordings of other moves, on which the torques are compared");
  verb->add_option("-o,--output", flags->output,
                   "text file for the line 'payload' of the arm's YAML file");
  flags->json.add(*verb, "the result");
  verb->callback([flags] { identify(*flags); });
}
