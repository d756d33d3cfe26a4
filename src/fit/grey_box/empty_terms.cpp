#include "fit/grey_box/empty_terms.hpp"

#include <cstddef>
#include <utility>
#include <vector>

namespace torsio {
namespace {

/// The columns that stay, in their order.
class KeptColumns {
 public:
  explicit KeptColumns(const Matrix& all) : all_(all) {}

  void keep(std::size_t from, std::size_t to) {
    for (std::size_t j = from; j < to; ++j) kept_.push_back(j);
  }

  /// Keeps the columns of the terms that are not empty.
  /// @param of_terms thresholds or time constants
  /// @param columns of each term, from column `first` on
  /// @returns those of `of_terms` that are kept
  [[nodiscard]] std::vector<double> keep_used(const std::vector<double>& of_terms,
                                              std::size_t first, std::size_t columns) {
    std::vector<double> used;
    for (std::size_t i = 0; i < of_terms.size(); ++i) {
      const std::size_t from = first + i * columns;
      if (is_empty(from, from + columns)) continue;
      keep(from, from + columns);
      used.push_back(of_terms[i]);
    }
    return used;
  }

  [[nodiscard]] Matrix values() const {
    Matrix values(all_.rows, kept_.size());
    for (std::size_t level = 0; level < all_.rows; ++level)
      for (std::size_t j = 0; j < kept_.size(); ++j) values(level, j) = all_(level, kept_[j]);
    return values;
  }

 private:
  [[nodiscard]] bool is_empty(std::size_t from, std::size_t to) const {
    for (std::size_t level = 0; level < all_.rows; ++level)
      for (std::size_t j = from; j < to; ++j)
        if (all_(level, j) != 0.0) return false;
    return true;
  }

  const Matrix& all_;
  std::vector<std::size_t> kept_;
};

}  // namespace

GreyBox::Parameters without_empty_terms(GreyBox::Parameters box) {
  GreyBoxTerms::Structure used = box.terms;
  KeptColumns columns(box.coefficients.values);
  columns.keep(0, box.terms.first_slip());
  if (box.residual)
    columns.keep(box.terms.first_slip(), box.terms.first_relaxation());
  else
    used.thresholds = columns.keep_used(box.terms.thresholds, box.terms.first_slip(),
                                        box.terms.friction_knots.size());
  used.time_constants_s =
      columns.keep_used(box.terms.time_constants_s, box.terms.first_relaxation(), 1);
  columns.keep(box.terms.first_slope(), box.terms.columns());
  box.coefficients.values = columns.values();
  box.terms = std::move(used);
  return box;
}

}  // namespace torsio
