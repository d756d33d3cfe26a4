#include "completion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <vector>

#include "studies/studies.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "verbs.hpp"

namespace {

std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
}

/// "--json", "-o": every name of the options that the help shows.
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty() || option->get_positional()) continue;
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// The first line of a help text between single quotes.
std::string quoted(const std::string& help) {
  std::string text = help.substr(0, help.find('\n'));
  std::erase(text, '\'');
  return "'" + text + "'";
}

/// "list", "describe": the verbs below a verb.
std::vector<std::string> part_names(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::App* part : verbs_of(verb)) names.push_back(part->get_name());
  return names;
}

std::string actuator_words() {
  std::vector<std::string> words;
  for (const torsio::DataSheet& sheet : torsio::data_sheets()) {
    words.push_back(sheet.name);
    for (const std::string_view variant : sheet.variants)
      if (!variant.empty()) words.push_back(fmt::format("{}:{}", sheet.name, variant));
  }
  return fmt::format("{}", fmt::join(words, " "));
}

std::string experiment_words() {
  std::set<std::string_view> names;
  for (const torsio::ExperimentInfo& info : torsio::experiments()) names.insert(info.name);
  return fmt::format("{}", fmt::join(names, " "));
}

std::string family_words() {
  std::vector<std::string_view> names;
  for (const torsio::FamilyInfo& family : torsio::families()) names.push_back(family.name);
  return fmt::format("{}", fmt::join(names, " "));
}

std::string study_words() {
  std::vector<std::string_view> names;
  for (const torsio::StudyInfo& study : torsio::studies()) names.push_back(study.name);
  return fmt::format("{}", fmt::join(names, " "));
}

/// An argument of a verb whose values have names, which the shell offers besides files.
struct NamedValues {
  std::string verb;
  std::string argument;  ///< an option with its dashes, or the place of a positional: "1"
  std::string words;
};

std::vector<NamedValues> named_values(const CLI::App& app) {
  std::vector<NamedValues> all = {{"simulate", "1", actuator_words()},
                                  {"simulate", "2", experiment_words()},
                                  {"simulate", "--describe", actuator_words()},
                                  {"joint", "1", actuator_words()},
                                  {"fit", "--model", family_words()},
                                  {"drift", "--model", family_words()},
                                  {"reproduce", "1", study_words()},
                                  {"completion", "1", "bash zsh fish"},
                                  {"search", "--halving", "family all off"},
                                  {"search", "--engine", "local slurm"},
                                  {"track", "--joint-output", "locked free"},
                                  {"track", "--acts-on", "current velocity"}};
  std::vector<std::string_view> references(torsio::reference_names().begin(),
                                           torsio::reference_names().end());
  all.push_back({"track", "--reference", fmt::format("{}", fmt::join(references, " "))});
  for (const CLI::App* verb : verbs_of(app)) {
    const std::string name = verb->get_name();
    if (verb->get_option_no_throw("--actuator") != nullptr)
      all.push_back({name, "--actuator", actuator_words()});
    if (verb->get_option_no_throw("--models") != nullptr)
      all.push_back({name, "--models", "all search " + family_words()});
  }
  return all;
}

/// The pattern, for bash and zsh, of "VERB BEFORE PLACE": a verb, the word before the one that is completed, and its
/// place. What follows an option is its value, not a positional.
std::string pattern_of(const NamedValues& values) {
  return values.argument.starts_with("-")
             ? fmt::format("'{} {} '*", values.verb, values.argument)
             : fmt::format("'{} '[!-]*' {}'", values.verb, values.argument);
}

/// The values after an option and in the places of positionals.
std::string bash_values(const CLI::App& app) {
  std::string cases;
  for (const NamedValues& each : named_values(app))
    cases += fmt::format("    {}) values='{}' ;;\n", pattern_of(each), each.words);
  return cases;
}

