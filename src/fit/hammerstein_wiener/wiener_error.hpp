#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// All factors `curve.basis(i, x)` at once.
void fill_basis(const StaticCurve& curve, double x, std::span<double> basis);

/// One record: the samples at which a model is stepped.
struct WienerRecord {
  std::vector<double> input;
  std::vector<double> target;  ///< finite where scored
  std::vector<std::uint8_t> scored;
};

struct WienerData {
  std::vector<WienerRecord> records;
  double sample_period_s = 0.0;
  Interval range;           ///< range of the scored inputs
  double rest_input = 0.0;  ///< the input of that range that is nearest 0
  double deviation = 0.0;   ///< standard deviation of the scored targets

  [[nodiscard]] std::size_t scored_samples() const;
  /// Radius within which a search keeps poles: a mode that decays more slowly than over ten times
  /// the longest record cannot be distinguished from one that never decays.
  [[nodiscard]] double slowest_pole() const;
};

/// The first so many samples of each record, about so many together.
[[nodiscard]] WienerData front_of(const WienerData& data, std::size_t samples);

/// The first input, the target and what may be learned from.
[[nodiscard]] WienerData wiener_data(const TrainingData& data);

/// A Hammerstein-Wiener model while it is fitted. Gauges: w = P(u) - P(rest_input), and one value of P
/// and one numerator coefficient of each section are held.
struct WienerNumbers {
  StaticCurve input;
  Sections sections;
  StaticCurve output;
  Matrix start;  ///< states at the start of each record; no rows: at rest in all of them
};

/// A cascade from rest over a signal, section by section.
class SectionCascade {
 public:
  explicit SectionCascade(Sections sections)
      : sections_(std::move(sections)), state_(2 * sections_.rows, 0.0) {}
  void set_state(std::span<const double> state) { state_.assign(state.begin(), state.end()); }
  /// In place, from section `first` on.
  void run(std::span<double> signal, std::size_t first = 0);
  /// One section only; `is_all_pole`: 1 / F.
  void run_section(std::size_t section, bool is_all_pole, std::span<double> signal);

 private:
  Sections sections_;
  std::vector<double> state_;
};

/// Which value of P only shifts w: the constant, or that of the knot next to rest.
[[nodiscard]] std::size_t shifting_value(const StaticCurve& input, double rest_input);

/// What of a model moves in a search.
enum class WienerFree : std::uint8_t {
  /// Every value of P but the shifting one and the largest other, every section coefficient that is not
  /// 0 and not the largest of its numerator, every value of C.
  model,
  sections,  ///< all coefficients of G; the curves stay
};

/// The simulation error y(numbers) - target over all records and what it does when numbers change, by
/// the sensitivities of specification 3.5 run as filters:
///
///     dx/db_ik =  z^-k (prod_j>i G_j) x_i-1 / F_i      dx/dv_k = G phi_k(u)
///     dx/da_ik = -z^-k (prod_j>i G_j) x_i / F_i         dx/ds_i1 = (prod_j>i G_j) delta / F_i
///     dy/dtheta = C'(x) dx/dtheta,  dy/dc_k = phi_k(x)
class WienerError {
 public:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

  /// @param data outlives this. The starts move, too, if there are any.
  WienerError(const WienerData& data, WienerNumbers numbers, WienerFree free = WienerFree::model);

  [[nodiscard]] std::size_t size() const { return names_.size(); }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// The number of the model's parameters, without the starts.
  [[nodiscard]] std::size_t model_size() const { return model_size_; }
  [[nodiscard]] std::vector<double> pack(const WienerNumbers& numbers) const;
  [[nodiscard]] WienerNumbers unpack(std::span<const double> packed) const;
  [[nodiscard]] std::size_t sections() const { return frame_.sections.rows; }
  [[nodiscard]] std::size_t scored_samples() const { return data_.scored_samples(); }
  [[nodiscard]] double slowest_pole() const { return data_.slowest_pole(); }
  /// Positions of the coefficients a1, a2 of the sections in the packed numbers; kNowhere: not
  /// free.
  [[nodiscard]] std::pair<std::size_t, std::size_t> poles_at(std::size_t section) const;
  /// Position of the section coefficient; kNowhere: not free.
  [[nodiscard]] std::size_t at(std::size_t section, std::size_t column) const;

  /// sum of squares over the scored samples; NaN if it diverges.
  [[nodiscard]] double sum_of_squares(const WienerNumbers& numbers) const;
  /// [J r]^T [J r], (size + 1)^2. @returns false if it diverges
  [[nodiscard]] bool products(const WienerNumbers& numbers, Matrix& gram) const;
  /// J r themselves, one row per scored sample: for tests.
  [[nodiscard]] Matrix rows(const WienerNumbers& numbers) const;
  /// x of the scored samples of all records.
  [[nodiscard]] std::vector<double> inner(const WienerNumbers& numbers) const;

 private:
  class Sensitivities;
  template <class Take>
  bool pass(const WienerNumbers& numbers, bool with_slopes, const Take& take) const;
  void fill_slopes(const WienerNumbers& numbers, std::size_t r, std::size_t count,
                   const Sensitivities& of, std::span<double> block) const;

  const WienerData& data_;
  WienerNumbers frame_;
  std::vector<std::size_t> input_free_;
  std::vector<std::pair<std::size_t, std::size_t>> section_free_;
  std::size_t output_free_ = 0;
  std::vector<std::string> names_;
  std::size_t model_size_ = 0;
  std::vector<Matrix> basis_;  ///< per record: one row per value of P, less its value at rest
};

}  // namespace torsio
