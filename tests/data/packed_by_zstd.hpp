#pragma once

#include <zstd.h>

#include <string>

namespace torsio::test {

inline std::string packed_by_zstd(const std::string& bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

}  // namespace torsio::test
