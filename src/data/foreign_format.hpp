#pragma once

#include <string>
#include <string_view>

namespace torsio {

/// A name for a command line.
[[nodiscard]] std::string shell_quoted(std::string_view text);

/// The command that converts a file to CSV by pandas. `reader`: "read_excel", or with further arguments:
/// "read_json(lines=True".
[[nodiscard]] std::string advice_by_pandas(std::string_view reader, const std::string& path);

/// @throws Error with the command that converts it, for a file whose first bytes show a format that is not
/// read.
void refuse_foreign_format(std::string_view start, const std::string& path);

}  // namespace torsio
