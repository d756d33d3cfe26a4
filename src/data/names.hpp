#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// "a, b, c"
[[nodiscard]] std::string joined(std::span<const std::string> names);

/// "Did you mean 'rebuild'?" when one of the names is at most a third of its letters away (edit
/// distance); else empty.
[[nodiscard]] std::string did_you_mean(std::string_view wrong, std::span<const std::string> names);

/// The text with control bytes escaped and cut to a readable length, for error messages.
[[nodiscard]] std::string printable(std::string_view text);

/// The file's name without folders and without `.csv`, `.gz`, `.tsr`, `.yaml`.
[[nodiscard]] std::string file_stem(std::string_view path);

}  // namespace torsio
