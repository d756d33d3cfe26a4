#pragma once

#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// A number of a design, or a text where there is no number.
struct DesignFigure {
  std::string name;             ///< "outer_radius"
  double value = kNotMeasured;  ///< in `unit`
  std::string unit = {};        ///< as printed: "mm", "Nm/rad"; empty for a number without unit
  std::string remark = {};
  std::string text = {};  ///< in place of the value
};

struct DesignSection {
  std::string name = {};  ///< "rounded"
  std::vector<DesignFigure> figures = {};
};

/// One of several designs that meet the same demand or fail it.
struct DesignAlternative {
  std::string name;  ///< "tube"
  bool is_chosen = false;
  std::string infeasible = {};  ///< why it does not meet the demand; empty: it does
  std::vector<DesignFigure> figures =
      {};  ///< their names and units are those of all rows; empty: infeasible
};

/// Alternatives side by side: a row each, their figures as columns.
struct DesignTable {
  std::string name = {};      ///< "kinds"
  std::string row_name = {};  ///< "kind"
  std::vector<DesignAlternative> rows = {};
};

/// The result of a design: what `torsio design` prints and writes.
struct DesignReport {
  std::string design;  ///< "rubber-spring"
  bool is_feasible = true;
  std::string infeasible = {};  ///< the bound that contradicts, and the value that it would need
  std::vector<DesignSection> sections = {};
  std::vector<DesignTable> tables = {};
  std::vector<std::string> notes = {};
  std::vector<ReportFigure> pictures = {};

  /// @throws Error if there is no such figure.
  [[nodiscard]] const DesignFigure& at(const std::string& section, const std::string& name) const;
};

[[nodiscard]] std::string design_text(const DesignReport& report);
/// One JSON object; keys carry their units (docs/use/json.md).
[[nodiscard]] std::string design_json(const DesignReport& report);
/// The same keys as YAML.
[[nodiscard]] std::string design_yaml(const DesignReport& report);
/// The figures as tables, and the pictures.
[[nodiscard]] ReportDocument design_page(const DesignReport& report);

}  // namespace torsio
