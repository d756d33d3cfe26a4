#pragma once

#include <string>

#include "files/known_families.hpp"
#include "support/dump.hpp"

namespace torsio::test {

inline std::string dump(const AnyParameters& parameters) {
  std::string text;
  with_own_type(parameters, [&](const auto& own) { text = dump(own); });
  return text;
}

}  // namespace torsio::test
