#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "torsio/core/matrix.hpp"

namespace torsio::test {

using Json = nlohmann::json;

/// A file of this folder.
inline Json golden(const std::string& name) {
  std::ifstream file(std::string(TORSIO_GOLDEN) + "/" + name);
  if (!file) throw std::runtime_error(name + " is missing: ./run oracles writes it");
  return Json::parse(file);
}

inline Matrix matrix(const Json& rows) {
  Matrix all(rows.size(), rows.front().size());
  for (std::size_t i = 0; i < all.rows; ++i)
    for (std::size_t j = 0; j < all.columns; ++j) all(i, j) = rows[i][j].get<double>();
  return all;
}

}  // namespace torsio::test
