// What shows, checks and writes out what a store has; store_change.cpp has the parts that change it.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "files/whole_file.hpp"
#include "report/json_text.hpp"
#include "search/study_flags.hpp"
#include "store/store_flags.hpp"
#include "store/store_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/store/study_store.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;

struct StoreListFlags : StoreFlags {
  bool studies = false;
  bool models = false;
  bool recordings = false;
};

struct StoreShowFlags : StoreFlags {
  std::string serial;
};

struct StoreExportFlags : StoreFlags {
  std::string serial;
  std::int64_t model = 0;
  std::string output;
};

void print_studies(const StoreListFlags& flags) {
  torsio::StudyStore store(flags.existing(), wait_for_server);
  torsio::TextTable table;
  table.header({"study", "kind", "finished", "running", "waiting", "torsio"});
  Json studies = Json::array();
  for (const torsio::StoredStudy& study : store.studies()) {
    const torsio::StudyCounts counts = store.counts(study.id);
    table.row({study.name, study.kind, fmt::format("{}", counts.finished),
               fmt::format("{}", counts.running), fmt::format("{}", counts.waiting),
               study.torsio_version});
    studies.push_back({{"name", study.name},
                       {"kind", study.kind},
                       {"finished", counts.finished},
                       {"running", counts.running},
                       {"waiting", counts.waiting},
                       {"torsio_version", study.torsio_version}});
  }
  if (flags.json.wants_tables()) print(studies.empty() ? std::string("no study\n") : table.text());
  flags.json.write(torsio::json_text(Json{{"studies", std::move(studies)}}));
}

/// @param text prints the items
template <class Item>
void print_items(const StoreListFlags& flags, const char* name, const std::vector<Item>& items,
                 const std::string& text) {
  Json list = Json::array();
  for (const Item& each : items) list.push_back(store_json(each));
  if (flags.json.wants_tables()) print(items.empty() ? fmt::format("no {}\n", name) : text);
  flags.json.write(torsio::json_text(Json{{name, std::move(list)}}));
}

void list_store(const StoreListFlags& flags) {
  if (flags.studies) return print_studies(flags);
  const auto registry = flags.open();
  if (flags.models) {
    const auto models = registry->models();
    return print_items(flags, "models", models, models_text(models, true));
  }
  if (flags.recordings) {
    const auto recordings = registry->recordings();
    return print_items(flags, "recordings", recordings, recordings_text(recordings));
  }
  const auto devices = registry->summaries();
  print_items(flags, "devices", devices, devices_text(devices));
}

void show_device(const StoreShowFlags& flags) {
  const auto registry = flags.open();
  DeviceRecord record{.device = registry->device(flags.serial),
                      .models = registry->models(flags.serial),
                      .lineage = {},
                      .bases = {},
                      .recordings = registry->recordings(flags.serial),
                      .promotions = registry->promotions(flags.serial),
                      .drift = registry->drift_history(flags.serial)};
  if (const auto current = registry->current(flags.serial))
    record.lineage = registry->lineage(current->id);
  std::set<std::string> bases;
  for (const torsio::RegisteredModel& model : record.models) bases.insert(model.base_sha256);
  for (const std::string& sha256 : bases)
    if (auto base = registry->model_of_file(sha256)) record.bases.push_back(std::move(*base));
  if (flags.json.wants_tables()) print(device_text(record));
  flags.json.write(torsio::json_text(store_json(record)));
}

void export_stored_model(const StoreExportFlags& flags) {
  require_model_file(flags.output);
  const torsio::StoreAddress address = flags.existing();
  DataFlags().check_outputs({flags.output, flags.json.destination}, {address.target});
  const auto registry = flags.open();
  std::int64_t id = flags.model;
  if (id == 0) {
    const auto current = registry->current(flags.serial);
    if (!current)
      throw torsio::Error(
          {.place = fmt::format("{}: device {}", address.name(), flags.serial),
           .problem = "no model is current",
           .advice = "Promote one (torsio store promote), or name one with --model ID."});
    id = current->id;
  }
  const std::string bytes = registry->model_bytes(flags.serial, id);
  torsio::write_whole_file(flags.output, std::as_bytes(std::span(bytes)));
  const torsio::RegisteredModel model = registry->model(id);
  if (flags.json.wants_tables())
    print(fmt::format("model {} of {} ({}) written to {}\n", id, flags.serial, model.family,
                      flags.output));
  Json document = store_json(model);
  document["written_to"] = flags.output;
  flags.json.write(torsio::json_text(document));
}

void verify_store(const StoreFlags& flags) {
  const auto registry = flags.open();
  ProgressBar progress;
  const auto findings = registry->verify(progress.listener());
  std::size_t errors = 0;
  std::string text;
  Json list = Json::array();
  for (const torsio::RegistryFinding& each : findings) {
    errors += each.is_error ? 1 : 0;
    text += fmt::format("{}: {}: {}\n", each.is_error ? "error" : "remark", each.place, each.text);
    list.push_back({{"is_error", each.is_error}, {"place", each.place}, {"text", each.text}});
  }
  const std::size_t devices = registry->devices().size();
  const std::size_t models = registry->models().size();
  const std::size_t recordings = registry->recordings().size();
  text += fmt::format("devices {}, models {}, recordings {}: {}\n", devices, models, recordings,
                      errors == 0 ? "no error" : fmt::format("errors {}", errors));
  if (flags.json.wants_tables()) print(text);
  flags.json.write(torsio::json_text(Json{{"devices", devices},
                                          {"models", models},
                                          {"recordings", recordings},
                                          {"findings", std::move(list)}}));
  if (errors > 0)
    throw torsio::Error({.place = registry->address().name(),
                         .problem = fmt::format("the check found errors: {}", errors)});
}

