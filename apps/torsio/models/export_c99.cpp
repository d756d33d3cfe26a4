#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/quantity.hpp"
#include "files/output_file.hpp"
#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/export/c_cost.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/text_table.hpp"

namespace {

/// The counts in a turn of the joint with which a mapping reads the column of an angle.
struct MappedCounts {
  double counts_per_turn = 0.0;
  std::string text;  ///< the rule in words: "1310720 (16384 in a turn before a gear of 80)"
};

/// None if the model has no mapping with this channel, or its column has no counts: a rule without `scale`.
std::optional<MappedCounts> mapped_counts(const torsio::ModelFile& model,
                                          const std::string& channel) {
  if (model.card.mapping.empty()) return std::nullopt;
  const torsio::Mapping mapping = torsio::parse_mapping(model.card.mapping, "mapping of the model");
  const auto rule = std::ranges::find(mapping.channels, channel, &torsio::ChannelRule::name);
  if (rule == mapping.channels.end() || rule->scale == 1.0) return std::nullopt;
  const torsio::Unit* const unit = torsio::find_unit(rule->unit.empty() ? "rad" : rule->unit);
  if (unit == nullptr || unit->si_suffix != "rad") return std::nullopt;
  const double of_encoder = 2.0 * std::numbers::pi / (rule->sign * rule->scale * unit->scale);
  constexpr double kRounded = 1e-6;  // The mapping has a limited number of digits.
  const double counts = std::round(of_encoder * rule->gear_ratio);
  if (!(std::abs(of_encoder * rule->gear_ratio - counts) < kRounded * std::abs(counts)))
    return std::nullopt;
  std::string text = fmt::format("{}", counts);
  if (rule->gear_ratio != 1.0)
    text += fmt::format(" ({:.9g} in a turn of the encoder, {:g} turns of it in one of the joint)",
                        of_encoder, rule->gear_ratio);
  return MappedCounts{counts, std::move(text)};
}

/// "gear_angle_rad=524288", or "gear_angle_rad=auto" for the counts of the model's mapping
torsio::CCounts counts_of(const std::string& text, const torsio::ModelFile& model) {
  const auto equals = text.find('=');
  if (equals == std::string::npos)
    throw torsio::UsageError(
        {.place = "--counts",
         .expected = "CHANNEL=COUNTS in a turn of the joint, such as gear_angle_rad=524288, or "
                     "gear_angle_rad=auto",
         .found = text});
  const std::string channel = text.substr(0, equals);
  const auto mapped = mapped_counts(model, channel);
  if (text.substr(equals + 1) == "auto") {
    if (!mapped)
      throw torsio::UsageError(
          {.place = "--counts",
           .expected = fmt::format("a model whose mapping reads counts for {}", channel),
           .found = model.card.mapping.empty() ? "a model without a mapping"
                                               : "a mapping without such a channel and its scale",
           .advice = fmt::format("Give the number: --counts {}=COUNTS, those in a turn of the "
                                 "joint.",
                                 channel)});
    return {.channel = channel, .counts_per_turn = mapped->counts_per_turn};
  }
  const double counts = torsio::signed_quantity_with_unit(text.substr(equals + 1), "1", "--counts");
  constexpr double kSame = 1e-6;
  if (mapped &&
      !(std::abs(counts - mapped->counts_per_turn) <= kSame * std::abs(mapped->counts_per_turn)))
    remark(fmt::format(
        "warning: --counts {0}={1}, but the recordings that the model was trained with had {2} in "
        "a "
        "turn of the joint: if it is the same encoder, the torque will be wrong; take --counts "
        "{0}=auto",
        channel, counts, mapped->text));
  return {.channel = channel, .counts_per_turn = counts};
}

/// A number with an ending that scales it: "256kB", "168MHz". @param unit without an ending
std::optional<double> scaled(const std::string& text, const char* flag, const char* unit,
                             std::initializer_list<std::pair<std::string_view, double>> endings,
                             const char* example) {
  if (text.empty()) return std::nullopt;
  std::string number = text;
  double factor = 1.0;
  for (const auto& [ending, scale] : endings)
    if (number.ends_with(ending)) {
      number.resize(number.size() - ending.size());
      factor = scale;
      break;
    }
  const double value = factor * torsio::signed_quantity_with_unit(number, unit, flag);
  if (!(value > 0.0) || !std::isfinite(value))
    throw torsio::UsageError({.place = flag,
                              .expected = fmt::format("a positive number, such as {}", example),
                              .found = text});
  return value;
}

/// "256kB" in bytes.
std::optional<double> memory_of(const std::string& text, const char* flag) {
  constexpr double kKilo = 1024.0;
  return scaled(text, flag, "1", {{"MB", kKilo * kKilo}, {"kB", kKilo}, {"B", 1.0}}, "256kB");
}

/// "168MHz" in Hz.
std::optional<double> clock_of(const std::string& text) {
  return scaled(text, "--clock", "Hz", {{"GHz", 1e9}, {"MHz", 1e6}, {"kHz", 1e3}}, "168MHz");
}

std::string size_text(double bytes) {
  return bytes < 10240.0 ? fmt::format("{:.0f} B", bytes)
                         : fmt::format("{:.0f} kB", bytes / 1024.0);
}

void require_room(const char* what, double needed, const std::optional<double>& given,
                  const std::string& target) {
  if (!given || needed <= *given) return;
  throw torsio::Error(
      {.place = fmt::format("{} of {}", what, target),
       .expected = fmt::format("at least {} (estimated)", size_text(needed)),
       .found = fmt::format("{}: {} are missing", size_text(*given), size_text(needed - *given)),
       .advice = "Take a smaller model (fewer units, knots or points), or another target."});
}

/// What a step may take of the time between two: the rest is for the drive's other work, and instructions take more
/// than one cycle each.
constexpr double kLargestShare = 0.5;

void require_time(const torsio::CCost& cost, double rate_Hz, const std::optional<double>& clock_Hz,
                  const std::string& target) {
  if (!clock_Hz) return;
  const torsio::CCost::Step& step = cost.control ? *cost.control : cost.step;
  const double share = step.instructions * rate_Hz / *clock_Hz;
  if (share <= kLargestShare) return;
  throw torsio::Error(
      {.place = fmt::format("the rate of {}", target),
       .expected = fmt::format(
           "at most {:.0f} instructions a step, half of those between two steps of {:g} Hz",
           kLargestShare * *clock_Hz / rate_Hz, rate_Hz),
       .found = fmt::format("{:.0f} (estimated)", step.instructions),
       .advice = "Take a smaller model, a model at a lower rate, or a faster target."});
}

std::string cost_table(const std::string& prefix, const torsio::C99Program& program,
                       torsio::CReal real, double rate_Hz,
                       const std::vector<const torsio::CTarget*>& targets) {
  torsio::TextTable table;
  table.header({"target", "flash", "RAM", "function", "stack", "instructions",
                fmt::format("at {:g} Hz", rate_Hz)});
  for (const torsio::CTarget* target : targets) {
    const torsio::CCost cost = torsio::c_cost(program, *target, real);
    std::vector<std::string> first{std::string(target->name), size_text(cost.flash),
                                   size_text(cost.ram)};
    const auto add = [&](const char* function, const torsio::CCost::Step& step) {
      first.insert(
          first.end(),
          {prefix + function, size_text(step.stack), fmt::format("{:.0f}", step.instructions),
           fmt::format("{:.2f} million a second", 1e-6 * step.instructions * rate_Hz)});
      table.row(first);
      first = {"", "", ""};
    };
    add("_step", cost.step);
    if (cost.control) add("_control_step", *cost.control);
  }
  return table.text() +
         "estimated, within 15 %; flash without the library functions of a target that computes in "
         "software\n";
}

template <class Kind, class Counts>
nlohmann::json counts_json(const Counts& counts) {
  nlohmann::json all = nlohmann::json::object();
  for (std::size_t i = 0; i < counts.size(); ++i)
    all[std::string(name(static_cast<Kind>(i)))] = counts[i];
  return all;
}

/// What the costs are estimated from.
nlohmann::json parts_json(const torsio::C99Program& program) {
  nlohmann::json parts{
      {"work", counts_json<torsio::CWork>(program.work)},
      {"code", counts_json<torsio::CCode>(program.code)},
      {"stack", counts_json<torsio::CStack>(torsio::c_stack(program.work, program.local_bytes,
                                                            program.control_work.has_value()))}};
  if (program.control_work) {
    parts["control_work"] = counts_json<torsio::CWork>(*program.control_work);
    parts["control_stack"] = counts_json<torsio::CStack>(
        torsio::c_stack(*program.control_work, program.local_bytes, true));
  }
  return parts;
}

nlohmann::json cost_json(const torsio::C99Program& program, torsio::CReal real,
                         const std::vector<const torsio::CTarget*>& targets) {
  nlohmann::json all = nlohmann::json::array();
  for (const torsio::CTarget* target : targets) {
    const torsio::CCost cost = torsio::c_cost(program, *target, real);
    all.push_back({{"target", std::string(target->name)},
                   {"flash_bytes", cost.flash},
                   {"ram_bytes", cost.ram},
                   {"stack_bytes", cost.step.stack},
                   {"instructions", cost.step.instructions}});
    if (cost.control)
      all.back()["control"] = {{"stack_bytes", cost.control->stack},
                               {"instructions", cost.control->instructions}};
  }
  return all;
}

}  // namespace

