#include "train/gaussian_process_families.hpp"

#include <array>

#include "torsio/train/fit_gaussian_process.hpp"
#include "train/fitted_model.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr std::string_view kKernelHelp =
    "se, linear, periodic, rq, matern32, matern52, each perhaps with _ard (a length scale an "
    "input), joined by +, * and brackets";

constexpr std::array kGaussianProcessOptions{
    OptionInfo{"kernel", Kind::text, "linear_ard+matern52_ard", 0, 0, kKernelHelp},
    OptionInfo{"samples", Kind::integer, "1000", 0, GaussianProcess::kMostPoints,
               "at most so many training samples, drawn by chance; 0: all"},
    OptionInfo{"restarts", Kind::integer, "3", 0, 1000,
               "of the search for the kernel's numbers, besides the first start"},
    OptionInfo{"iterations", Kind::integer, "100", 0, 1e6, "of one search, at most"},
    OptionInfo{"std_dev", Kind::boolean, "true", 0, 0,
               "know an error bar in every step, at samples^2 / 2 operations"}};

FittedModel gaussian_process(const TrainingData& data, const Options& options,
                             const FitContext& context) {
  return fitted_model(fit_gaussian_process(data,
                                           {.kernel = options.text("kernel"),
                                            .samples = options.integer("samples"),
                                            .restarts = options.integer("restarts"),
                                            .iterations = options.integer("iterations"),
                                            .std_dev = options.boolean("std_dev")},
                                           context));
}

constexpr std::array kFamilies{
    FamilyInfo{.name = GaussianProcess::kFamily,
               .summary = "exact Gaussian process over a thousand samples",
               .options = kGaussianProcessOptions,
               .fit = gaussian_process}};

}  // namespace

std::span<const FamilyInfo> gaussian_process_families() noexcept { return kFamilies; }

}  // namespace torsio
