#include "fit/gaussian_process/gp_descent.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/folds.hpp"
#include "fit/gaussian_process/sparse_posterior.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

constexpr std::size_t kWidenEvery = 1000;
constexpr double kWidenUntil = 0.8;

/// Adam (Kingma and Ba 2015) with its usual numbers.
class Adam {
 public:
  Adam(std::size_t size, double rate) : rate_(rate), first_(size, 0.0), second_(size, 0.0) {}

  void move(std::span<const double> gradient, std::vector<double>& numbers) {
    first_share_ *= 0.9;
    second_share_ *= 0.999;
    for (std::size_t p = 0; p < numbers.size(); ++p) {
      first_[p] += 0.1 * (gradient[p] - first_[p]);
      second_[p] += 0.001 * (gradient[p] * gradient[p] - second_[p]);
      const double mean = first_[p] / (1.0 - first_share_);
      const double spread = std::sqrt(second_[p] / (1.0 - second_share_));
      numbers[p] -= rate_ * mean / (spread + 1e-8);
    }
  }

 private:
  double rate_;
  double first_share_ = 1.0;
  double second_share_ = 1.0;
  std::vector<double> first_;
  std::vector<double> second_;
};

/// A plain step of theta, or of ln theta, in the form in which the number is stored; NaN where the
/// sign of theta_8 would change, since the kernel is another one then.
double stepped(double number, double gradient, double rate, ThetaForm form, ThetaStep step,
               bool is_negative) {
  if (form == ThetaForm::offset)
    return step == ThetaStep::plain ? number - rate * gradient
                                    : number * std::exp(-rate * gradient * number);
  if (step == ThetaStep::logarithm) return number - rate * gradient;
  // With theta = e^v: dL/dtheta = (dL/dv) / theta, and with theta = e^-v its negative.
  const double sign = form == ThetaForm::inverse_logarithm ? -1.0 : 1.0;
  const double theta = (is_negative ? -1.0 : 1.0) * std::exp(sign * number);
  const double moved = theta - rate * sign * gradient / theta;
  if (form == ThetaForm::signed_logarithm && (moved < 0.0) != is_negative)
    return std::numeric_limits<double>::quiet_NaN();
  return sign * std::log(std::abs(moved));
}

/// Whether the shape of a rational quadratic kernel is negative, for each number of the kernel.
std::vector<bool> negative_numbers(const KernelExpression& kernel,
                                   const std::vector<ThetaForm>& forms) {
  std::vector<bool> are_negative(forms.size(), false);
  std::size_t shape = 0;
  std::vector<double> shapes;
  for (const KernelNode& node : kernel.nodes)
    if (node.kind == static_cast<std::size_t>(KernelKind::rational_quadratic))
      shapes.push_back(node.shape);
  for (std::size_t p = 0; p < forms.size(); ++p)
    if (forms[p] == ThetaForm::signed_logarithm) are_negative[p] = shapes[shape++] < 0.0;
  return are_negative;
}

/// One update of the kernel's numbers from the sums of a batch.
class Learner {
 public:
  Learner(GpDescent& descent, const GpDescentSettings& settings, std::size_t samples)
      : descent_(descent),
        settings_(settings),
        numbers_(descent.trainer.parameters()),
        gradient_(numbers_.size()),
        forms_(theta_forms(descent.trainer.kernel().expression())),
        are_negative_(negative_numbers(descent.trainer.kernel().expression(), forms_)),
        adam_(numbers_.size(), settings.rate),
        divergence_share_(1.0 / static_cast<double>(samples)) {}

  /// @returns false if that was the end.
  bool learn(const Table& table, std::span<const std::size_t> batch) {
    ParametricGpTrainer& trainer = descent_.trainer;
    const KernelObjective objective = settings_.objective;
    const double share = 1.0 / static_cast<double>(batch.size());
    for (const std::size_t n : batch) {
      const auto predicted = trainer.predict(table.features.row(n));
      const double variance = settings_.has_printed_moments
                                  ? predicted.variance
                                  : predicted.variance + trainer.noise_variance();
      // Taken in, it would spoil what was learned.
      if (!std::isfinite(predicted.mean) || !(variance > 0.0)) return false;
      if (objective == KernelObjective::sample || objective == KernelObjective::elbo)
        trainer.add_data_gradient(table.target[n], share);
      trainer.add_noise_gradient(table.target[n], share);
      if (settings_.has_printed_moments)
        trainer.take_in_as_printed(table.target[n]);
      else
        trainer.take_in(table.target[n]);
      ++descent_.updates;
    }
    if (objective == KernelObjective::nlml) trainer.add_nlml_gradient();
    if (objective == KernelObjective::elbo) trainer.add_divergence_gradient(divergence_share_);
    trainer.take_gradient(gradient_);
    return move();
  }

