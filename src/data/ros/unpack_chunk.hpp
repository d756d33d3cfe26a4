#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "data/read_budget.hpp"

namespace torsio {

/// The contents of a chunk that was packed by "lz4", "zstd", "bz2" or not at all ("", "none").
/// @returns false unless they are exactly `size` bytes, or if `packing` is another one
[[nodiscard]] bool unpack_chunk(std::string_view packing, std::string_view packed, std::size_t size,
                                std::string& unpacked);

/// The contents of a message that is a frame of zstd, which states their size.
/// @returns false if it is damaged. @throws Error beyond the budget.
[[nodiscard]] bool unpack_message(std::string_view packed, ReadBudget& budget,
                                  std::string& unpacked);

/// The packings that `unpack_chunk` reads, for messages.
inline constexpr std::string_view kKnownPackings = "none, lz4, zstd, bz2";

}  // namespace torsio
