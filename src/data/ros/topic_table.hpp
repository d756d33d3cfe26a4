#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
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
    if (values.size() <= rows()) row_.push_back(static_cast<std::uint32_t>(column));
    values.resize(rows(), kNotMeasured);
    values.push_back(value);
  }
  /// Ends the row. `stamp_ns`: 0 if the message has none. `number`: place of the message among those of
  /// the file, from 1.
  void end_row(std::int64_t stamp_ns, std::int64_t log_time_ns, std::size_t number,
               ReadBudget& budget) {
    budget.keep(sizeof(double) * (columns_.size() + 4));
    stamps_ns_.push_back(stamp_ns);
    log_times_ns_.push_back(log_time_ns);
    numbers_.push_back(number);
    if (layouts_.empty() || layouts_[layout_] != row_) {
      const auto [known, is_new] = by_layout_.emplace(row_, layouts_.size());
      if (is_new) {
        budget.keep(kColumnBytes + 2 * sizeof(std::uint32_t) * row_.size());
        layouts_.push_back(row_);
      }
      layout_ = known->second;
    }
    layout_of_row_.push_back(layout_);
    row_.clear();
  }
  /// Takes back what the row has so far.
  void drop_row() {
    for (Column& column : columns_) column.values.resize(std::min(column.values.size(), rows()));
    row_.clear();
  }
  /// All columns as long as there are rows.
  void finish() {
    for (Column& column : columns_) column.values.resize(rows(), kNotMeasured);
  }
  /// A message without a stamp, or with 0, has the time at which it was recorded, if no message has a stamp,
  /// or if the others have the clock of the recorder. Simulated time may begin at 0.
  void replace_missing_stamps();
  /// A table for each group of columns that are set in the same rows, with these rows. A column that is not
  /// grouped is in every table in all of whose rows it is set. If every row has every grouped column, the only
  /// table is this one, moved. Columns must not have been removed before.
  /// @param is_grouped for each column
  [[nodiscard]] std::vector<TopicTable> parts(const std::vector<bool>& is_grouped,
                                              ReadBudget& budget);

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
  std::vector<std::int64_t> log_times_ns_;
  std::vector<std::size_t> numbers_;
  // Which columns a message sets: a topic may have publishers of different joints.
  std::vector<std::uint32_t> row_;
  std::vector<std::vector<std::uint32_t>> layouts_;
  std::map<std::vector<std::uint32_t>, std::size_t> by_layout_;
  std::vector<std::size_t> layout_of_row_;
  std::size_t layout_ = 0;  ///< layout of the last row
};

}  // namespace torsio
