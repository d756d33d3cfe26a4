#pragma once

#include <cstddef>
#include <string>

#include "support/dump.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio::test {

/// As a model file holds them, so that this header needs no family's.
inline std::string dump(const AnyParameters& parameters) {
  std::string text(parameters.family());
  for (const std::byte byte : model_bytes({.card = {}, .settings = {}, .parameters = parameters}))
    text += static_cast<char>(byte);
  return text;
}

}  // namespace torsio::test
