#pragma once

#include <cstddef>

namespace torsio {

/// P(|T| < t) for Student's distribution.
/// @param degrees_of_freedom at least 1
[[nodiscard]] double student_t_within(double t, std::size_t degrees_of_freedom);

/// t with P(|T| < t) = `probability` for Student's distribution.
/// @param degrees_of_freedom at least 1
[[nodiscard]] double student_t(double probability, std::size_t degrees_of_freedom);

}  // namespace torsio
