#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// A number as Python reads it, rounded to its type.
std::string python_number(double value, int bits);

/// Numbers of one type that a kernel of Warp reads; equal matrices are there once.
class WarpTable {
 public:
  explicit WarpTable(int bits) : bits_(bits) {}

  /// @returns the place of the first number; the others follow, one row after the other
  std::size_t add(const Matrix& values);
  /// All of them as lines of a Python list.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  int bits_;
  std::size_t size_ = 0;
  std::string text_;
  std::map<std::string, std::size_t> known_;
};

}  // namespace torsio
