#include "files/card_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "files/family_names.hpp"
#include "files/json_object.hpp"
#include "files/json_text.hpp"
#include "files/load_target_json.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kCardAdvice = "The card is damaged: fit the model again.";

/// Before anything else is read: another version may mean anything.
void check_card_version(const JsonObject& card, const std::string& place) {
  const std::uint64_t version = card.whole_number("format_version");
  if (version == kModelFormatVersion) return;
  throw Error({.place = place + "/format_version",
               .expected = fmt::format("{}, which torsio {} reads", kModelFormatVersion, kVersion),
               .found = fmt::format("{}", version),
               .advice = version > kModelFormatVersion
                             ? "A newer torsio wrote the file: update torsio, or fit the model "
                               "again with this one."
                             : "No release wrote this version: the card is damaged."});
}

AnyModel::Parameters empty_parameters(const std::string& family, const std::string& place) {
  try {
    return parameters_of_family(family);
  } catch (const UsageError&) {
    throw Error({.place = place + "/family",
                 .expected = "one of " + known_model_families(),
                 .found = fmt::format("'{}'", family),
                 .advice =
                     "Update torsio if a newer one has this family. A build with -DTORSIO_FAMILIES "
                     "has only those that it names (docs/robot/library.md): add this one there."});
  }
}

template <class T, class Write>
ordered_json list_of(const std::vector<T>& values, Write write) {
  ordered_json list = ordered_json::array();
  for (const T& value : values) list.push_back(write(value));
  return list;
}

}  // namespace

std::string card_json(const ModelFile& model) {
  const ModelCard& card = model.card;
  const EstimatorSettings& settings = model.settings;
  ordered_json json_card;
  json_card["format_version"] = kModelFormatVersion;
  json_card["torsio_version"] = kVersion;
  json_card["family"] = model.parameters.family();
  json_card["fitted_as"] = card.fitted_as;
  json_card["target"] = settings.target;
  json_card["unit"] = unit_label(settings.target);
  json_card["sample_rate_Hz"] = settings.sample_rate_Hz;
  json_card["inputs"] = settings.features.inputs;
  json_card["definitions"] =
      list_of(settings.features.definitions, [](const ChannelDefinition& definition) {
        return ordered_json{{"name", definition.name}, {"expression", definition.expression}};
      });
  json_card["zeroed_channels"] = settings.zeroed_channels;
  json_card["zeros"] = list_of(card.zeros, [](const ZeroRule& zero) {
    return ordered_json{
        {"channel", zero.channel}, {"first_s", zero.first_s}, {"mid_range", zero.mid_range}};
  });
  if (!card.mapping.empty()) json_card["mapping"] = card.mapping;
  if (card.load_target.is_used()) json_card["load"] = load_target_json(card.load_target);
  json_card["training_files"] = list_of(card.training_files, [](const Source& source) {
    return ordered_json{{"file", source.file}, {"sha256", source.sha256}};
  });
  json_card["held_out"] = card.held_out;
  json_card["metrics"] = card.metrics;
  json_card["device_serial"] = card.device_serial;
  json_card["seed"] = card.seed;
  json_card["options"] = card.options;
  // Bytes that are not UTF-8 (in a file's name) become the replacement character.
  return json_card.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ModelFile model_of_card(std::string_view text, const std::string& place) {
  const json parsed = parse_json(text, place);
  const JsonObject card(parsed, place, kCardAdvice);
  check_card_version(card, place);
  ModelFile model{
      .card = {}, .settings = {}, .parameters = empty_parameters(card.text("family"), place)};
  model.settings.target = card.text("target");
  model.settings.sample_rate_Hz = card.number("sample_rate_Hz");
  model.settings.features.inputs = card.texts("inputs");
  model.settings.features.definitions =
      card.objects("definitions", [](const JsonObject& definition) {
        return ChannelDefinition{definition.text("name"), definition.text("expression")};
      });
  model.settings.zeroed_channels = card.texts("zeroed_channels");
  model.card = {
      .torsio_version = card.text("torsio_version"),
      .fitted_as = card.text("fitted_as"),
      .options = card.text_map("options"),
      .seed = card.whole_number("seed"),
      .training_files = card.objects("training_files",
                                     [](const JsonObject& source) {
                                       return Source{source.text("file"), source.text("sha256")};
                                     }),
      .zeros = card.objects("zeros",
                            [](const JsonObject& zero) {
                              return ZeroRule{zero.text("channel"), zero.number("first_s"),
                                              zero.boolean("mid_range")};
                            }),
      .load_target = card.has("load") ? card.object("load", load_target_of) : LoadTarget{},
      .mapping = card.optional_text("mapping"),
      .held_out = card.text("held_out"),
      .metrics = card.number_map("metrics"),
      .device_serial = card.text("device_serial")};
  return model;
}

}  // namespace torsio
