#include "common/wrong_call.hpp"

#include <fmt/format.h>

#include <span>
#include <string_view>
#include <vector>

#include "core/did_you_mean.hpp"

namespace {

/// @param verb "track", "arm identify"; empty: the program itself
std::string refusal(const std::string& verb, std::string_view kind, std::string_view wrong,
                    const std::vector<std::string>& known) {
  const std::string nearest = torsio::did_you_mean(wrong, known);
  return fmt::format("{}there is no {} '{}'. {}{}torsio {}--help lists them.",
                     verb.empty() ? "" : verb + ": ", kind, wrong, nearest,
                     nearest.empty() ? "" : " ", verb.empty() ? "" : verb + " ");
}

std::vector<std::string> names_of(const std::vector<const CLI::App*>& verbs) {
  std::vector<std::string> names;
  names.reserve(verbs.size());
  for (const CLI::App* verb : verbs) names.push_back(verb->get_name());
  return names;
}

std::string unknown_option(const CLI::App& verb, const std::vector<std::string>& left,
                           const std::string& place) {
  std::vector<std::string> known;
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (const std::string& word : left) {
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with('-') && name.size() > 1) return refusal(place, "option", name, known);
  }
  return {};
}

}  // namespace

std::string unknown_name(const CLI::App& app, int argc, char** argv) {
  for (const CLI::App* verb : app.get_subcommands()) {
    const std::string& place = verb->get_name();
    for (const CLI::App* part : verb->get_subcommands())
      return unknown_option(*part, part->remaining(), place + " " + part->get_name());
    const std::vector<std::string> left = verb->remaining();
    // A word after an unknown option is the option's value.
    if (const auto parts = verb->get_subcommands({});
        !parts.empty() && !left.empty() && !left.front().starts_with('-'))
      return refusal(place, "verb", left.front(), names_of(parts));
    return unknown_option(*verb, left, place);
  }
  const std::vector<std::string> verbs = names_of(app.get_subcommands({}));
  for (const char* word : std::span(argv, static_cast<std::size_t>(argc)).subspan(1))
    if (*word != '-') return refusal("", "verb", word, verbs);
  return {};
}
