#include "fit/viscoelastic/viscoelastic_error.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "model/viscoelastic/relaxation_step.hpp"

namespace torsio {
namespace {

/// A spectrum of at most `Count` branches at one sample period; gain and decay of those missing are 0.
template <std::size_t Count>
struct Steps {
  std::array<double, Count> decay{};
  std::array<double, Count> gain{};
  double offset = 0.0;
  double stiffness = 0.0;
  double slope = 0.0;

  Steps(const RelaxationSpectrum& spectrum, double start, double period_s)
      : offset(start), stiffness(spectrum.stiffness), slope(spectrum.damping / period_s) {
    for (std::size_t i = 0; i < spectrum.branches.size(); ++i) {
      const RelaxationStep step = relaxation_step(spectrum.branches[i], period_s);
      decay[i] = step.decay;
      gain[i] = step.gain;
    }
  }
};

/// min |r + E z|^2 + w |z|^2 over the state z at the start, E the outputs that it adds: exp(-p t).
/// The last term is for states that no scored sample determines.
template <std::size_t Count>
class StartState {
 public:
  StartState(const std::array<double, Count>& decay, std::size_t branches)
      : decay_(decay), branches_(branches) {
    restart();
  }

  void advance() {
    for (std::size_t i = 0; i < Count; ++i) share_[i] *= decay_[i];
  }
  void add(double residual) {
    for (std::size_t i = 0; i < Count; ++i) {
      right_[i] -= share_[i] * residual;
      for (std::size_t j = 0; j <= i; ++j) normal_[i * Count + j] += share_[i] * share_[j];
    }
  }
  void solve() {
    constexpr double kRestWeight = 1e-6;
    constexpr auto kSize = static_cast<int>(Count);
    using Square =
        Eigen::Matrix<double, kSize, kSize, kSize == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
    Square normal = Eigen::Map<const Square>(normal_.data());
    normal.diagonal().array() += kRestWeight;
    Eigen::Map<Eigen::Matrix<double, kSize, 1>> right(right_.data());
    normal.template selfadjointView<Eigen::Lower>().ldlt().solveInPlace(right);
    restart();
  }
  /// After `solve`: what z adds here.
  [[nodiscard]] double output() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < Count; ++i) sum += right_[i] * share_[i];
    return sum;
  }
  /// From here on z adds nothing.
  [[nodiscard]] bool is_over() const {
    constexpr double kNothing = 1e-9;
    return std::ranges::all_of(share_, [](double share) { return share < kNothing; });
  }

 private:
  void restart() { std::fill_n(share_.begin(), branches_, 1.0); }

  const std::array<double, Count>& decay_;
  std::size_t branches_;
  std::array<double, Count> share_{};
  std::array<double, Count> right_{};
  std::array<double, Count * Count> normal_{};
};

}  // namespace

ViscoelasticError::ViscoelasticError(const TrainingData& data, std::size_t max_scored,
                                     bool is_at_rest)
    : is_at_rest_(is_at_rest), period_s_(1.0 / data.sample_rate_Hz) {
  const std::size_t stride = std::max<std::size_t>(
      1, (data.usable_samples() + max_scored - 1) / std::max<std::size_t>(max_scored, 1));
  std::size_t usable = 0;
  for (const Sequence& sequence : data.sequences) {
    Run run;
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      run.input.push_back(sequence.features(n, 0));
      run.target.push_back(sequence.target[n]);
      run.is_scored.push_back(sequence.use[n] != 0 && usable++ % stride == 0 ? 1 : 0);
      run.scored += run.is_scored.back();
    }
    longest_s_ = std::max(longest_s_, period_s_ * static_cast<double>(run.input.size()));
    residuals_ += run.scored;
    runs_.push_back(std::move(run));
  }
  measure_deviations();
}

void ViscoelasticError::measure_deviations() {
  const auto deviation = [&](std::vector<double> Run::*channel) {
    double count = 0.0;
    double mean = 0.0;
    double squares = 0.0;
    for (const Run& run : runs_) {
      for (std::size_t n = 0; n < run.input.size(); ++n) {
        if (run.is_scored[n] == 0) continue;
        const double distance = (run.*channel)[n] - mean;
        mean += distance / ++count;
        squares += distance * ((run.*channel)[n] - mean);
      }
    }
    return std::sqrt(squares / std::max(count, 1.0));
  };
  input_deviation_ = deviation(&Run::input);
  target_deviation_ = deviation(&Run::target);
}

void ViscoelasticError::evaluate(const RelaxationSpectrum& spectrum, double offset,
                                 std::span<double> residuals) const {
  switch (spectrum.branches.size()) {
    case 0:
    case 1: return evaluate_with<1>(spectrum, offset, residuals);
    case 2: return evaluate_with<2>(spectrum, offset, residuals);
    case 3: return evaluate_with<3>(spectrum, offset, residuals);
    case 4: return evaluate_with<4>(spectrum, offset, residuals);
    case 5:
    case 6: return evaluate_with<6>(spectrum, offset, residuals);
    default: break;
  }
  if (spectrum.branches.size() <= 16) return evaluate_with<16>(spectrum, offset, residuals);
  evaluate_with<kMaxNetworkNodes / 2>(spectrum, offset, residuals);
}

template <std::size_t Count>
void ViscoelasticError::evaluate_with(const RelaxationSpectrum& spectrum, double offset,
                                      std::span<double> residuals) const {
  const Steps<Count> steps(spectrum, offset, period_s_);
  std::size_t next = 0;
  for (const Run& run : runs_) {
    std::array<double, Count> torque{};
    StartState<Count> start(steps.decay, is_at_rest_ ? 0 : spectrum.branches.size());
    const std::size_t first = next;
    for (std::size_t n = 0; n < run.input.size(); ++n) {
      const double moved = n == 0 ? 0.0 : run.input[n] - run.input[n - 1];
      const double value =
          relaxed<Count>(steps.offset + steps.stiffness * run.input[n] + steps.slope * moved, moved,
                         steps.decay, steps.gain, torque);
      if (run.is_scored[n] != 0) {
        residuals[next] = value - run.target[n];
        if (!is_at_rest_) start.add(residuals[next]);
        ++next;
      }
      if (!is_at_rest_) start.advance();
    }
    if (is_at_rest_) continue;
    start.solve();
    std::size_t at = first;
    for (std::size_t n = 0; n < run.input.size() && !start.is_over(); ++n, start.advance())
      if (run.is_scored[n] != 0) residuals[at++] += start.output();
  }
}

}  // namespace torsio