/// The options of a verb and, where it has verbs below it, a case for each of those.
std::string bash_words(const CLI::App& verb) {
  std::string own = fmt::format("words='{}'", fmt::join(option_names(verb), " "));
  const std::vector<std::string> parts = part_names(verb);
  if (parts.empty()) return own;
  std::string cases;
  for (const CLI::App* part : verbs_of(verb))
    cases += fmt::format("      {}) words='{}' ;;\n", part->get_name(),
                         fmt::join(option_names(*part), " "));
  return fmt::format("parts='{}'; case ${{typed[2]}} in\n{}      *) {} ;;\n    esac",
                     fmt::join(parts, " "), cases, own);
}

std::string bash_script(const CLI::App& app) {
  std::string cases;
  std::string verbs;
  for (const CLI::App* verb : verbs_of(app)) {
    verbs += verb->get_name() + " ";
    cases += fmt::format("    {}) {} ;;\n", verb->get_name(), bash_words(*verb));
  }
  // Bash divides what is typed at : and =, and replaces only the part after them: dfki-28:lugre is three words there.
  return fmt::format(
      "_torsio() {{\n"
      "  local words parts values typed=() word is_joined= has_value=\n"
      "  for word in \"${{COMP_WORDS[@]:0:COMP_CWORD+1}}\"; do\n"
      "    if [[ $word == '=' ]]; then has_value=1; continue; fi\n"
      "    if [[ $word == ':' || $is_joined ]]; then typed[${{#typed[@]}}-1]+=$word\n"
      "    else typed+=(\"$word\"); fi\n"
      "    is_joined= has_value=\n"
      "    if [[ $word == ':' ]]; then is_joined=1; fi\n"
      "  done\n"
      "  if [[ $has_value ]]; then typed+=(''); fi\n"
      "  local place=$((${{#typed[@]}} - 2))\n"
      "  local current=${{typed[place+1]}} before=${{typed[place]}} fixed=\n"
      "  if [[ $is_joined ]]; then fixed=$current\n"
      "  elif [[ ! $has_value ]]; then fixed=${{current%\"${{COMP_WORDS[COMP_CWORD]}}\"}}; fi\n"
      "  case ${{typed[1]}} in\n{}  esac\n"
      "  case \"${{typed[1]}} $before $place\" in\n{}  esac\n"
      "  if ((place == 0)); then words='{}{}'\n"
      "  elif ((place == 1)) && [[ $parts && $current != -* ]]; then words=$parts\n"
      "  elif [[ $current != -* ]]; then words=$values; fi\n"
      "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "  if [[ $fixed ]]; then COMPREPLY=(\"${{COMPREPLY[@]#\"$fixed\"}}\"); fi\n"
      "}}\n"
      "complete -o default -F _torsio torsio\n",
      cases, bash_values(app), verbs, fmt::join(option_names(app), " "));
}

/// As `bash_words`.
std::string zsh_words(const CLI::App& verb) {
  std::string own = fmt::format("compadd -- {}", fmt::join(option_names(verb), " "));
  if (part_names(verb).empty()) return own;
  std::string cases;
  for (const CLI::App* part : verbs_of(verb))
    cases += fmt::format("        {}) compadd -- {} ;;\n", part->get_name(),
                         fmt::join(option_names(*part), " "));
  return fmt::format("case $words[3] in\n{}        *) {} ;;\n      esac", cases, own);
}

/// As `bash_values`; files are offered as well.
std::string zsh_values(const CLI::App& app) {
  std::string cases;
  for (const NamedValues& each : named_values(app))
    cases += fmt::format("      {}) compadd -- {} ;;\n", pattern_of(each), each.words);
  return cases;
}

std::string zsh_script(const CLI::App& app) {
  std::string verbs;
  std::string parts;
  std::string cases;
  for (const CLI::App* verb : verbs_of(app)) {
    std::string help = verb->get_description();
    std::ranges::replace(help, ':', ';');
    verbs += fmt::format("    {}\n", quoted(verb->get_name() + ":" + help));
    cases += fmt::format("      {}) {} ;;\n", verb->get_name(), zsh_words(*verb));
    if (const auto names = part_names(*verb); !names.empty())
      parts += fmt::format("      {}) compadd -- {} ;;\n", verb->get_name(), fmt::join(names, " "));
  }
  // --model=NAME is one word; what is before the value is set aside. A file of the search path of functions is run when
  // its name is first completed, and completes this word as well.
  return fmt::format(
      "#compdef torsio\n_torsio() {{\n  local -a verbs=(\n{}  )\n"
      "  local before=$words[CURRENT-1] is_joined=\n"
      "  if [[ $words[CURRENT] == --?*=* ]]; then\n"
      "    before=${{words[CURRENT]%%=*}} is_joined=1\n    compset -P '*='\n  fi\n"
      "  if ((CURRENT == 2)); then\n    if [[ $words[2] == -* ]]; then compadd -- {}\n"
      "    else _describe verb verbs; fi\n"
      "  elif [[ $words[CURRENT] == -* && ! $is_joined ]]; then\n    case $words[2] in\n{}    "
      "esac\n"
      "  else\n    if ((CURRENT == 3)) && [[ ! $is_joined ]]; then\n      case $words[2] in\n{}    "
      "  esac\n    fi\n"
      "    case \"$words[2] $before $((CURRENT - 2))\" in\n{}    esac\n"
      "    _files\n  fi\n}}\n"
      "if [[ $funcstack[1] == _torsio ]]; then\n  _torsio \"$@\"\nelse\n"
      "  if ((! $+functions[compdef])); then autoload -Uz compinit && compinit -i; fi\n"
      "  compdef _torsio torsio\nfi\n",
      verbs, fmt::join(option_names(app), " "), cases, parts, zsh_values(app));
}

/// @param condition when the options apply, for example that a verb was typed
/// @param values of the whole program
std::string fish_options(const CLI::App& verb, const std::string& condition,
                         const std::vector<NamedValues>& values) {
  std::string script;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_group().empty() || option->get_positional()) continue;
    script += fmt::format("complete -c torsio -n '{}'", condition);
    for (const std::string& name : option->get_snames()) script += " -s " + name;
    for (const std::string& name : option->get_lnames()) script += " -l " + name;
    if (option->get_items_expected_max() > 0) script += " -r";
    for (const NamedValues& each : values)
      if (each.verb == verb.get_name() && each.argument == option->get_name())
        script += fmt::format(" -a '{}'", each.words);
    script += fmt::format(" -d {}\n", quoted(option->get_description()));
  }
  return script;
}

