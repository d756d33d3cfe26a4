#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "data/mapping/mapping_yaml.hpp"
#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

MappingChoice mapping_choice(const YamlValue& yaml) {
  if (yaml.is_scalar()) return {.file = yaml.text(), .here = {}};
  return {.file = {}, .here = mapping_from(yaml)};
}

Role role_from(const YamlValue& yaml) {
  const std::string text = yaml.text();
  for (const Role role : {Role::train, Role::validation, Role::test})
    if (text == name(role)) return role;
  yaml.refuse("train, validation or test");
}

SplitRule split_rule(const YamlValue& yaml) {
  yaml.allow_only({"interleaved_blocks", "test_every", "contiguous", "embargo"});
  SplitRule rule;
  if (const auto blocks = yaml.find("interleaved_blocks"))
    rule.interleaved_blocks = blocks->count();
  if (const auto every = yaml.find("test_every")) rule.test_every = every->count();
  if (const auto share = yaml.find("contiguous")) {
    rule.contiguous = share->number();
    if (!(rule.contiguous > 0.0 && rule.contiguous < 1.0)) share->refuse("a share between 0 and 1");
  }
  if (const auto embargo = yaml.find("embargo")) rule.embargo_s = embargo->number("s");
  const bool interleaved = rule.interleaved_blocks > 0;
  if (rule.embargo_s < 0.0 || interleaved == (rule.contiguous > 0.0) ||
      interleaved != (rule.test_every > 0))
    yaml.refuse(
        "{interleaved_blocks: 60, test_every: 5, embargo: 50ms} or {contiguous: 0.8, "
        "embargo: 50ms}");
  return rule;
}

std::vector<std::pair<std::string, double>> conditions_from(const YamlValue& yaml) {
  std::vector<std::pair<std::string, double>> conditions;
  for (const auto& [name, value] : yaml.entries()) {
    const std::string si_name = si_channel_name(name, value.place());
    const Unit* unit = split_channel_name(name)->unit;
    conditions.emplace_back(si_name, unit->si(value.number("1")));
  }
  return conditions;
}

std::vector<std::string> inputs_from(const YamlValue& yaml) {
  std::vector<std::string> inputs = yaml.is_scalar() ? split_inputs(yaml.text()) : yaml.texts();
  if (inputs.empty()) yaml.refuse("at least one input");
  for (const std::string& input : inputs)
    if (std::ranges::count(input, '(') != std::ranges::count(input, ')'))
      throw Error({.place = yaml.place(),
                   .problem = "the parentheses do not match",
                   .found = "'" + printable(input) + "'",
                   .advice = "YAML cuts [a, f(b, c)] at every comma: write the set as one line "
                             "without brackets,  plain: a, f(b, c)"});
  return inputs;
}

ManifestFile manifest_file(const YamlValue& yaml) {
  ManifestFile file;
  if (yaml.is_scalar()) {
    file.file = yaml.text();
    return file;
  }
  yaml.allow_only({"file", "name", "role", "split", "mapping", "zero", "conditions"});
  file.file = yaml.at("file").text();
  if (const auto name = yaml.find("name")) file.name = name->text();
  if (const auto role = yaml.find("role")) file.role = role_from(*role);
  if (const auto split = yaml.find("split")) {
    file.split = split_rule(*split);
    if (file.role) split->refuse("either role or split");
  }
  if (const auto mapping = yaml.find("mapping")) file.mapping = mapping_choice(*mapping);
  if (const auto zero = yaml.find("zero")) file.zero = zeros_from(*zero);
  if (const auto conditions = yaml.find("conditions"))
    file.conditions = conditions_from(*conditions);
  return file;
}

/// Refuses a mapping in a recording's place, which has a key that only mappings have.
void refuse_mapping(const YamlValue& yaml) {
  for (const std::string_view key : {"channels", "derive", "drop", "split_by", "clock", "hold"})
    if (yaml.find(key) && !yaml.find("files"))
      throw Error({.place = yaml.place(),
                   .expected = "a recording, or a manifest with files:",
                   .found = fmt::format("a mapping (it has {}:)", key),
                   .advice = "Give it beside the recordings:  --mapping " + yaml.file()});
}

