#include "core/matrix_functions.hpp"

#include <Eigen/Eigenvalues>
#include <unsupported/Eigen/MatrixFunctions>

namespace torsio {

Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& matrix) { return matrix.exp(); }

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(matrix, false).eigenvalues();
}

}  // namespace torsio