std::string fish_script(const CLI::App& app) {
  std::string script = "complete -c torsio -n __fish_use_subcommand -f\n";  // a verb, no file
  const std::vector<NamedValues> values = named_values(app);
  script += fish_options(app, "__fish_use_subcommand", values);
  for (const CLI::App* verb : verbs_of(app)) {
    const std::string is_typed = "__fish_seen_subcommand_from " + verb->get_name();
    script += fmt::format("complete -c torsio -n __fish_use_subcommand -a {} -d {}\n",
                          verb->get_name(), quoted(verb->get_description()));
    script += fish_options(*verb, is_typed, values);
    for (const NamedValues& each : values)
      if (each.verb == verb->get_name() && !each.argument.starts_with("-"))
        script += fmt::format(
            "complete -c torsio -n '{}; and test (count (commandline -opc)) -eq {}' -a '{}'\n",
            is_typed, std::stoi(each.argument) + 1, each.words);
    const std::string parts = fmt::format("{}", fmt::join(part_names(*verb), " "));
    for (const CLI::App* part : verbs_of(*verb)) {
      script += fmt::format(
          "complete -c torsio -n '{0}; and not __fish_seen_subcommand_from {1}' -a {2} -d {3}\n",
          is_typed, parts, part->get_name(), quoted(part->get_description()));
      script += fish_options(
          *part, fmt::format("{}; and __fish_seen_subcommand_from {}", is_typed, part->get_name()),
          values);
    }
  }
  return script;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  if (shell == "bash") return bash_script(app);
  if (shell == "zsh") return zsh_script(app);
  if (shell == "fish") return fish_script(app);
  throw torsio::UsageError(
      {.place = "torsio completion", .expected = "bash, zsh or fish", .found = shell});
}
