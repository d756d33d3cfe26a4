#include "control/design/frequency_response.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "core/row_major_map.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

/// The library's division guards against overflow, which takes most of the time here.
Complex quotient(const Complex& a, const Complex& b) { return a * std::conj(b) / std::norm(b); }

}  // namespace

FrequencyResponse::FrequencyResponse(const LinearSystem& system, std::size_t output,
                                     std::size_t input)
    : order_(system.order()),
      period_s_(1.0 / system.sample_rate_Hz()),
      direct_(system.matrices().d(output, input)),
      hessenberg_(order_ * order_),
      input_(order_),
      output_(order_),
      rows_(order_ * order_),
      states_(order_) {
  if (order_ == 0) return;
  const auto& [a, b, c, d] = system.matrices();
  const Eigen::HessenbergDecomposition<Eigen::MatrixXd> form(row_major_map(a));
  const Eigen::MatrixXd q = form.matrixQ();
  const RowMajor hessenberg = form.matrixH();
  const Eigen::VectorXd of_input =
      q.transpose() * row_major_map(b).col(static_cast<Eigen::Index>(input));
  const Eigen::VectorXd of_output =
      (row_major_map(c).row(static_cast<Eigen::Index>(output)) * q).transpose();
  std::copy_n(hessenberg.data(), hessenberg_.size(), hessenberg_.begin());
  std::copy_n(of_input.data(), order_, input_.begin());
  std::copy_n(of_output.data(), order_, output_.begin());
}

// Gauss elimination of the one entry below each diagonal one, rows exchanged for the larger pivot.
std::complex<double> FrequencyResponse::at(double rad_s) {
  const Complex z = std::polar(1.0, rad_s * period_s_);
  const std::size_t n = order_;
  for (std::size_t i = 0; i < n * n; ++i) rows_[i] = -hessenberg_[i];
  for (std::size_t i = 0; i < n; ++i) {
    rows_[i * n + i] += z;
    states_[i] = input_[i];
  }
  for (std::size_t k = 0; k + 1 < n; ++k) {
    Complex* row = rows_.data() + k * n;
    Complex* below = row + n;
    if (std::norm(below[k]) > std::norm(row[k])) {
      std::swap_ranges(row + k, row + n, below + k);
      std::swap(states_[k], states_[k + 1]);
    }
    const Complex factor = quotient(below[k], row[k]);
    for (std::size_t j = k + 1; j < n; ++j) below[j] -= factor * row[j];
    states_[k + 1] -= factor * states_[k];
  }
  Complex sum = direct_;
  for (std::size_t k = n; k-- > 0;) {
    const Complex* const row = rows_.data() + k * n;
    for (std::size_t j = k + 1; j < n; ++j) states_[k] -= row[j] * states_[j];
    states_[k] = quotient(states_[k], row[k]);
    sum += output_[k] * states_[k];
  }
  return sum;
}

}  // namespace torsio
