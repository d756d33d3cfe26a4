#include "files/card_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "files/family_names.hpp"
#include "files/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/not_measured.hpp"
#include "torsio/core/units.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// One JSON object with its place, for messages.
class CardObject {
 public:
  CardObject(const json& object, std::string place) : object_(object), place_(std::move(place)) {
    if (!object_.is_object()) refuse(place_, "an object", object_);
  }

  [[nodiscard]] std::string text(const char* key) const {
    return text_of(member(key), place_of(key));
  }
  /// Empty where there is none: a file of an earlier release.
  [[nodiscard]] std::string optional_text(const char* key) const {
    return object_.contains(key) ? text(key) : std::string();
  }
  [[nodiscard]] double number(const char* key) const {
    return number_of(member(key), place_of(key));
  }
  [[nodiscard]] bool boolean(const char* key) const {
    const json& value = member(key);
    if (!value.is_boolean()) refuse(place_of(key), "true or false", value);
    return value.get<bool>();
  }
  [[nodiscard]] std::uint64_t whole_number(const char* key) const {
    const json& value = member(key);
    if (!value.is_number_unsigned()) refuse(place_of(key), "a whole number from 0", value);
    return value.get<std::uint64_t>();
  }
  [[nodiscard]] std::vector<std::string> texts(const char* key) const {
    std::vector<std::string> result;
    each(key, [&](const json& value, const std::string& place) {
      result.push_back(text_of(value, place));
    });
    return result;
  }
  /// One `read(CardObject)` for each object of a list.
  template <class Read>
  [[nodiscard]] auto objects(const char* key, Read read) const {
    std::vector<decltype(read(*this))> result;
    each(key, [&](const json& value, const std::string& place) {
      result.push_back(read(CardObject(value, place)));
    });
    return result;
  }
  [[nodiscard]] std::map<std::string, std::string> text_map(const char* key) const {
    return map<std::string>(key, text_of);
  }
  [[nodiscard]] std::map<std::string, double> number_map(const char* key) const {
    return map<double>(key, number_of);
  }

 private:
  [[noreturn]] static void refuse(const std::string& place, std::string expected,
                                  const json& found) {
    throw Error({.place = place,
                 .expected = std::move(expected),
                 .found = found.is_structured() ? found.type_name() : found.dump(),
                 .advice = "The card is damaged: fit the model again."});
  }
  static std::string text_of(const json& value, const std::string& place) {
    if (!value.is_string()) refuse(place, "a text", value);
    return value.get<std::string>();
  }
  /// JSON has no NaN: it is written as null.
  static double number_of(const json& value, const std::string& place) {
    if (value.is_null()) return kNotMeasured;
    if (!value.is_number()) refuse(place, "a number", value);
    return value.get<double>();
  }

  [[nodiscard]] std::string place_of(const char* key) const {
    return fmt::format("{}/{}", place_, key);
  }
  [[nodiscard]] const json& member(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end())
      throw Error({.place = place_of(key),
                   .expected = "an entry",
                   .found = "none",
                   .advice = "The card is incomplete: fit the model again."});
    return *found;
  }
  template <class Visit>
  void each(const char* key, Visit visit) const {
    const json& list = member(key);
    if (!list.is_array()) refuse(place_of(key), "a list", list);
    for (std::size_t i = 0; i < list.size(); ++i)
      visit(list[i], fmt::format("{}/{}", place_of(key), i));
  }
  template <class T, class Read>
  std::map<std::string, T> map(const char* key, Read read) const {
    const json& entries = member(key);
    if (!entries.is_object()) refuse(place_of(key), "an object", entries);
    std::map<std::string, T> result;
    for (const auto& [name, value] : entries.items())
      result[name] = read(value, fmt::format("{}/{}", place_of(key), name));
    return result;
  }

  const json& object_;
  std::string place_;
};

/// Before anything else is read: another version may mean anything.
void check_version(const CardObject& card, const std::string& place) {
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
                     "has only those that it names (docs/library.md): add this one there."});
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
  const CardObject card(parsed, place);
  check_version(card, place);
  ModelFile model{
      .card = {}, .settings = {}, .parameters = empty_parameters(card.text("family"), place)};
  model.settings.target = card.text("target");
  model.settings.sample_rate_Hz = card.number("sample_rate_Hz");
  model.settings.features.inputs = card.texts("inputs");
  model.settings.features.definitions =
      card.objects("definitions", [](const CardObject& definition) {
        return ChannelDefinition{definition.text("name"), definition.text("expression")};
      });
  model.settings.zeroed_channels = card.texts("zeroed_channels");
  model.card = {
      .torsio_version = card.text("torsio_version"),
      .fitted_as = card.text("fitted_as"),
      .options = card.text_map("options"),
      .seed = card.whole_number("seed"),
      .training_files = card.objects("training_files",
                                     [](const CardObject& source) {
                                       return Source{source.text("file"), source.text("sha256")};
                                     }),
      .zeros = card.objects("zeros",
                            [](const CardObject& zero) {
                              return ZeroRule{zero.text("channel"), zero.number("first_s"),
                                              zero.boolean("mid_range")};
                            }),
      .mapping = card.optional_text("mapping"),
      .held_out = card.text("held_out"),
      .metrics = card.number_map("metrics"),
      .device_serial = card.text("device_serial")};
  return model;
}

}  // namespace torsio
