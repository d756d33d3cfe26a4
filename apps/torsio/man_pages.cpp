#include "man_pages.hpp"

#include <fmt/format.h>

#include <CLI/Formatter.hpp>
#include <string_view>
#include <vector>

#include "common/output.hpp"
#include "torsio/core/version.hpp"

namespace {

/// Text as roff prints it: no escapes, no requests, minus signs that can be copied.
std::string roff(std::string_view text) {
  std::string page;
  bool starts_line = true;
  for (const char each : text) {
    if (starts_line && (each == '.' || each == '\'')) page += "\\&";
    if (each == '\\')
      page += "\\e";
    else if (each == '-')
      page += "\\-";
    else
      page += each;
    starts_line = each == '\n';
  }
  return page;
}

std::string section(std::string_view title) { return fmt::format(".SH {}\n", title); }

std::string entry(std::string_view term, std::string_view text) {
  return fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(term), roff(text));
}

std::string verbatim(std::string_view text) { return fmt::format(".nf\n{}\n.fi\n", roff(text)); }

/// The usage line of the help, "torsio fit [OPTIONS] [REC...]".
std::string usage(const CLI::App& app, const std::string& name) {
  std::string text = CLI::Formatter().make_usage(&app, name);
  text.erase(0, text.find(name));
  text.erase(text.find_last_not_of(" \n") + 1);
  return text;
}

std::string options(const CLI::App& app, bool are_positionals) {
  const CLI::Formatter formatter;
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty() || option->get_positional() != are_positionals) continue;
    text += entry(option->get_name(are_positionals, true) + formatter.make_option_opts(option),
                  option->get_description());
  }
  return text;
}

/// What the pages of program and verbs have in common, up to their own sections.
std::string head(const CLI::App& app, const std::string& page, const std::string& name) {
  std::string text = fmt::format(".TH \"{}\" 1 \"\" \"torsio {}\" \"User Commands\"\n", roff(page),
                                 torsio::kVersion);
  text += section("NAME") + roff(page) + " \\- " + roff(app.get_description()) + "\n";
  text += section("SYNOPSIS") + verbatim(usage(app, name));
  if (const std::string list = options(app, true); !list.empty())
    text += section("ARGUMENTS") + list;
  text += section("OPTIONS") + options(app, false);
  return text;
}

std::string exit_status() {
  return section("EXIT STATUS") + entry("0", "success") + entry("1", "the work failed") +
         entry("2", "the call was wrong");
}

std::string examples(const CLI::App& app) {
  return app.get_footer().empty() ? "" : section("EXAMPLES") + verbatim(app.get_footer());
}

}  // namespace

namespace {

/// The page of a program or verb and those of its verbs. @param above the page above; empty: none
void write_page(const CLI::App& app, const std::string& folder, const std::string& page,
                const std::string& name, const std::string& above) {
  std::string text = head(app, page, name);
  std::string pages = above.empty() ? "" : fmt::format("\\fB{}\\fR(1)", roff(above));
  const auto verbs = app.get_subcommands([](const CLI::App*) { return true; });
  if (!verbs.empty()) text += section("COMMANDS");
  for (const CLI::App* verb : verbs) {
    const std::string verb_page = page + "-" + verb->get_name();
    text += entry(verb->get_name(), verb->get_description());
    pages += fmt::format("{}\\fB{}\\fR(1)", pages.empty() ? "" : ",\n", roff(verb_page));
    write_page(*verb, folder, verb_page, name + " " + verb->get_name(), page);
  }
  write_text(folder + "/" + page + ".1",
             text + examples(app) + exit_status() + section("SEE ALSO") + pages + "\n");
}

}  // namespace

void write_man_pages(const CLI::App& app, const std::string& folder) {
  write_page(app, folder, app.get_name(), app.get_name(), {});
}
