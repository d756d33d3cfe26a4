#include "common/report_output.hpp"

#include <fmt/format.h>

#include <iterator>

#include "common/output.hpp"
#include "report/html/linked_report.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/plot/figure_plot.hpp"

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

/// What is wrong with the value of an option; empty: nothing.
template <class Parse>
std::string problem_of(const Parse& parse, const std::string& text) {
  try {
    static_cast<void>(parse(text));
    return {};
  } catch (const torsio::UsageError& error) {
    // CLI11 writes the name of the option before it.
    const std::string problem = error.what();
    return problem.substr(problem.find(": ") + 2);
  }
}

}  // namespace

void keep_command_line(int argc, char** argv) {
  std::string text = "torsio";
  for (int i = 1; i < argc; ++i) text += fmt::format(" {}", shell_word(argv[i]));
  command_line() = text;
}

void ReportOutput::add_page(CLI::App& verb) {
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

void ReportOutput::add(CLI::App& verb, std::string preferred) {
  preferred_figure = std::move(preferred);
  add_page(verb);
  CLI::Option* picture =
      verb.add_option("--plot", plot, "draw a figure of the page for a paper: SVG, PNG or PDF")
          ->option_text("FILE")
          ->check([](const std::string& path) { return problem_of(torsio::plot_format, path); });
  verb.add_option(
          "--plot-figure", plot_figures,
          "all figures with one of these words in their titles, under each other: WORD,WORD")
      ->option_text("WORDS")
      ->delimiter(',')
      ->needs(picture);
  verb.add_option("--plot-size", plot_size, "width and height of a figure (default: 85x64mm)")
      ->option_text("SIZE")
      ->check([](const std::string& text) { return problem_of(torsio::plot_size, text); })
      ->needs(picture);
}

void ReportOutput::write(torsio::ReportDocument document) const {
  if (!plot.empty()) {
    write_text(plot,
               torsio::figure_plot(
                   figures_of(document, plot_figures, preferred_figure), torsio::plot_format(plot),
                   plot_size.empty() ? torsio::PlotSize() : torsio::plot_size(plot_size)));
    remark("figure written to " + plot);
  }
  if (destination.empty()) return;
  std::vector<std::pair<std::string, std::string>> origin = {
      {"command", command_line()},
      {"torsio", torsio::kVersion},
      {"versions of formats", fmt::format("model file {}, JSON {}", torsio::kModelFormatVersion,
                                          torsio::kJsonSchemaVersion)}};
  std::ranges::move(document.origin, std::back_inserter(origin));
  document.origin = std::move(origin);
  write_text(destination, torsio::linked_report_html(document, pages));
  remark("report written to " + destination);
}