 private:
  bool move() {
    std::vector<double> moved = numbers_;
    if (settings_.step == ThetaStep::adam) {
      adam_.move(gradient_, moved);
    } else {
      for (std::size_t p = 0; p < forms_.size(); ++p)
        moved[p] = stepped(moved[p], gradient_[p], settings_.rate, forms_[p], settings_.step,
                           are_negative_[p]);
      moved.back() -= settings_.rate * gradient_.back();
    }
    moved.back() = std::max(moved.back(), settings_.lowest_log_noise);
    if (settings_.objective == KernelObjective::none) {
      std::copy_n(numbers_.begin(), numbers_.size() - 1, moved.begin());
      descent_.trainer.set_noise_variance(std::exp(moved.back()));
    } else if (!descent_.trainer.set_parameters(moved)) {
      return false;
    }
    numbers_ = std::move(moved);
    return true;
  }

  GpDescent& descent_;
  const GpDescentSettings& settings_;
  std::vector<double> numbers_;
  std::vector<double> gradient_;
  std::vector<ThetaForm> forms_;
  std::vector<bool> are_negative_;
  Adam adam_;
  double divergence_share_;
};

void append(Table& table, std::span<const double> features, double target) {
  table.features.columns = features.size();
  table.features.values.insert(table.features.values.end(), features.begin(), features.end());
  ++table.features.rows;
  table.target.push_back(target);
}

ParametricGp::Parameters with_posterior(ParametricGp::Parameters parameters,
                                        SparsePosterior posterior) {
  parameters.weights = std::move(posterior.weights);
  parameters.explained = std::move(posterior.explained);
  return parameters;
}

/// RMSE in the target's unit; infinite where the model's output is not a number.
double rmse_of(const ParametricGp::Parameters& parameters, const Table& table) {
  ParametricGp model(parameters);
  double sum = 0.0;
  for (std::size_t n = 0; n < table.target.size(); ++n) {
    const Estimate predicted = model.step(table.features.row(n));
    if (predicted.fault != Fault::none) return std::numeric_limits<double>::infinity();
    sum += (predicted.value - table.target[n]) * (predicted.value - table.target[n]);
  }
  return std::sqrt(sum / static_cast<double>(table.target.size()));
}

ParametricGp::Parameters learned_parameters(const ParametricGpTrainer& trainer,
                                            const NetworkScaling& scaling) {
  const Eigen::VectorXd weights = trainer.inverse() * trainer.mean();
  const Eigen::MatrixXd product = trainer.inverse() * trainer.covariance() * trainer.inverse();
  ParametricGp::Parameters parameters{.scaling = scaling,
                                      .kernel = trainer.kernel().expression(),
                                      .noise_variance = trainer.noise_variance(),
                                      .inducing_points = trainer.points(),
                                      .weights = {weights.begin(), weights.end()},
                                      .explained = {}};
  const std::size_t size = trainer.points().rows;
  parameters.explained = Matrix(size, size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < size; ++j) {
      const auto k = static_cast<Eigen::Index>(i);
      const auto l = static_cast<Eigen::Index>(j);
      parameters.explained(i, j) = trainer.inverse()(k, l) - 0.5 * (product(k, l) + product(l, k));
    }
  return parameters;
}

/// These parameters, or the FITC posterior of the same kernel over all samples, whichever has the smaller error;
/// `notes` states which.
ParametricGp::Parameters better_of_refit(ParametricGp::Parameters learned, const GpDescent& descent,
                                         const Table& table, const GpSplit& split,
                                         const FitContext& context,
                                         std::vector<std::string>& notes) {
  report_progress(context.progress, 0.9, "fitting at once");
  const ParametricGpTrainer& trainer = descent.trainer;
  ParametricGp::Parameters refitted = with_posterior(
      learned,
      sparse_posterior(trainer.kernel(), trainer.points(), trainer.noise_variance(), table.features,
                       table.target, SparseNoise::fitc, share_of(context.progress, 0.9, 1.0)));
  const auto error_of = [&](const ParametricGp::Parameters& of) {
    return context.error_of ? context.error_of(ParametricGp(of)) : rmse_of(of, split.evaluation);
  };
  const double learned_rmse = error_of(learned);
  const double refitted_rmse = error_of(refitted);
  const bool is_better = refitted_rmse < learned_rmse;
  notes.push_back(fmt::format(
      "RMSE on {}: {:.4g} as learned, {:.4g} by the closed form over all samples, which is {}",
      context.error_of ? "a free run" : split.tested_on, learned_rmse, refitted_rmse,
      is_better ? "kept" : "not kept"));
  return is_better ? std::move(refitted) : std::move(learned);
}

