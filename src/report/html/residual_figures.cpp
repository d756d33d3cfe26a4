#include "report/html/residual_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "report/html/speed_loops.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kModels = 3;     // whose residuals are drawn
constexpr std::size_t kPoints = 1500;  // in a scatter plot
constexpr std::size_t kSpectrumSamples = 16384;
constexpr std::size_t kFrequencies = 150;
constexpr std::size_t kTogether = 10;  // frequencies
static_assert(kFrequencies % kTogether == 0);

struct Context {
  const RecordRuns& record;
  std::string error_label;
  double rate_Hz;

  [[nodiscard]] std::size_t models() const { return std::min(record.runs.size(), kModels); }
};

/// Residuals of every k-th sample that is scored, over a quantity.
XyFigure scatter(const Context& of, const std::string& title, const std::string& x_label,
                 const std::vector<double>& x) {
  XyFigure figure{.title = title, .x = {x_label}, .y = {of.error_label}, .series = {}};
  for (std::size_t m = 0; m < of.models(); ++m) {
    const ModelRun& run = of.record.runs[m];
    std::vector<std::size_t> scored;
    for (std::size_t n = 0; n < x.size(); ++n)
      if (std::isfinite(x[n]) && std::isfinite(run.residual[n])) scored.push_back(n);
    const std::size_t step = scored.size() / kPoints + 1;
    XySeries series{
        .label = run.label, .style = CurveStyle::points, .is_shown = m == 0, .x = {}, .y = {}};
    for (std::size_t i = 0; i < scored.size(); i += step) {
      series.x.push_back(x[scored[i]]);
      series.y.push_back(run.residual[scored[i]]);
    }
    figure.series.push_back(std::move(series));
  }
  return figure;
}

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> kept;
  std::ranges::copy_if(values, std::back_inserter(kept), [](double v) { return std::isfinite(v); });
  return kept;
}

/// The density that the error bars claim: the mean of their normal distributions.
double claimed_density(const ModelRun& run, double error) {
  constexpr std::size_t kBars = 300;
  const std::size_t step = run.std_dev.size() / kBars + 1;
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t n = 0; n < run.std_dev.size(); n += step) {
    const double sigma = run.std_dev[n];
    if (!(sigma > 0.0) || !std::isfinite(run.residual[n])) continue;
    sum += std::exp(-0.5 * error * error / (sigma * sigma)) / sigma;
    ++count;
  }
  return count > 0.0 ? sum / count / std::sqrt(2.0 * std::numbers::pi) : kNotMeasured;
}

XyFigure histogram(const Context& of) {
  constexpr std::size_t kBins = 41;
  const ModelRun& run = of.record.runs.front();
  const std::vector<double> errors = finite(run.residual);
  XyFigure figure{.title = "Distribution of the residuals of " + run.label,
                  .x = {of.error_label},
                  .y = {"density"},
                  .series = {}};
  double largest = 0.0;
  for (const double error : errors) largest = std::max(largest, std::abs(error));
  if (largest == 0.0) return figure;
  const double width = 2.0 * largest / static_cast<double>(kBins);
  XySeries columns{.label = "residuals", .style = CurveStyle::columns, .x = {}, .y = {}};
  XySeries claimed{
      .label = "claimed by the error bar", .role = CurveRole::measured, .x = {}, .y = {}};
  columns.y.assign(kBins, 0.0);
  for (const double error : errors) {
    const auto bin = static_cast<std::size_t>((error + largest) / width);
    columns.y[std::min(bin, kBins - 1)] += 1.0 / (width * static_cast<double>(errors.size()));
  }
  for (std::size_t k = 0; k < kBins; ++k) {
    columns.x.push_back(-largest + (static_cast<double>(k) + 0.5) * width);
    claimed.x.push_back(columns.x.back());
    claimed.y.push_back(claimed_density(run, columns.x.back()));
  }
  figure.series = {std::move(columns), std::move(claimed)};
  return figure;
}

XyFigure autocorrelation(const Context& of) {
  constexpr std::size_t kLags = 200;
  constexpr std::size_t kMaxSamples = 50'000;
  XyFigure figure{.title = "Autocorrelation of the residuals",
                  .x = {"lag [s]"},
                  .y = {"correlation"},
                  .series = {}};
  for (std::size_t m = 0; m < of.models(); ++m) {
    const std::vector<double>& e = of.record.runs[m].residual;
    const std::size_t samples = std::min(e.size(), kMaxSamples);
    const std::size_t stride = std::max<std::size_t>(samples / 10 / kLags, 1);
    std::vector<std::size_t> scored;
    for (std::size_t n = 0; n < samples; ++n)
      if (std::isfinite(e[n])) scored.push_back(n);
    XySeries series{.label = of.record.runs[m].label, .x = {}, .y = {}};
    double at_zero = 0.0;
    for (std::size_t k = 0; k < kLags && k * stride < samples; ++k) {
      double sum = 0.0;
      std::size_t count = 0;
      for (auto at = std::ranges::lower_bound(scored, k * stride); at != scored.end(); ++at) {
        const std::size_t n = *at;
        const double product = e[n] * e[n - k * stride];
        if (!std::isfinite(product)) continue;
        sum += product;
        ++count;
      }
      const double mean = count > 0 ? sum / static_cast<double>(count) : kNotMeasured;
      if (k == 0) at_zero = mean;
      series.x.push_back(static_cast<double>(k * stride) / of.rate_Hz);
      series.y.push_back(mean / at_zero);
    }
    figure.series.push_back(std::move(series));
  }
  return figure;
}

