// What changes the record of a device.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
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
#include "torsio/data/load.hpp"
#include "torsio/files/model_file.hpp"

namespace {

using Json = nlohmann::ordered_json;

struct StoreAddFlags : StoreFlags {
  torsio::RegisteredDevice device;
  std::vector<std::string> models;
  DataFlags data;
  std::int64_t parent = 0;
  std::string by;
};

struct StoreChangeFlags : StoreFlags {
  std::string serial;
  std::int64_t model = 0;
  std::string reason;
  std::string by;
};

std::vector<torsio::NewModel> read_new_models(const StoreAddFlags& flags) {
  std::vector<torsio::NewModel> models;
  models.reserve(flags.models.size());
  for (const std::string& path : flags.models) {
    const std::vector<std::byte> bytes = torsio::read_whole_file(path, torsio::kMaxModelFileBytes);
    torsio::NewModel model{.device = flags.device.serial,
                           .bytes = {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                           .file = path,
                           .by = flags.by};
    if (flags.parent != 0) model.parent = flags.parent;
    torsio::require_own_model(model);
    models.push_back(std::move(model));
  }
  return models;
}

/// The recordings as the first model reads them.
std::vector<torsio::RegisteredRecording> read_new_recordings(StoreAddFlags& flags) {
  if (flags.data.recordings.empty()) return {};
  if (!flags.models.empty())
    flags.data.use_model_mapping(torsio::load_model(flags.models.front()).card.mapping,
                                 flags.models.front());
  ProgressBar progress;
  const torsio::LoadOptions options = flags.data.load_options(progress.listener());
  std::vector<torsio::RegisteredRecording> recordings;
  for (const std::string& path : flags.data.recordings)
    for (const torsio::Recording& recording : torsio::load_recordings(path, options))
      recordings.push_back(
          {.sha256 = recording.source.sha256,
           .device = flags.device.serial,
           .file = std::filesystem::absolute(recording.source.file).lexically_normal().string(),
           .samples = recording.size(),
           .rate_Hz = recording.sample_rate_Hz()});
  return recordings;
}

void add_to_store(StoreAddFlags& flags) {
  flags.data.check_outputs({flags.json.destination}, flags.models);
  // All files are read and checked before anything is entered.
  const std::vector<torsio::NewModel> models = read_new_models(flags);
  const std::vector<torsio::RegisteredRecording> recordings = read_new_recordings(flags);
  torsio::Registry registry(torsio::store_address(flags.store), wait_for_server);
  const bool is_new = registry.add_device(flags.device);
  for (const torsio::RegisteredRecording& recording : recordings) registry.add_recording(recording);
  Json added = Json::array();
  std::string text = fmt::format("device {}{}\n", flags.device.serial, is_new ? " is new" : "");
  for (const torsio::NewModel& each : models) {
    const torsio::RegisteredModel model = registry.model(registry.add_model(each));
    text += fmt::format("model {}: {}, {}, recordings of its training {}\n", model.id, each.file,
                        model.family, model.recordings.size());
    added.push_back(store_json(model));
  }
  if (!recordings.empty()) text += fmt::format("recordings {}\n", recordings.size());
  if (flags.json.wants_tables()) print(text);
  if (!added.empty() && !registry.current(flags.device.serial))
    remark(fmt::format("note: no model of this device is current: torsio store promote '{}' {}",
                       flags.device.serial, added.back().at("id").get<std::int64_t>()));
  Json document{{"device", store_json(registry.device(flags.device.serial))},
                {"is_new", is_new},
                {"models", std::move(added)}};
  document["recordings"] = Json::array();
  for (const torsio::RegisteredRecording& each : registry.recordings(flags.device.serial))
    if (std::ranges::find(recordings, each.sha256, &torsio::RegisteredRecording::sha256) !=
        recordings.end())
      document["recordings"].push_back(store_json(each));
  flags.json.write(torsio::json_text(document));
}

void print_change(const StoreChangeFlags& flags, std::optional<std::int64_t> before,
                  std::int64_t after) {
  if (flags.json.wants_tables())
    print(before == after
              ? fmt::format("model {} is the current one of {} already\n", after, flags.serial)
              : fmt::format("model {} is the current one of {}{}\n", after, flags.serial,
                            before ? fmt::format("; before: {}", *before) : std::string()));
  flags.json.write(torsio::json_text(Json{
      {"device", flags.serial}, {"before", before ? Json(*before) : Json()}, {"current", after}}));
}

std::optional<std::int64_t> current_id(torsio::Registry& registry, const std::string& serial) {
  const auto current = registry.current(serial);
  return current ? std::optional(current->id) : std::nullopt;
}

void promote_model(const StoreChangeFlags& flags) {
  const auto registry = flags.open();
  const auto before = current_id(*registry, flags.serial);
  registry->promote(flags.serial, flags.model, flags.by, flags.reason);
  print_change(flags, before, flags.model);
}

void roll_back_model(const StoreChangeFlags& flags) {
  const auto registry = flags.open();
  const auto before = current_id(*registry, flags.serial);
  print_change(flags, before, registry->roll_back(flags.serial, flags.by, flags.reason));
}

void add_person(CLI::App& part, std::string& by) {
  part.add_option("--by", by, "who does this, for the history (default: user@machine)");
}

void add_store_add(CLI::App& store) {
  auto flags = std::make_shared<StoreAddFlags>();
  CLI::App* part = store.add_subcommand("add", "add a device, models and recordings of it");
  part->footer(
      "Example: torsio store add dfki-50#0001 joint.safetensors --recordings sweep.csv "
      "--type dfki-50\n"
      "A model must have the serial number of the device: torsio fit --device-serial.");
  part->add_option("SERIAL", flags->device.serial, "serial number of the device")->required();
  part->add_option("MODEL", flags->models, "model files of this device");
  part->add_option("--recordings", flags->data.recordings,
                   "recordings of this device, or manifests; the files remain where they are");
  part->add_option("--type", flags->device.type, "type of the device, such as dfki-50");
  part->add_option("--note", flags->device.note, "a text about the device");
  part->add_option("--parent", flags->parent, "number of the model that these were made from")
      ->check(CLI::PositiveNumber);
  flags->data.add_model_mapping(*part);
  add_person(*part, flags->by);
  flags->add(*part, "write what was added as JSON to a file, or - for standard output");
  part->callback([flags] {
    if (flags->by.empty()) flags->by = person_here();
    add_to_store(*flags);
  });
}

void add_store_change(CLI::App& store, bool is_promotion) {
  auto flags = std::make_shared<StoreChangeFlags>();
  CLI::App* part =
      is_promotion ? store.add_subcommand("promote", "make a model the current one of its device")
                   : store.add_subcommand(
                         "roll-back", "make the model current that was so before the present one");
  part->footer(is_promotion
                   ? "Example: torsio store promote dfki-50#0001 2 --reason 'new spring'"
                   : "Example: torsio store roll-back dfki-50#0001 --reason 'larger errors'");
  part->add_option("SERIAL", flags->serial, "serial number of the device")->required();
  if (is_promotion) part->add_option("MODEL_ID", flags->model, "number of the model")->required();
  part->add_option("--reason", flags->reason, "why, for the history");
  add_person(*part, flags->by);
  flags->add(*part, "write the numbers of the models as JSON to a file, or - for standard output");
  part->callback([flags, is_promotion] {
    if (flags->by.empty()) flags->by = person_here();
    if (is_promotion)
      promote_model(*flags);
    else
      roll_back_model(*flags);
  });
}

}  // namespace

std::string person_here() {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  const passwd* const user = getpwuid(geteuid());  // NOLINT(concurrency-mt-unsafe): one thread
  return fmt::format("{}@{}", user == nullptr ? "user" : user->pw_name,
                     host[0] == '\0' ? "machine" : host.data());
}

void add_store_changes(CLI::App& store) {
  add_store_add(store);
  add_store_change(store, true);
  add_store_change(store, false);
}
