#pragma once

#include <CLI/App.hpp>
#include <string>

#include "torsio/report/html/report_document.hpp"

/// `--report FILE.html`: the result of a verb as a page.
struct ReportOutput {
  std::string destination;  ///< empty: none

  void add(CLI::App& verb);
  [[nodiscard]] bool is_wanted() const { return !destination.empty(); }
  /// Adds the command and the versions to the origin, and writes the page completely or not at all.
  void write(torsio::ReportDocument document) const;
};

/// The call, for the reports of this process.
void keep_command_line(int argc, char** argv);