void export_c99(ExportFlags& flags) {
  const std::filesystem::path folder(flags.output);
  const std::string header = (folder / (flags.c99 + ".h")).string();
  const std::string source = (folder / (flags.c99 + ".c")).string();
  const torsio::CReal real = real_of(flags, torsio::CReal::single);
  torsio::C99Options options{.name = flags.c99, .real = real};
  if (!flags.controller.empty()) options.controller = torsio::read_controller(flags.controller);
  std::vector<const torsio::CTarget*> targets;
  if (!flags.target.empty())
    targets.push_back(&torsio::find_c_target(flags.target));
  else
    for (const torsio::CTarget& target : torsio::c_targets())
      if ((real == torsio::CReal::single ? target.single : target.twofold) != nullptr)
        targets.push_back(&target);
  const auto flash = memory_of(flags.flash, "--flash");
  const auto ram = memory_of(flags.ram, "--ram");
  const auto clock_Hz = clock_of(flags.clock);
  if ((flash || ram || clock_Hz) && flags.target.empty())
    throw torsio::UsageError({.place = "--target",
                              .problem = "--flash, --ram and --clock are those of one target",
                              .advice = "Name it with --target."});
  const torsio::ModelFile model = torsio::load_model(flags.model);
  for (const std::string& each : flags.counts) options.counts.push_back(counts_of(each, model));
  const torsio::C99Program program =
      torsio::c99_program(model, options, std::filesystem::path(flags.model).filename().string());
  if (!flags.target.empty()) {
    const torsio::CCost cost = torsio::c_cost(program, *targets.front(), real);
    require_room("the flash", cost.flash, flash, flags.target);
    const double stack = std::max(cost.step.stack, cost.control ? cost.control->stack : 0.0);
    require_room("the RAM", cost.ram + stack, ram, flags.target);
    require_time(cost, model.settings.sample_rate_Hz, clock_Hz, flags.target);
  }
  make_folder(flags.output);
  for (const std::string& file : {header, source}) require_new(flags, file);
  // Both or none: a full disk must not leave the header of one program beside the source of another.
  torsio::OutputFile header_file(header);
  torsio::OutputFile source_file(source);
  header_file.write(std::as_bytes(std::span(program.header)));
  source_file.write(std::as_bytes(std::span(program.source)));
  header_file.commit();
  source_file.commit();
  if (flags.json.wants_tables())
    print(fmt::format(
        "{} and {} written: {}, {}, {} Hz\n{}", header, source, model.parameters.family(),
        real == torsio::CReal::single ? "float" : "double", model.settings.sample_rate_Hz,
        cost_table(flags.c99, program, real, model.settings.sample_rate_Hz, targets)));
  nlohmann::json document = export_document(model);
  document["real"] = real == torsio::CReal::single ? "float" : "double";
  document["header"] = header;
  document["source"] = source;
  document["table_bytes"] = program.table_bytes;
  document["state_bytes"] = program.state_bytes;
  document["parts"] = parts_json(program);
  document["targets"] = cost_json(program, real, targets);
  flags.json.write(document.dump(2) + "\n");
}
