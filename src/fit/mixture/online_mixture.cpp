#include "fit/mixture/online_mixture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/checks.hpp"
#include "fit/mixture/nearest_kernel.hpp"

namespace torsio {
namespace {

using nearest_kernel::kFarAway;
constexpr std::size_t kSearchLanes = nearest_kernel::kLanes;

void check_range(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    refuse({"online mixture", name}, fmt::format("a value from {} to {}", low, high), value);
}

void check_settings(const Standardisation& standardisation, const OnlineMixtureSettings& s) {
  constexpr double kLargest = 1e6;
  check_range("components", static_cast<double>(s.components), 1.0, kLargest);
  check_range("novelty_distance", s.novelty_distance, 0.0, kLargest);
  check_range("initial_spread", s.initial_spread, 1e-6, kLargest);
  check_range("learning_rate_floor", s.learning_rate_floor, 0.0, 1.0);
  check_range("forgetting", s.forgetting, 0.0, 1.0);
  check_range("merge_candidates", static_cast<double>(s.merge_candidates), 1.0, kLargest);
  check_range("prune_count", s.prune_count, 0.0, std::numeric_limits<double>::max());
  const std::size_t d = standardisation.centre.size();
  check_range("number of quantities", static_cast<double>(d), 1.0, kMaxMixtureQuantities);
  check_range("number of scales", static_cast<double>(standardisation.scale.size()),
              static_cast<double>(d), static_cast<double>(d));
  for (const double scale : standardisation.scale)
    check_range("scale", scale, std::numeric_limits<double>::min(),
                std::numeric_limits<double>::max());
}

// ln |matrix| by a Cholesky factorisation in its lower triangle, which is overwritten.
double log_determinant(std::span<double> matrix, std::size_t n) {
  double result = 0.0;
  for (std::size_t c = 0; c < n; ++c) {
    for (std::size_t k = 0; k < c; ++k)
      for (std::size_t r = c; r < n; ++r)
        matrix[r * n + c] -= matrix[r * n + k] * matrix[c * n + k];
    const double pivot = std::sqrt(matrix[c * n + c]);
    for (std::size_t r = c; r < n; ++r) matrix[r * n + c] /= pivot;
    result += 2.0 * std::log(pivot);
  }
  return result;
}

}  // namespace

Standardisation robust_standardisation(const Matrix& samples, std::span<const double> floors) {
  constexpr double kTail = 0.005;
  if (samples.rows == 0)
    throw Error({.place = "standardisation", .expected = "samples", .found = "none"});
  Standardisation result;
  std::vector<double> column(samples.rows);
  for (std::size_t j = 0; j < samples.columns; ++j) {
    for (std::size_t i = 0; i < samples.rows; ++i) column[i] = samples(i, j);
    std::sort(column.begin(), column.end());
    const auto tail = static_cast<std::size_t>(kTail * static_cast<double>(samples.rows));
    const std::span<const double> core(column.data() + tail, samples.rows - 2 * tail);
    const auto count = static_cast<double>(core.size());
    const double mean = std::accumulate(core.begin(), core.end(), 0.0) / count;
    double square = 0.0;
    for (const double value : core) square += (value - mean) * (value - mean);
    const double spread = std::max(std::sqrt(square / count), floors[j]);
    result.centre.push_back(mean);
    result.scale.push_back(spread > 0.0 ? spread : 1.0);  // a constant: any unit will do
  }
  return result;
}

OnlineMixture::OnlineMixture(Standardisation standardisation, const OnlineMixtureSettings& settings)
    : standardisation_(std::move(standardisation)),
      settings_(settings),
      dimension_(standardisation_.centre.size()) {
  check_settings(standardisation_, settings_);
  const std::size_t slots = settings_.components;
  counts_.resize(slots);
  births_.resize(slots);
  versions_.resize(slots);
  pairings_.resize(slots);
  means_ = Matrix(slots, dimension_);
  scatters_ = Matrix(slots, dimension_ * dimension_);
  search_.assign((slots + kSearchLanes - 1) / kSearchLanes * kSearchLanes * dimension_, kFarAway);
  sample_.resize(dimension_);
  merged_.resize(dimension_ * dimension_);
  lightest_.reserve(settings_.merge_candidates + 1);
}

void OnlineMixture::learn(std::span<const double> sample) {
  for (std::size_t j = 0; j < dimension_; ++j)
    sample_[j] = (sample[j] - standardisation_.centre[j]) / standardisation_.scale[j];
  ++samples_;
  if (settings_.prune_age > 0 && samples_ % settings_.prune_age == 0) prune();
  if (size_ == 0) return place(size_++);

  const Nearest found = nearest(sample_);
  const double novelty = settings_.novelty_distance;
  if (found.square_distance <= novelty * novelty) return update(found.component);
  if (size_ < settings_.components) return place(size_++);
  if (size_ < 2) return update(found.component);  // no pair to merge
  const std::size_t freed = merge_cheapest();
  pairings_[found.component] = {};
  place(freed);
}

OnlineMixture::Nearest OnlineMixture::nearest(std::span<const double> at) const {
  std::array<float, kMaxMixtureQuantities> point;
  for (std::size_t j = 0; j < dimension_; ++j) point[j] = static_cast<float>(at[j]);
  const std::size_t found = nearest_kernel::nearest(
      search_.data(), (size_ + kSearchLanes - 1) / kSearchLanes, dimension_, point.data());
  double square = 0.0;
  for (std::size_t j = 0; j < dimension_; ++j) {
    const double offset = at[j] - means_(found, j);
    square += offset * offset;
  }
  return {found, square};
}

void OnlineMixture::update(std::size_t component) {
  double& n = counts_[component];
  n = settings_.forgetting * n + 1.0;
  const double rate = std::max(1.0 / n, settings_.learning_rate_floor);
  const auto mean = means_.row(component);
  const auto scatter = scatters_.row(component);
  for (std::size_t j = 0; j < dimension_; ++j) sample_[j] -= mean[j];
  for (std::size_t r = 0; r < dimension_; ++r)
    for (std::size_t c = 0; c < dimension_; ++c) {
      double& entry = scatter[r * dimension_ + c];
      entry = settings_.forgetting * entry + (1.0 - rate) * (sample_[r] * sample_[c]);
    }
  for (std::size_t j = 0; j < dimension_; ++j) sample_[j] = mean[j] + rate * sample_[j];
  set_mean(component, sample_);
}

void OnlineMixture::place(std::size_t component) {
  counts_[component] = 1.0;
  births_[component] = samples_;
  std::fill(scatters_.row(component).begin(), scatters_.row(component).end(), 0.0);
  set_mean(component, sample_);
}

void OnlineMixture::set_mean(std::size_t component, std::span<const double> mean) {
  ++versions_[component];
  std::copy(mean.begin(), mean.end(), means_.row(component).begin());
  float* point = search_.data() + component / kSearchLanes * kSearchLanes * dimension_ +
                 component % kSearchLanes;
  for (std::size_t j = 0; j < dimension_; ++j)
    point[j * kSearchLanes] = static_cast<float>(mean[j]);
}

void OnlineMixture::find_lightest() {
  const auto weight = [this](std::size_t i) { return std::pair(counts_[i], births_[i]); };
  const auto lighter = [&](std::size_t a, std::size_t b) { return weight(a) < weight(b); };
  lightest_.clear();
  std::pair<double, std::uint64_t> heaviest;
  for (std::size_t i = 0; i < size_; ++i) {
    const bool is_full = lightest_.size() == settings_.merge_candidates;
    if (is_full && (counts_[i] > heaviest.first || !(weight(i) < heaviest))) continue;
    if (is_full) lightest_.pop_back();
    lightest_.insert(std::upper_bound(lightest_.begin(), lightest_.end(), i, lighter), i);
    heaviest = weight(lightest_.back());
  }
}

const OnlineMixture::Pairing& OnlineMixture::pairing(std::size_t component) {
  Pairing& known = pairings_[component];
  const bool is_current = known.own_version == versions_[component] &&
                          known.partner_version == versions_[known.partner];
  if (!is_current) {
    const std::size_t partner = neighbour(component);
    known = {partner, merge_cost(component, partner), versions_[component], versions_[partner]};
  }
  return known;
}

std::size_t OnlineMixture::neighbour(std::size_t component) {
  float* point = search_.data() + component / kSearchLanes * kSearchLanes * dimension_ +
                 component % kSearchLanes;
  const float kept = *point;
  *point = kFarAway;  // hides the component from its own search
  const std::size_t found = nearest(means_.row(component)).component;
  *point = kept;
  // The search returns 0 where all others are too far for a float.
  return found != component ? found : (component == 0 ? 1 : 0);
}

std::size_t OnlineMixture::merge_cheapest() {
  find_lightest();
  double least = std::numeric_limits<double>::infinity();
  std::pair<std::size_t, std::size_t> cheapest{0, 1};
  for (const std::size_t light : lightest_) {
    const Pairing& candidate = pairing(light);
    if (candidate.cost < least) {
      least = candidate.cost;
      cheapest = {light, candidate.partner};
    }
  }
  merge(cheapest.second, cheapest.first);
  ++merges_;
  return cheapest.first;
}

double OnlineMixture::merge_cost(std::size_t a, std::size_t b) {
  const double prior_count = static_cast<double>(dimension_) + 1.0;
  const double prior = prior_count * settings_.initial_spread * settings_.initial_spread;
  const double count_a = counts_[a];
  const double count_b = counts_[b];
  const auto term = [&](double weight_a, double weight_b, double between) {
    const double scale = 1.0 / (prior_count + weight_a * count_a + weight_b * count_b);
    for (std::size_t r = 0; r < dimension_; ++r)
      for (std::size_t c = 0; c <= r; ++c) {
        const std::size_t k = r * dimension_ + c;
        const double apart =
            between * (means_(a, r) - means_(b, r)) * (means_(a, c) - means_(b, c));
        merged_[k] = scale * ((r == c ? prior : 0.0) + weight_a * scatters_(a, k) +
                              weight_b * scatters_(b, k) + apart);
      }
    return (weight_a * count_a + weight_b * count_b) * log_determinant(merged_, dimension_);
  };
  return 0.5 * (term(1.0, 1.0, count_a * count_b / (count_a + count_b)) - term(1.0, 0.0, 0.0) -
                term(0.0, 1.0, 0.0));
}

void OnlineMixture::merge(std::size_t into, std::size_t from) {
  const double total = counts_[into] + counts_[from];
  const double share = counts_[from] / total;
  const double between = counts_[into] * share;
  for (std::size_t r = 0; r < dimension_; ++r)
    for (std::size_t c = 0; c < dimension_; ++c) {
      const std::size_t k = r * dimension_ + c;
      scatters_(into, k) += scatters_(from, k) + between * (means_(from, r) - means_(into, r)) *
                                                     (means_(from, c) - means_(into, c));
    }
  for (std::size_t j = 0; j < dimension_; ++j)
    merged_[j] = means_(into, j) + share * (means_(from, j) - means_(into, j));
  set_mean(into, std::span(merged_).first(dimension_));
  counts_[into] = total;
  births_[into] = std::min(births_[into], births_[from]);
}

void OnlineMixture::copy_component(std::size_t from, std::size_t to) {
  counts_[to] = counts_[from];
  births_[to] = births_[from];
  std::copy(scatters_.row(from).begin(), scatters_.row(from).end(), scatters_.row(to).begin());
  set_mean(to, means_.row(from));
}

void OnlineMixture::prune() {
  const std::vector<double> far_away(dimension_, static_cast<double>(kFarAway));
  for (std::size_t i = size_; i-- > 0;) {
    const bool is_old = samples_ - births_[i] > settings_.prune_age;
    if (!is_old || counts_[i] >= settings_.prune_count || size_ == 1) continue;
    --size_;
    if (i != size_) copy_component(size_, i);
    set_mean(size_, far_away);
  }
}

GaussianMixture OnlineMixture::mixture() const {
  if (size_ == 0)
    throw Error({.place = "online mixture", .expected = "samples to learn from", .found = "none"});
  const double prior_count = static_cast<double>(dimension_) + 1.0;
  const double prior = prior_count * settings_.initial_spread * settings_.initial_spread;
  const double total =
      std::accumulate(counts_.begin(), counts_.begin() + static_cast<std::ptrdiff_t>(size_), 0.0);
  GaussianMixture mixture{.centre = standardisation_.centre,
                          .scale = standardisation_.scale,
                          .weights = std::vector<double>(size_),
                          .means = Matrix(size_, dimension_),
                          .covariances = Matrix(size_, dimension_ * dimension_)};
  for (std::size_t i = 0; i < size_; ++i) {
    mixture.weights[i] = counts_[i] / total;
    std::copy(means_.row(i).begin(), means_.row(i).end(), mixture.means.row(i).begin());
    for (std::size_t k = 0; k < dimension_ * dimension_; ++k) {
      const bool on_diagonal = k % (dimension_ + 1) == 0;
      mixture.covariances(i, k) =
          ((on_diagonal ? prior : 0.0) + scatters_(i, k)) / (prior_count + counts_[i]);
    }
  }
  return mixture;
}

}  // namespace torsio