/// |sum_n x_n exp(i turn n)| for several turns: their recursions do not wait for each other.
std::array<double, kTogether> fourier_sums(const std::vector<double>& x,
                                           const std::array<double, kTogether>& turns) {
  struct Complex {
    std::array<double, kTogether> re{};
    std::array<double, kTogether> im{};
  };
  Complex step;
  Complex phase;
  Complex sum;
  phase.re.fill(1.0);
  for (std::size_t i = 0; i < kTogether; ++i) {
    step.re[i] = std::cos(turns[i]);
    step.im[i] = std::sin(turns[i]);
  }
  for (const double value : x)
    for (std::size_t i = 0; i < kTogether; ++i) {
      sum.re[i] += value * phase.re[i];
      sum.im[i] += value * phase.im[i];
      const double re = phase.re[i] * step.re[i] - phase.im[i] * step.im[i];
      phase.im[i] = phase.re[i] * step.im[i] + phase.im[i] * step.re[i];
      phase.re[i] = re;
    }
  std::array<double, kTogether> lengths{};
  for (std::size_t i = 0; i < kTogether; ++i) lengths[i] = std::hypot(sum.re[i], sum.im[i]);
  return lengths;
}

/// The amplitude of a residual at frequencies that rise geometrically, from one section with a Hann window.
XyFigure spectrum(const Context& of) {
  XyFigure figure{.title = "Spectrum of the residuals",
                  .x = {"frequency [Hz]", true},
                  .y = {"amplitude of " + of.error_label, true},
                  .series = {}};
  for (std::size_t m = 0; m < of.models(); ++m) {
    const ModelRun& run = of.record.runs[m];
    const std::size_t samples = std::min(run.residual.size(), kSpectrumSamples);
    const std::size_t begin = (run.residual.size() - samples) / 2;
    // Windowed once; what is not scored counts as 0 and not to the weights.
    std::vector<double> windowed(samples, 0.0);
    double weights = 0.0;
    for (std::size_t n = 0; n < samples; ++n) {
      const double error = run.residual[begin + n];
      if (!std::isfinite(error)) continue;
      const double hann = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(n) /
                                               static_cast<double>(samples));
      windowed[n] = hann * error;
      weights += hann;
    }
    const double lowest_Hz = 4.0 * of.rate_Hz / static_cast<double>(samples);
    XySeries series{.label = run.label, .x = {}, .y = {}};
    for (std::size_t k = 0; k < kFrequencies; ++k)
      series.x.push_back(lowest_Hz *
                         std::pow(0.5 * of.rate_Hz / lowest_Hz,
                                  static_cast<double>(k) / static_cast<double>(kFrequencies - 1)));
    for (std::size_t k = 0; k < kFrequencies; k += kTogether) {
      std::array<double, kTogether> turns{};
      for (std::size_t i = 0; i < kTogether; ++i)
        turns[i] = 2.0 * std::numbers::pi * series.x[k + i] / of.rate_Hz;
      for (const double sum : fourier_sums(windowed, turns))
        series.y.push_back(weights > 0.0 ? 2.0 * sum / weights : kNotMeasured);
    }
    figure.series.push_back(std::move(series));
  }
  return figure;
}

/// Multiples of the standard deviation and the share of a normal distribution within them.
constexpr std::array<double, 9> kMultiples = {0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0};

XyFigure calibration(const Context& of) {
  XyFigure figure{.title = "Error bars: claimed and found share of the samples",
                  .x = {"claimed share within the error bar"},
                  .y = {"found share"},
                  .series = {}};
  figure.series.push_back(
      {.label = "calibrated", .role = CurveRole::limit, .x = {0, 1}, .y = {0, 1}});
  for (std::size_t m = 0; m < of.models(); ++m) {
    const ModelRun& run = of.record.runs[m];
    XySeries series{.label = run.label, .x = {}, .y = {}};
    for (const double multiple : kMultiples) {
      std::size_t within = 0;
      std::size_t all = 0;
      for (std::size_t n = 0; n < run.residual.size(); ++n) {
        if (!std::isfinite(run.residual[n]) || !(run.std_dev[n] > 0.0)) continue;
        ++all;
        if (std::abs(run.residual[n]) <= multiple * run.std_dev[n]) ++within;
      }
      series.x.push_back(std::erf(multiple / std::numbers::sqrt2));
      series.y.push_back(all > 0 ? static_cast<double>(within) / static_cast<double>(all)
                                 : kNotMeasured);
    }
    figure.series.push_back(std::move(series));
  }
  return figure;
}

}  // namespace

std::vector<ReportFigure> residual_figures(const RecordRuns& record) {
  if (record.runs.empty()) return {};
  const Recording& recording = *record.recording;
  const Context of{.record = record,
                   .error_label = fmt::format("error [{}]", unit_label(record.target->name)),
                   .rate_Hz = recording.sample_rate_Hz()};
  std::vector<double> time_s(recording.size());
  for (std::size_t n = 0; n < time_s.size(); ++n) time_s[n] = recording.time_s(n);
  return {scatter(of, "Residuals over the first input", with_unit(record.input_name), record.input),
          scatter(of, "Residuals over the rate of the first input", rate_label(record.input_name),
                  rate_of(record.input, of.rate_Hz)),
          scatter(of, "Residuals over the target", with_unit(record.target->name),
                  record.target->values),
          scatter(of, "Residuals over time", "time [s]", time_s),
          histogram(of),
          calibration(of),
          autocorrelation(of),
          spectrum(of)};
}

}  // namespace torsio
