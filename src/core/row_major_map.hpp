#pragma once

#include <Eigen/Core>

#include "torsio/core/matrix.hpp"

namespace torsio {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The numbers of a matrix for Eigen, without a copy.
inline Eigen::Map<const RowMajor> row_major_map(const Matrix& matrix) {
  return {matrix.values.data(), static_cast<Eigen::Index>(matrix.rows),
          static_cast<Eigen::Index>(matrix.columns)};
}

}  // namespace torsio
