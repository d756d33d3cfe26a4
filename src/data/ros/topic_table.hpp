#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "data/read_budget.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {

/// The messages of one topic as rows. A field that a message does not have is NaN there.
class TopicTable {
 public:
  struct Column {
    std::string name;
    std::vector<double> values;
  };

  /// The column of that name; made, with NaN in the rows so far, if it is new.
  std::size_t column(const std::string& name, ReadBudget& budget) {
    if (const auto at = by_name_.find(name); at != by_name_.end()) return at->second;
    budget.keep(kColumnBytes + 2 * name.size() + sizeof(double) * rows());
    by_name_.emplace(name, columns_.size());
    columns_.push_back({name, {}});
    return columns_.size() - 1;
  }
  /// The value in the row that is being made; the last one counts.
  void set(std::size_t column, double value) {
    std::vector<double>& values = columns_[column].values;
    values.resize(stamps_ns_.size(), kNotMeasured);
    if (values.size() == stamps_ns_.size()) values.push_back(value);
  }
  /// Ends the row. `number`: place of the message among those of the file, from 1.
  void end_row(std::int64_t stamp_ns, std::size_t number, ReadBudget& budget) {
    budget.keep(sizeof(double) * (columns_.size() + 2));
    stamps_ns_.push_back(stamp_ns);
    numbers_.push_back(number);
  }
  /// Takes back what the row has so far.
  void drop_row() {
    for (Column& column : columns_)
      column.values.resize(std::min(column.values.size(), stamps_ns_.size()));
  }
  /// All columns as long as there are rows.
  void finish() {
    for (Column& column : columns_) column.values.resize(stamps_ns_.size(), kNotMeasured);
  }

  [[nodiscard]] std::size_t rows() const noexcept { return stamps_ns_.size(); }
  [[nodiscard]] std::vector<Column>& columns() noexcept { return columns_; }
  [[nodiscard]] const std::vector<Column>& columns() const noexcept { return columns_; }
  [[nodiscard]] const std::vector<std::int64_t>& stamps_ns() const noexcept { return stamps_ns_; }
  [[nodiscard]] const std::vector<std::size_t>& numbers() const noexcept { return numbers_; }

 private:
  static constexpr std::size_t kColumnBytes = 200;  ///< besides name and values

  std::vector<Column> columns_;
  std::unordered_map<std::string, std::size_t> by_name_;
  std::vector<std::int64_t> stamps_ns_;
  std::vector<std::size_t> numbers_;
};

}  // namespace torsio