/// Number of clusters, why the descent ended, kernel and noise.
std::vector<std::string> descent_notes(const GpDescent& descent, std::size_t wanted_points,
                                       const NetworkScaling& scaling) {
  std::vector<std::string> notes;
  const std::size_t points = descent.trainer.points().rows;
  if (points < wanted_points)
    notes.push_back(fmt::format("only {} samples differ: as many clusters instead of {}", points,
                                wanted_points));
  if (!descent.end.empty()) notes.push_back(descent.end);
  notes.push_back(fmt::format(
      "kernel {}; noise {:.3g}{}", description_of(descent.trainer.kernel().expression()),
      std::sqrt(descent.trainer.noise_variance()),
      scaling.target_scale == 1.0 ? "" : " (inputs and target standardised)"));
  return notes;
}

}  // namespace

std::vector<ThetaForm> theta_forms(const KernelExpression& kernel) {
  std::vector<ThetaForm> forms;
  for (const KernelNode& node : kernel.nodes) {
    const auto kind = static_cast<KernelKind>(node.kind);
    if (kind == KernelKind::sum || kind == KernelKind::product) continue;
    const bool is_linear = kind == KernelKind::linear;
    if (node.scaled) forms.push_back(ThetaForm::logarithm);
    forms.insert(forms.end(), node.length_scales.size(),
                 is_linear ? ThetaForm::inverse_logarithm : ThetaForm::logarithm);
    if (is_linear) forms.push_back(ThetaForm::offset);
    if (kind == KernelKind::periodic) forms.push_back(ThetaForm::logarithm);
    if (kind == KernelKind::rational_quadratic) forms.push_back(ThetaForm::signed_logarithm);
  }
  return forms;
}

void descend(GpDescent& descent, const Table& table, const GpDescentSettings& settings,
             Random& random, const Progress& progress) {
  Learner learner(descent, settings, table.target.size());
  std::vector<std::size_t> batch(std::max<std::size_t>(1, settings.batch));
  std::size_t next_widening = kWidenEvery;
  for (std::size_t done = 0; done < settings.updates; done += batch.size()) {
    report_progress(progress, static_cast<double>(done) / static_cast<double>(settings.updates),
                    "learning");
    batch.resize(std::min(batch.size(), settings.updates - done));
    for (std::size_t& n : batch) n = random.below(table.target.size());
    if (!learner.learn(table, batch)) {
      descent.end = fmt::format(
          "the kernel became unusable after update {} of {}; the state before it is kept",
          done + batch.size(), settings.updates);
      return;
    }
    const bool widens = settings.widens && static_cast<double>(done) <
                                               kWidenUntil * static_cast<double>(settings.updates);
    if (widens && done + batch.size() >= next_widening) {
      descent.trainer.widen();
      next_widening += kWidenEvery;
    }
  }
}

GpSplit split_for_refit(const TrainingData& data, const FitContext& context) {
  Table all = usable_table(data);
  if (context.validation != nullptr)
    return {.training = std::move(all),
            .evaluation = usable_table(*context.validation),
            .tested_on = "the validation records"};
  GpSplit split{
      .training = {}, .evaluation = {}, .tested_on = "a fifth of the training samples, held out"};
  for (std::size_t n = 0; n < all.target.size(); ++n)
    append(interleaved_fold(n, all.target.size()) == kFolds - 1 ? split.evaluation : split.training,
           all.features.row(n), all.target[n]);
  return split;
}

GpStart gp_start(const TrainingData& data, const Table& training, bool is_standardised,
                 std::size_t points, Random& random, const Progress& progress) {
  GpStart start{.scaling = is_standardised ? scaling_of(training) : no_scaling(data.input_count()),
                .wanted_points = points,
                .notes = constant_inputs(data, training.features)};
  start.table = standardised(start.scaling, training);
  start.centres = training_centres(start.table, points, random, progress);
  return start;
}

LearnedGp learn(GpStart start, const GpSplit& split, const GpDescentSettings& settings, bool refit,
                Random& random, const FitContext& context) {
  GpDescent descent{ParametricGpTrainer(Kernel(start.kernel, start.centres.columns), start.centres,
                                        start.noise_variance)};
  descend(descent, start.table, settings, random, share_of(context.progress, 0.0, 0.9));
  LearnedGp learned{.fitted = {.parameters = learned_parameters(descent.trainer, start.scaling),
                               .notes = std::move(start.notes)},
                    .updates = descent.updates};
  std::ranges::move(descent_notes(descent, start.wanted_points, start.scaling),
                    std::back_inserter(learned.fitted.notes));
  if (refit)
    learned.fitted.parameters = better_of_refit(std::move(learned.fitted.parameters), descent,
                                                start.table, split, context, learned.fitted.notes);
  return learned;
}

}  // namespace torsio
