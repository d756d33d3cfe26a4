#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "common/report_output.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/design/report.hpp"

/// Where a design is written, for every `torsio design`.
struct DesignOutputs {
  JsonOutput json;
  std::string yaml;
  std::string dxf;
  ReportOutput report;

  /// @param preferred_figure word of the title of the figure that --plot draws; empty: the verb has its own
  void add(CLI::App& verb, bool has_dxf, const std::string& preferred_figure);
  /// Refuses what cannot be written, before any work. @param more further outputs
  void check(const std::vector<std::string>& more = {}) const;
  /// Prints and writes the design. @throws torsio::Error for an infeasible one, after the documents
  /// are written: then nothing else is.
  void write(const torsio::DesignReport& design) const;
};

/// The value of a flag, with its unit. @throws torsio::UsageError; "" is `none`.
[[nodiscard]] double quantity(const std::string& text, const char* unit, const char* flag,
                              double none);
/// The same for a flag that must be given.
[[nodiscard]] double needed(const std::string& text, const char* unit, const char* flag);

/// An option without which a design cannot begin, or two of which one is needed.
struct NeededOption {
  const char* flag;
  const std::string* text;  ///< as given; empty: not given
  const char* example;      ///< "120Nm"
  const char* other_flag = nullptr;
  const std::string* other_text = nullptr;
};
/// @throws torsio::UsageError that names all that are missing, or the first two that exclude each other.
/// @param verb "design spring"
void require_options(const char* verb, const std::vector<NeededOption>& options);

/// The text of a sheet for the file that --sheet names, read again. @throws torsio::UsageError if
/// `simulate` would refuse it, as for a name with a space; "" if no file is named.
[[nodiscard]] std::string sheet_text(const torsio::DataSheet& sheet, const std::string& file);

void add_design_spring(CLI::App& design);
void add_design_actuator(CLI::App& design);
void add_design_coupling(CLI::App& design);
