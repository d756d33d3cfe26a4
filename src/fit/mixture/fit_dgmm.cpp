#include "fit/mixture/fit_dgmm.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/mixture/dgmm_spread.hpp"
#include "fit/mixture/mixture_em.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSamplesPerReport = 8192;
constexpr double kThinQuantile = 0.01;

// Usable samples under each other: target, then the inputs.
Matrix joint_samples(const TrainingData& data) {
  const Table table = usable_table(data);
  if (table.target.empty())
    throw Error({.place = "dgmm", .expected = "samples to learn from", .found = "none"});
  Matrix samples(table.target.size(), data.input_count() + 1);
  for (std::size_t i = 0; i < samples.rows; ++i) {
    samples(i, 0) = table.target[i];
    std::ranges::copy(table.features.row(i), samples.row(i).begin() + 1);
  }
  return samples;
}

// The resolution of a channel according to a data sheet (specification 3.1); 0 for those without
// one and for what is calculated from channels, whose size may be any.
double resolution(std::string_view expression, bool is_rate) {
  constexpr double kTorque_Nm = 0.05;
  constexpr double kAngle_rad = rad_from_deg(0.01);
  constexpr double kSpeed_rad_s = rad_from_deg(0.1);
  constexpr std::string_view kNameCharacters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  const bool is_name = expression.find_first_not_of(kNameCharacters) == std::string_view::npos;
  const auto channel = is_name ? split_channel_name(expression) : std::nullopt;
  const std::string_view unit = channel ? channel->unit->si_suffix : std::string_view{};
  if (unit == "Nm") return kTorque_Nm;
  if (unit == "rad") return kAngle_rad;
  if (unit == "rad_s") return kSpeed_rad_s;
  const bool of_angle = expression.find("_rad") != std::string_view::npos &&
                        expression.find_first_of("*/^") == std::string_view::npos;
  return is_rate && of_angle ? kSpeed_rad_s : 0.0;
}

Standardisation standardisation_of(const Matrix& samples, const TrainingData& data) {
  constexpr double kShareOfRange = 1e-3;
  std::vector<double> floors;
  for (std::size_t j = 0; j < samples.columns; ++j) {
    double floor = j == 0 ? resolution(data.target, false)
                          : resolution(data.inputs[j - 1].expression, data.inputs[j - 1].is_rate);
    if (floor == 0.0) {
      double low = samples(0, j);
      double high = low;
      for (std::size_t i = 0; i < samples.rows; ++i) {
        low = std::min(low, samples(i, j));
        high = std::max(high, samples(i, j));
      }
      floor = kShareOfRange * (high - low);
    }
    floors.push_back(floor);
  }
  return robust_standardisation(samples, floors);
}

// A value so far out would drag a component, the line and the background with it.
void refuse_outliers(const TrainingData& data, const Standardisation& by) {
  constexpr double kMaxScales = 1e6;
  const auto check = [&](const Sequence& sequence, std::size_t n, std::size_t quantity) {
    const double value = quantity == 0 ? sequence.target[n] : sequence.features(n, quantity - 1);
    if (std::abs(value - by.centre[quantity]) <= kMaxScales * by.scale[quantity]) return;
    throw Error({.place = fmt::format(
                     "dgmm: {}: {}, sample {}", sequence.recording,
                     quantity == 0 ? data.target : data.inputs[quantity - 1].expression, n),
                 .expected = fmt::format("a value within a million of the data's spread, {:.3g}",
                                         by.scale[quantity]),
                 .found = fmt::format("{:.6g}", value),
                 .advice = "Is it an outlier or a mistaken unit? Correct it or leave that stretch "
                           "of the record out."});
  };
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.target.size(); ++n)
      for (std::size_t quantity = 0; sequence.use[n] != 0 && quantity < by.centre.size();
           ++quantity)
        check(sequence, n, quantity);
}

// Usable samples with nothing absurd among them.
Matrix checked_samples(const TrainingData& data) {
  Matrix samples = joint_samples(data);
  refuse_outliers(data, standardisation_of(samples, data));
  return samples;
}

// Mean and covariance of all samples, standardised.
struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

Moments moments_of(const Matrix& samples, const Standardisation& by) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto rows = static_cast<Eigen::Index>(samples.rows);
  const auto columns = static_cast<Eigen::Index>(samples.columns);
  const Eigen::Map<const RowMajor> raw(samples.values.data(), rows, columns);
  const Eigen::Map<const Eigen::RowVectorXd> centre(by.centre.data(), columns);
  const Eigen::Map<const Eigen::RowVectorXd> scale(by.scale.data(), columns);
  RowMajor standardised = (raw.rowwise() - centre).array().rowwise() / scale.array();
  const Eigen::RowVectorXd mean = standardised.colwise().mean();
  standardised.rowwise() -= mean;
  return {mean.transpose(), standardised.transpose() * standardised / static_cast<double>(rows)};
}

