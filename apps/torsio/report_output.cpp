#include "report_output.hpp"

#include <fmt/format.h>

#include <iterator>

#include "output.hpp"
#include "torsio/core/version.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/json_text.hpp"

namespace {

std::string& command_line() {
  static std::string text;
  return text;
}

/// Quoted for a shell where it must be.
std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=:,+@#%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) {
    if (c == '\'')
      quoted += "'\\''";
    else
      quoted += c;
  }
  return quoted + "'";
}

}  // namespace

void keep_command_line(int argc, char** argv) {
  std::string text = "torsio";
  for (int i = 1; i < argc; ++i) text += fmt::format(" {}", shell_word(argv[i]));
  command_line() = text;
}

void ReportOutput::add(CLI::App& verb) {
  verb.add_option("--report", destination,
                  "write a page with pictures, which a browser opens without a network")
      ->option_text("FILE.html")
      ->check([](const std::string& path) {
        return path.ends_with(".html") || path.ends_with(".htm")
                   ? std::string()
                   : fmt::format("expected a file that ends in .html for --report, found '{}'",
                                 path);
      });
}

void ReportOutput::write(torsio::ReportDocument document) const {
  std::vector<std::pair<std::string, std::string>> origin = {
      {"command", command_line()},
      {"torsio", torsio::kVersion},
      {"versions of formats", fmt::format("model file {}, JSON {}", torsio::kModelFormatVersion,
                                          torsio::kJsonSchemaVersion)}};
  std::ranges::move(document.origin, std::back_inserter(origin));
  document.origin = std::move(origin);
  write_text(destination, torsio::report_html(document));
  remark("report written to " + destination);
}
