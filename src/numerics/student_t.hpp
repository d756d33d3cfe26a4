#pragma once

#include <cstddef>

namespace torsio {

/// t with P(|T| < t) = `probability` for Student's distribution.
/// @param degrees_of_freedom at least 1
[[nodiscard]] double student_t(double probability, std::size_t degrees_of_freedom);

}  // namespace torsio
