#pragma once

#include <CLI/App.hpp>
#include <map>
#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"

/// `--report FILE.html`: the result of a verb as a page; `--plot FILE`: figures of this page as a picture.
struct ReportOutput {
  std::string destination;  ///< empty: none
  std::string plot = {};    ///< SVG, PNG or PDF; empty: none
  std::string plot_size = {};
  std::vector<std::string> plot_figures = {};
  std::string preferred_figure = {};  ///< a word of its title
  /// Files beside the page, by the text of the first cell of a row that is a link to it.
  std::map<std::string, std::string> pages = {};

  void add_page(CLI::App& verb);  ///< without --plot
  /// @param preferred is `preferred_figure`
  void add(CLI::App& verb, std::string preferred = {});
  [[nodiscard]] bool is_wanted() const { return !destination.empty() || !plot.empty(); }
  /// Adds the command and the versions to the origin, and writes page and picture completely or not at all.
  void write(torsio::ReportDocument document) const;
};

/// The call, for the reports of this process.
void keep_command_line(int argc, char** argv);