// The least-squares fit of the target on the inputs that are not rates (decision 0004); linearly
// dependent inputs share the slope.
LinearClamp linear_clamp(const Moments& all, const Standardisation& by,
                         std::span<const InputInfo> inputs, double width_in_rmse) {
  std::vector<Eigen::Index> used;  // among the quantities, of which the target is the first
  for (std::size_t j = 0; j < inputs.size(); ++j)
    if (!inputs[j].is_rate) used.push_back(static_cast<Eigen::Index>(j) + 1);
  const Eigen::VectorXd cross = all.covariance.col(0)(used);
  Eigen::VectorXd slope(cross.size());
  if (!used.empty()) {
    const Eigen::MatrixXd among = all.covariance(used, used);
    slope = among.completeOrthogonalDecomposition().solve(cross);
  }
  LinearClamp clamp;
  clamp.slope.assign(inputs.size(), 0.0);
  clamp.intercept = by.centre[0] + by.scale[0] * all.mean(0);
  for (std::size_t u = 0; u < used.size(); ++u) {
    const auto k = static_cast<std::size_t>(used[u]);
    double& own = clamp.slope[k - 1];
    own = slope(static_cast<Eigen::Index>(u)) * by.scale[0] / by.scale[k];
    clamp.intercept -= own * (by.centre[k] + by.scale[k] * all.mean(used[u]));
  }
  const double residual_variance = std::max(0.0, all.covariance(0, 0) - slope.dot(cross));
  clamp.width = width_in_rmse * by.scale[0] * std::sqrt(residual_variance);
  return clamp;
}

void append_background(GaussianMixture& mixture, const Moments& all, double weight) {
  constexpr double kSmallestVariance = 1e-6;  // standardised: for quantities that determine others
  for (double& other : mixture.weights) other *= 1.0 - weight;
  mixture.weights.push_back(weight);
  const auto append = [](Matrix& matrix, const Eigen::MatrixXd& row) {
    matrix.values.insert(matrix.values.end(), row.data(), row.data() + row.size());
    ++matrix.rows;
  };
  const Eigen::Index d = all.mean.size();
  append(mixture.means, all.mean);
  append(mixture.covariances, all.covariance + kSmallestVariance * Eigen::MatrixXd::Identity(d, d));
}

// The first percentile of the log density of all quantities but `output` over the samples.
double thin_log_density(const GaussianMixture& mixture, std::size_t output, const Matrix& samples) {
  constexpr std::size_t kEnough = 20000;
  MixtureRegression regression(mixture, output);
  const std::size_t stride = (samples.rows + kEnough - 1) / kEnough;
  std::vector<double> densities;
  std::vector<double> inputs;
  for (std::size_t i = 0; i < samples.rows; i += stride) {
    const auto row = samples.row(i);
    inputs.assign(row.begin(), row.end());
    inputs.erase(inputs.begin() + static_cast<std::ptrdiff_t>(output));
    densities.push_back(regression.query(inputs).log_density);
  }
  const auto at = densities.begin() + static_cast<std::ptrdiff_t>(
                                          kThinQuantile * static_cast<double>(densities.size()));
  std::nth_element(densities.begin(), at, densities.end());
  return *at;
}

void check_options(const DgmmOptions& options) {
  if (!(options.background_weight >= 0.0 && options.background_weight < 1.0))
    throw UsageError({.place = "dgmm: background_weight",
                      .expected = "a value from 0 to below 1",
                      .found = fmt::format("{}", options.background_weight)});
  if (!(options.clamp >= 0.0 && std::isfinite(options.clamp)))
    throw UsageError({.place = "dgmm: clamp",
                      .expected = "a value that is not negative",
                      .found = fmt::format("{}", options.clamp)});
}

OnlineMixture learn_online(const Matrix& samples, const Standardisation& standardisation,
                           const OnlineMixtureSettings& settings, const Progress& progress) {
  OnlineMixture learner(standardisation, settings);
  for (std::size_t i = 0; i < samples.rows; ++i) {
    if (i % kSamplesPerReport == 0)
      report_progress(progress, static_cast<double>(i) / static_cast<double>(samples.rows),
                      "learning online");
    learner.learn(samples.row(i));
  }
  return learner;
}

DgmmOptions with_spread(DgmmOptions options, double spread) {
  options.online.initial_spread = spread;
  if (std::isnan(options.online.novelty_distance))
    options.online.novelty_distance = kNoveltyPerSpread * spread;
  return options;
}

