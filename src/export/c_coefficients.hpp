#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "export/c_text.hpp"
#include "model/common/schedule.hpp"

namespace torsio {

/// Coefficients of a model in the C program: a table, or several rows between which a feature interpolates.
class CCoefficients {
 public:
  /// Writes its tables and functions. @param name of the table
  CCoefficients(CText& c, std::string name, const CoefficientSchedule& schedule);

  /// Statements that find the place between the rows, before the first `at`; empty if there is one row. Schedules over
  /// the same knots share one.
  [[nodiscard]] std::string locate() const;
  /// @param column a C expression
  [[nodiscard]] std::string at(const std::string& column) const;
  [[nodiscard]] bool is_scheduled() const noexcept { return is_scheduled_; }

 private:
  CText* c_;
  std::string name_;
  std::size_t feature_ = 0;
  std::vector<double> knots_;
  bool is_scheduled_ = false;
};

}  // namespace torsio
