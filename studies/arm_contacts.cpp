#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "arm_springs.hpp"
#include "core/report_progress.hpp"
#include "numerics/event_bounds.hpp"
#include "numerics/quantile.hpp"
#include "numerics/shared_progress.hpp"
#include "sim/contacts/contact_trials.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/sim/contacts/learn_contacts.hpp"

namespace torsio {
namespace {

constexpr double kHoursPerRepeat = 1.0;
constexpr double kQuickHours = 0.05;
constexpr std::size_t kPushesPerRepeat = 40;  // so that about 30 are above the error bars
constexpr std::size_t kQuickPushes = 20;
constexpr std::array kContactPayloads_kg{8.0, 0.0};
constexpr double kFirstLatency_s = 0.02;
constexpr double kSecondLatency_s = 0.05;
constexpr double kFirstShare = 0.95;
constexpr double kSecondShare = 0.99;

/// What one family of models finds.
struct ContactCase {
  std::vector<PushTrial> trials;
  std::size_t false_alarms = 0;
  double largest_factor = 0.0;
};

ContactCase contact_case(const ArmSetup& setup, const char* family, double hours,
                         std::size_t pushes, std::uint64_t seed, const Progress& progress) {
  ArmController::Settings settings =
      settings_with(setup, bench_models(setup, family, seed, share_of(progress, 0.0, 0.01)));
  const LearnedContacts learned = learn_contacts(setup, settings, {.hours = hours, .seed = seed},
                                                 share_of(progress, 0.01, 0.5));
  settings.contacts = learned.file.settings();
  ContactCase of{.trials = push_trials(setup, settings, {.count = pushes, .seed = seed + 2},
                                       share_of(progress, 0.5, 0.55)),
                 .false_alarms = count_false_alarms(setup, settings, hours, seed + 1,
                                                    share_of(progress, 0.55, 1.0))};
  for (const ContactsFile::Joint& joint : learned.file.joints)
    of.largest_factor = std::max(of.largest_factor, joint.detector.factor);
  return of;
}

/// The pushes that are above the error bars of the learned springs, and no part of the contact before.
struct FoundPushes {
  std::size_t count = 0;
  std::size_t in_first = 0;
  std::size_t in_second = 0;
  std::vector<double> latency_s = {};
};

FoundPushes found_pushes(const std::vector<PushTrial>& trials,
                         const std::vector<PushTrial>& chosen) {
  FoundPushes found;
  for (std::size_t k = 0; k < trials.size(); ++k) {
    if (!chosen[k].is_above || trials[k].is_in_contact) continue;
    ++found.count;
    const double latency_s = trials[k].latency_s.value_or(1.0);
    if (latency_s <= kFirstLatency_s) ++found.in_first;
    if (latency_s <= kSecondLatency_s) ++found.in_second;
    found.latency_s.push_back(latency_s);
  }
  return found;
}

void add_case(QuantityTable& table, const ContactCase& of, const ContactCase& learned,
              double payload_kg, const char* family, double hours) {
  const std::string condition = fmt::format("{:g} kg, {}", payload_kg, family);
  const auto row = [&](std::string quantity, double value, const char* unit, std::string remark) {
    table.rows.push_back({.condition = condition,
                          .quantity = std::move(quantity),
                          .value = value,
                          .unit = unit,
                          .remark = std::move(remark)});
  };
  const FoundPushes found = found_pushes(of.trials, learned.trials);
  const auto share = [&](std::size_t count) {
    return found.count == 0 ? kNotMeasured
                            : static_cast<double>(count) / static_cast<double>(found.count);
  };
  const auto verdict = [&](std::size_t count, double wanted) {
    std::string text = fmt::format("{} of {}", count, found.count);
    if (&of != &learned) return text;
    return text + fmt::format("; wanted {:g} %: {}", 100.0 * wanted,
                              share(count) >= wanted ? "met" : "missed");
  };
  row("pushes of 30 N found within 20 ms", 100.0 * share(found.in_first), "%",
      verdict(found.in_first, kFirstShare));
  row("pushes of 30 N found within 50 ms", 100.0 * share(found.in_second), "%",
      verdict(found.in_second, kSecondShare));
  row("median latency", 1e3 * quantile(found.latency_s, 0.5), "ms", {});
  row("false alarms per hour, other motion", static_cast<double>(of.false_alarms) / hours, "1/h",
      fmt::format("{} in {:g} h; at most {:.3g} per hour with 95 % confidence", of.false_alarms,
                  hours, poisson_upper_95(of.false_alarms) / hours));
  const auto left_out = [&](std::string quantity, std::ptrdiff_t count) {
    row(std::move(quantity),
        100.0 * static_cast<double>(count) / static_cast<double>(of.trials.size()), "%",
        fmt::format("{} of {}, not counted", count, of.trials.size()));
  };
  left_out("pushes before the end of the contact before",
           std::ranges::count(of.trials, true, &PushTrial::is_in_contact));
  row("largest factor k", of.largest_factor, "-", {});
  if (&of == &learned)
    left_out("pushes that are not above 5 error bars",
             std::ranges::count(of.trials, false, &PushTrial::is_above));
}

}  // namespace

Study arm_contacts(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "an arm of six elastic joints moves at random; thresholds of contacts are learned from "
          "one "
          "hour of motion per repeat for the lowest rate of false alarms that these hours support. "
          "30 N "
          "of random direction act on the flange, risen within 2 ms, for 0.1 s; false alarms are "
          "counted in as many other hours. Models of the springs are fitted to recordings of each "
          "joint's own bench. Pushes count whose torque is above 5 error bars of the learned "
          "springs at "
          "some joint, and which begin after the contact before has ended",
      .unit = "Nm",
      .options = options};
  const auto repeats = static_cast<double>(options.repeats);
  const double hours = options.is_quick ? kQuickHours : kHoursPerRepeat * repeats;
  const std::size_t pushes = options.is_quick ? kQuickPushes : kPushesPerRepeat * options.repeats;
  QuantityTable table;
  for (std::size_t p = 0; p < kContactPayloads_kg.size(); ++p) {
    const ArmSetup setup = arm_of_specimens(0, kContactPayloads_kg[p]);
    const auto part = [&](std::size_t k) {
      const double width = 1.0 / static_cast<double>(2 * kContactPayloads_kg.size());
      const double first = width * static_cast<double>(2 * p + k);
      return share_of(progress, first, first + width);
    };
    const ContactCase learned =
        contact_case(setup, "grey_box", hours, pushes, options.seed, part(0));
    const ContactCase lines = contact_case(setup, "linear", hours, pushes, options.seed, part(1));
    add_case(table, learned, learned, kContactPayloads_kg[p], "grey_box", hours);
    add_case(table, lines, learned, kContactPayloads_kg[p], "linear", hours);
  }
  study.table = std::move(table);
  for (const char* actuator : {"dfki-300", "dfki-120", "dfki-28"})
    study.plants.push_back(study_plant(actuator));
  study.notes.push_back(fmt::format(
      "{:g} h of motion for the thresholds, {:g} h for the false alarms, {} pushes; rotor and gear "
      "output turn together. Payload, masses and lengths of the links are exact.",
      hours, hours, pushes));
  return study;
}

}  // namespace torsio
