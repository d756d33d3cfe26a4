#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "data/log_table.hpp"

namespace torsio {

/// One column of numbers of a file that stores arrays by name.
struct NamedArray {
  std::string name;  ///< "log.q_rad"; "log.q/2" for the third column of a matrix
  std::vector<double> values;
  TimeKind time = TimeKind::none;
};

/// What a reader of arrays found.
struct ReadArrays {
  std::vector<NamedArray> arrays;
  std::vector<std::string> not_read = {};  ///< "z (complex numbers)"
};

/// An array of any number of dimensions as rows in time and columns.
struct MatrixShape {
  std::size_t rows = 1;
  std::size_t columns = 1;
  bool is_turned = false;  ///< the first dimension has the columns
};

/// Nothing if there are more than two dimensions that are longer than 1. Of an array of two dimensions the
/// first is the time; of one with more, such as n x 1 x T, it is the longer one.
[[nodiscard]] std::optional<MatrixShape> as_matrix(std::span<const std::size_t> dimensions);

/// Numbers that a reader of arrays takes at most, as of a CSV file.
inline constexpr std::size_t kMaxArrayValues = std::size_t{256} << 20;

/// Why an array of these dimensions is not read; empty if it is.
[[nodiscard]] std::string problem_of_shape(std::span<const std::size_t> dimensions);

/// Splits a matrix of rows x columns into arrays `name/0`, `name/1`, ..; a single row or column is an
/// array of its own. `at(row, column)` returns a value.
template <class At>
void add_columns(std::vector<NamedArray>& arrays, const std::string& name, std::size_t rows,
                 std::size_t columns, const At& at) {
  const bool is_row = rows == 1;
  const std::size_t length = is_row ? columns : rows;
  const std::size_t count = is_row ? 1 : columns;
  for (std::size_t i = 0; i < count; ++i) {
    NamedArray& made = arrays.emplace_back();
    made.name = count == 1 ? name : name + "/" + std::to_string(i);
    made.values.reserve(length);
    for (std::size_t j = 0; j < length; ++j) made.values.push_back(is_row ? at(0, j) : at(j, i));
  }
}

/// The arrays as columns of a table. All arrays in `wanted` must have one length, and of the others only
/// arrays of this length whose names have a unit become columns; without `wanted` all must have one
/// length, except that single numbers are left out. "q/0" may be an array "q" of one column.
/// @throws Error that lists the arrays with their lengths if one is missing or they differ.
[[nodiscard]] LogTable table_of_arrays(ReadArrays read, const std::string& file,
                                       const std::vector<std::string>& wanted);

}  // namespace torsio
