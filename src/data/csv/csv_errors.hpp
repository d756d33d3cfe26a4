#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace torsio {

/// @throws Error at `place` for a cell that is neither a number nor a known text.
[[noreturn]] void refuse_cell(std::string_view cell, const std::string& place,
                              std::string_view column);

/// @throws Error at `place`: one of commas and points would be a thousands separator.
[[noreturn]] void refuse_mixture(const std::string& place);

/// What a row is compared with.
struct HeaderSize {
  std::size_t names = 0;
  std::size_t line = 0;
  char separator = ',';
};

/// @throws Error at `place` for a row with another number of cells than the header.
[[noreturn]] void refuse_cells(const std::string& place, std::size_t found,
                               const HeaderSize& header);

}  // namespace torsio
