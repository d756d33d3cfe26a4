#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string>

#include "torsio/core/error.hpp"

namespace torsio {

/// A computed number of samples, its fraction cut off; a time and a rate may give any number.
/// @throws Error at `place` if it is negative, more than `most` or no number.
inline std::size_t whole_samples(double samples, std::size_t most, const std::string& place) {
  if (!(samples >= 0.0 && samples <= static_cast<double>(most)))
    throw Error({.place = place,
                 .expected = fmt::format("at most {} samples", most),
                 .found = fmt::format("{:.6g} samples", samples)});
  return static_cast<std::size_t>(samples);
}

}  // namespace torsio
