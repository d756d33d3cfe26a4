#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/did_you_mean.hpp"

namespace torsio {

/// "a, b, c"
[[nodiscard]] std::string joined(std::span<const std::string> names);

/// The same, with the number of those beyond the first `most`.
[[nodiscard]] std::string listed(std::span<const std::string> names, std::size_t most = 20);

/// The text with control bytes escaped, and all bytes above 127 if it is not UTF-8.
[[nodiscard]] std::string escaped(std::string_view text);

/// `escaped`, cut to a readable length, for error messages.
[[nodiscard]] std::string printable(std::string_view text);

/// Whether a name is that pattern, or equals it with any texts in the place of each '*'.
[[nodiscard]] bool is_matched(std::string_view name, std::string_view pattern) noexcept;
[[nodiscard]] bool is_matched_by_any(std::string_view name,
                                     std::span<const std::string> patterns) noexcept;

/// The file's name without folders and without the endings of recordings, mappings and manifests.
[[nodiscard]] std::string file_stem(std::string_view path);

}  // namespace torsio