void upgrade(const StoreFlags& flags) {
  const torsio::StoreAddress address = flags.existing();
  const torsio::StoreUpgrade upgraded = torsio::upgrade_store(address);
  if (flags.json.wants_tables())
    print(upgraded.before == upgraded.after
              ? fmt::format("{}: its tables are of version {} already\n", address.name(),
                            upgraded.after)
              : fmt::format("{}: tables upgraded from version {} to {}\n", address.name(),
                            upgraded.before, upgraded.after));
  flags.json.write(torsio::json_text(Json{{"before", upgraded.before}, {"after", upgraded.after}}));
}

void add_store_list(CLI::App& store) {
  auto flags = std::make_shared<StoreListFlags>();
  CLI::App* part = store.add_subcommand(
      "list", "show the devices with their current models and last drift, or what else it has");
  part->footer("Example: torsio store list --store postgresql://robot@server/torsio");
  CLI::Option* studies = part->add_flag("--studies", flags->studies, "show the studies");
  CLI::Option* models = part->add_flag("--models", flags->models, "show the models of all devices");
  part->add_flag("--recordings", flags->recordings, "show the recordings")
      ->excludes(studies)
      ->excludes(models);
  models->excludes(studies);
  flags->add(*part, "write the list as JSON to a file, or - for standard output");
  part->callback([flags] { list_store(*flags); });
}

void add_store_show(CLI::App& store) {
  auto flags = std::make_shared<StoreShowFlags>();
  CLI::App* part = store.add_subcommand(
      "show", "show a device: its models, promotions, history of drift and recordings");
  part->footer("Example: torsio store show dfki-50#0001");
  part->add_option("SERIAL", flags->serial, "serial number of the device")->required();
  flags->add(*part, "write the device as JSON to a file, or - for standard output");
  part->callback([flags] { show_device(*flags); });
}

void add_store_export(CLI::App& store) {
  auto flags = std::make_shared<StoreExportFlags>();
  CLI::App* part = store.add_subcommand(
      "export", "write the current model of a device to a file, as it was added");
  part->footer("Example: torsio store export dfki-50#0001 -o joint.safetensors");
  part->add_option("SERIAL", flags->serial, "serial number of the device")->required();
  part->add_option("--model", flags->model, "number of another model of this device")
      ->check(CLI::PositiveNumber);
  part->add_option("-o,--output", flags->output, "model file to write, completely or not at all")
      ->required();
  flags->add(*part, "write the model's record as JSON to a file, or - for standard output");
  part->callback([flags] { export_stored_model(*flags); });
}

void add_store_verify(CLI::App& store) {
  auto flags = std::make_shared<StoreFlags>();
  CLI::App* part = store.add_subcommand(
      "verify",
      "check the database, the hash and the device of each model, the history, and "
      "whether recordings have changed");
  part->footer(
      "Example: torsio store verify\n"
      "The exit code is 1 if there are errors. A recording that is not there is a remark.");
  flags->add(*part, "write the findings as JSON to a file, or - for standard output");
  part->callback([flags] { verify_store(*flags); });
}

void add_store_upgrade(CLI::App& store) {
  auto flags = std::make_shared<StoreFlags>();
  CLI::App* part = store.add_subcommand(
      "upgrade", "upgrade the tables of a store that an older torsio wrote, with all that it has");
  part->footer(
      "Example: torsio store upgrade --store torsio-studies.sqlite\n"
      "Older versions of torsio refuse the store afterwards.");
  flags->add(*part, "write the versions as JSON to a file, or - for standard output");
  part->callback([flags] { upgrade(*flags); });
}

}  // namespace

void StoreFlags::add(CLI::App& part, const char* json_help) {
  part.add_option("--store", store, "SQLite file or postgresql:// URL of the store")
      ->capture_default_str();
  part.add_option("--json", json.destination, json_help);
}

torsio::StoreAddress StoreFlags::existing() const {
  torsio::StoreAddress address = torsio::store_address(store);
  std::error_code absent;
  if (address.kind == torsio::StoreAddress::Kind::sqlite &&
      !std::filesystem::exists(address.target, absent))
    throw torsio::UsageError({.place = address.target,
                              .problem = "there is no store",
                              .advice = "Name one with --store; torsio store add begins one."});
  return address;
}

std::unique_ptr<torsio::Registry> StoreFlags::open() const {
  return std::make_unique<torsio::Registry>(existing(), wait_for_server);
}

void add_store(CLI::App& app) {
  CLI::App* verb = app.add_subcommand(
      "store", "the record of every device: its models, recordings, promotions and drift");
  verb->footer(
      "Example: torsio store add dfki-50#0001 joint.safetensors --recordings sweep.csv\n"
      "         torsio store promote dfki-50#0001 1 --reason 'first calibration'\n"
      "         torsio store list\n"
      "A store also has the studies of torsio search. docs/fleet.md has the details.");
  verb->require_subcommand(1);
  add_store_list(*verb);
  add_store_show(*verb);
  add_store_changes(*verb);
  add_store_export(*verb);
  add_store_verify(*verb);
  add_store_upgrade(*verb);
}
