#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "data/log_table.hpp"

namespace torsio {

/// The place of a cell in messages.
[[nodiscard]] std::string csv_place(const std::string& file, std::size_t line,
                                    const LogColumn& column);

/// @throws Error at `place` for a cell that is neither a number nor a known text.
[[noreturn]] void refuse_cell(std::string_view cell, const std::string& place,
                              std::string_view column);

/// @throws Error at `place`: one of commas and points would be a thousands separator.
[[noreturn]] void refuse_mixture(const std::string& place);

/// @throws Error at `place` for a number whose marks are not those that the mapping states ("comma", "point").
[[noreturn]] void refuse_other_mark(std::string_view cell, const std::string& place,
                                    std::string_view stated);

/// @throws Error at `place`: each comma of the file is followed by three digits, so it may precede decimals or
/// separate thousands.
[[noreturn]] void refuse_unclear_commas(std::string_view cell, const std::string& place,
                                        bool is_only_above_thousand);

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