Manifest manifest_from(const YamlValue& yaml) {
  refuse_mapping(yaml);
  yaml.allow_only(
      {"label", "target", "sample_rate_Hz", "root", "mapping", "split", "input_sets", "files"});
  Manifest manifest;
  manifest.file = yaml.file();
  if (const auto label = yaml.find("label")) manifest.label = label->text();
  if (const auto target = yaml.find("target"))
    manifest.target = si_channel_name(target->text(), target->place());
  if (const auto rate = yaml.find("sample_rate_Hz"))
    manifest.sample_rate_Hz = rate->positive_number("Hz");
  if (const auto root = yaml.find("root")) manifest.roots = root->texts();
  if (const auto mapping = yaml.find("mapping")) manifest.mapping = mapping_choice(*mapping);
  if (const auto split = yaml.find("split")) manifest.split = split_rule(*split);
  if (const auto sets = yaml.find("input_sets"))
    for (const auto& [name, inputs] : sets->entries())
      manifest.input_sets.emplace_back(name, inputs_from(inputs));
  const YamlValue files = yaml.at("files");
  for (const YamlValue& file : files.items()) manifest.files.push_back(manifest_file(file));
  if (manifest.files.empty()) files.refuse("at least one file");
  return manifest;
}

/// Puts environment variables in; nothing if one is not set.
std::optional<std::string> expanded(std::string text) {
  for (auto begin = text.find("${"); begin != std::string::npos; begin = text.find("${", begin)) {
    const auto end = text.find('}', begin);
    if (end == std::string::npos) return std::nullopt;
    const std::string variable = text.substr(begin + 2, end - begin - 2);
    // NOLINTNEXTLINE(concurrency-mt-unsafe): the environment is not written
    const char* const value = std::getenv(variable.c_str());
    if (value == nullptr || *value == '\0') return std::nullopt;
    const std::string_view inserted = value;
    text.replace(begin, end + 1 - begin, inserted);
    begin += inserted.size();
  }
  return text;
}

/// A root `${VARIABLE}` or `${VARIABLE}/...` whose variable is set to something else than a folder is a mistake, which the
/// next root would hide.
void require_folder_of_variable(const std::string& root, const std::filesystem::path& beside) {
  const std::size_t end = root.find('}') + 1;
  if (!root.starts_with("${") || (end < root.size() && root[end] != '/')) return;
  const auto folder = expanded(root.substr(0, end));
  std::error_code ignored;
  if (!folder || std::filesystem::is_directory(beside / *folder, ignored)) return;
  const std::string name = root.substr(2, end - 3);
  throw Error({.place = "the environment variable " + name,
               .problem = "it does not name a folder",
               .found = *folder,
               .advice = "Correct it, or unset it:  unset " + name});
}

}  // namespace

Manifest read_manifest(const std::string& path, const Progress& progress) {
  return manifest_from(YamlValue::read(path, progress));
}

Manifest parse_manifest(std::string_view text, const std::string& name) {
  return manifest_from(YamlValue::parse(text, name));
}

std::string data_folder(const Manifest& manifest) {
  const std::filesystem::path own = std::filesystem::path(manifest.file).parent_path();
  if (manifest.roots.empty()) return own.string();
  for (const std::string& root : manifest.roots) {
    const auto folder = expanded(root);
    if (!folder) continue;
    std::error_code ignored;
    if (std::filesystem::is_directory(own / *folder, ignored)) return (own / *folder).string();
    require_folder_of_variable(root, own);
  }
  throw Error({.place = manifest.file + " (root)",
               .problem = "the data are not here",
               .expected = "one of these folders: " + joined(manifest.roots),
               .advice = "A variable in ${...} is used only if it is set:  export "
                         "TORSIO_DATA=/folder/of/the/data"});
}

}  // namespace torsio
