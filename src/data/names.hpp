#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/did_you_mean.hpp"

namespace torsio {

/// "a, b, c"
[[nodiscard]] std::string joined(std::span<const std::string> names);

/// The text with control bytes escaped, and all bytes above 127 if it is not UTF-8.
[[nodiscard]] std::string escaped(std::string_view text);

/// `escaped`, cut to a readable length, for error messages.
[[nodiscard]] std::string printable(std::string_view text);

/// The file's name without folders and without the endings of recordings, mappings and manifests.
[[nodiscard]] std::string file_stem(std::string_view path);

}  // namespace torsio
