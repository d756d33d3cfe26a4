#pragma once

#include <string_view>

namespace torsio {

/// As `si_quantity`, but a number without its unit is refused: a length of 10 may be mm or m. All options of the command
/// line are read so. A 0 needs none.
/// @throws UsageError naming `place`.
[[nodiscard]] double signed_quantity_with_unit(std::string_view text, std::string_view expected_si,
                                               std::string_view place);
/// The same for what is never negative. @throws UsageError naming `place`; also if the number is
/// negative.
[[nodiscard]] double quantity_with_unit(std::string_view text, std::string_view expected_si,
                                        std::string_view place);

}  // namespace torsio