struct MixtureFit {
  Dgmm::Parameters parameters;
  std::size_t merges = 0;
};

// A mixture with its guards, all settings known.
MixtureFit fit_samples(const Matrix& samples, const TrainingData& data, const DgmmOptions& options,
                       const Progress& progress) {
  const Standardisation standardisation = standardisation_of(samples, data);
  const OnlineMixture learner = learn_online(samples, standardisation, options.online, progress);
  MixtureFit fit{.parameters = {}, .merges = learner.merges()};
  Dgmm::Parameters& result = fit.parameters;
  result.mixture = learner.mixture();
  if (options.em_iterations > 0) {
    const MixtureEm em(samples, standardisation,
                       {.count = static_cast<double>(samples.columns) + 1.0,
                        .spread = options.online.initial_spread});
    for (std::size_t k = 0; k < options.em_iterations; ++k) {
      report_progress(progress, static_cast<double>(k) / static_cast<double>(options.em_iterations),
                      "expectation maximisation");
      static_cast<void>(em.iterate(result.mixture, options.threads));
    }
  }
  const Moments all = moments_of(samples, standardisation);
  if (options.background_weight > 0.0)
    append_background(result.mixture, all, options.background_weight);
  result.clamp = linear_clamp(all, standardisation, data.inputs, options.clamp);
  result.clamp.thin_log_density = thin_log_density(result.mixture, 0, samples);
  result.clamp.thin_log_density_inverse = thin_log_density(result.mixture, 1, samples);
  return fit;
}

}  // namespace

Fitted<Dgmm> fit_dgmm(const TrainingData& data, const DgmmOptions& options,
                      const Progress& progress) {
  check_options(options);
  const Matrix samples = checked_samples(data);
  Fitted<Dgmm> fitted;
  double spread = options.online.initial_spread;
  if (std::isnan(spread)) {
    const FitWithSpread fit = [&](const Matrix& part, double candidate, const Progress& within) {
      DgmmOptions one = with_spread(options, candidate);
      one.threads = 1;
      return fit_samples(part, data, one, within).parameters;
    };
    SpreadChoice choice = choose_spread(samples, data, fit, options.threads, progress);
    spread = choice.spread;
    fitted.notes.push_back(std::move(choice.note));
  }
  MixtureFit fit = fit_samples(samples, data, with_spread(options, spread), progress);
  if (fit.merges > 0)
    fitted.notes.push_back(fmt::format(
        "the data filled all {} components and {} pairs were merged to make room: allow more "
        "components, or a larger novelty_distance",
        options.online.components, fit.merges));
  fitted.parameters = std::move(fit.parameters);
  report_progress(progress, 1.0, "done");
  return fitted;
}

Fitted<Dgmm> fit_dgmm_paper(const TrainingData& data, const PaperDgmmOptions& options,
                            const Progress& progress) {
  const Matrix samples = checked_samples(data);
  const Standardisation by = standardisation_of(samples, data);
  const std::size_t d = samples.columns;
  const std::size_t m = std::min(options.components, samples.rows);
  Matrix means(m, d);
  std::vector<double> counts(m, 1.0);
  std::vector<double> x(d);
  for (std::size_t i = 0; i < samples.rows; ++i) {
    if (i % kSamplesPerReport == 0)
      report_progress(progress, static_cast<double>(i) / static_cast<double>(samples.rows),
                      "learning by Algorithm 1");
    for (std::size_t j = 0; j < d; ++j) x[j] = (samples(i, j) - by.centre[j]) / by.scale[j];
    if (i < m) {
      std::copy(x.begin(), x.end(), means.row(i).begin());
      continue;
    }
    std::size_t winner = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < m; ++k) {
      double square = 0.0;
      for (std::size_t j = 0; j < d; ++j) square += (x[j] - means(k, j)) * (x[j] - means(k, j));
      if (square < least) {
        least = square;
        winner = k;
      }
    }
    for (std::size_t j = 0; j < d; ++j)
      means(winner, j) += options.learning_rate * (x[j] - means(winner, j));
    counts[winner] += 1.0;
  }

  Fitted<Dgmm> fitted;
  Dgmm::Parameters& result = fitted.parameters;
  result.mixture = {.centre = by.centre,
                    .scale = by.scale,
                    .weights = counts,
                    .means = std::move(means),
                    .covariances = Matrix(m, d * d)};
  for (double& weight : result.mixture.weights) weight /= static_cast<double>(samples.rows);
  for (std::size_t k = 0; k < m; ++k)
    for (std::size_t j = 0; j < d; ++j)
      result.mixture.covariances(k, j * d + j) = options.spread * options.spread;
  result.clamp.slope.assign(d - 1, 0.0);
  return fitted;
}

}  // namespace torsio
