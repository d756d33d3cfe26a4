#pragma once

#include <Eigen/Core>

namespace torsio {

// Functions of square matrices. They are compiled once, since Eigen's templates for them are large.

[[nodiscard]] Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& matrix);
[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);

}  // namespace torsio
