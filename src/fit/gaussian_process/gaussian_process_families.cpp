#include "fit/gaussian_process/gaussian_process_families.hpp"

#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr std::string_view kKernelHelp =
    "se, linear, periodic, rq, matern32, matern52, each perhaps with _ard (a length scale an "
    "input), joined by +, * and brackets";

constexpr std::array kGaussianProcessOptions{
    OptionInfo{"kernel", Kind::text, "linear_ard+matern52_ard", 0, 0, kKernelHelp},
    OptionInfo{"samples", Kind::integer, "500", 0, GaussianProcess::kMostPoints,
               "at most so many training samples, drawn by chance; 0: all"},
    OptionInfo{"restarts", Kind::integer, "3", 0, 1000,
               "of the search for the kernel's numbers, besides the first start"},
    OptionInfo{"iterations", Kind::integer, "100", 0, 1e6, "of one search, at most"},
    OptionInfo{"std_dev", Kind::boolean, "true", 0, 0,
               "know an error bar in every step, at samples^2 / 2 operations"}};

constexpr std::array kParametricGpOptions{
    OptionInfo{"mode", Kind::text, "recommended", 0, 0,
               "what the kernel descends on: paper, nlml, elbo or recommended"},
    OptionInfo{"kernel", Kind::text, "se*(linear+periodic*rq)", 0, 0, kKernelHelp},
    OptionInfo{"clusters", Kind::integer, "14", 1, ParametricGp::kMostPoints,
               "hypothetical inputs"},
    OptionInfo{"updates", Kind::integer, "20000", 0, 1e9, "samples taken in, drawn by chance"},
    OptionInfo{"batch", Kind::integer, "1", 1, 1e6,
               "samples between two steps of the kernel's numbers"},
    OptionInfo{"learning_rate", Kind::number, "0.01", 1e-9, 1e3, "of Adam; not of paper"},
    OptionInfo{"refit", Kind::boolean, "true", 0, 0,
               "try the closed form over all samples at the end"},
    OptionInfo{"kernel_plain", Kind::text, "", 0, 0,
               "theta 1 to 9 of paper 002 as plain numbers, joined by /, in place of kernel"}};

constexpr std::array kVariationalGpOptions{
    OptionInfo{"kernel", Kind::text, "linear_ard+matern52_ard", 0, 0, kKernelHelp},
    OptionInfo{"points", Kind::integer, "100", 1, ParametricGp::kMostPoints, "hypothetical inputs"},
    OptionInfo{"samples", Kind::integer, "5000", 0, 1e9,
               "that the kernel's numbers are found on, at most; 0: all"},
    OptionInfo{"iterations", Kind::integer, "100", 0, 1e6, "of that search, at most"}};

ParametricGpMode mode_of(const Options& options) {
  constexpr std::array<std::string_view, 4> kNames{"paper", "nlml", "elbo", "recommended"};
  const std::string& text = options.text("mode");
  for (std::size_t k = 0; k < kNames.size(); ++k)
    if (text == kNames[k]) return static_cast<ParametricGpMode>(k);
  throw UsageError({.place = "option mode",
                    .expected = "paper, nlml, elbo or recommended",
                    .found = '"' + text + '"'});
}

std::optional<PlainKernel> plain_kernel_of(const Options& options) {
  const std::string& text = options.text("kernel_plain");
  if (text.empty()) return {};
  PlainKernel theta{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t j = 0; j < theta.size(); ++j) {
    const auto [next, code] = std::from_chars(at, end, theta[j]);
    const bool is_last = j + 1 == theta.size();
    if (code != std::errc() || (is_last ? next != end : next == end || *next != '/'))
      throw UsageError({.place = "option kernel_plain",
                        .expected = "nine numbers joined by /",
                        .found = '"' + text + '"'});
    at = next + (is_last ? 0 : 1);
  }
  return theta;
}

FittedModel parametric_gp(const TrainingData& data, const Options& options,
                          const FitContext& context) {
  return fitted_model(fit_parametric_gp(data,
                                        {.mode = mode_of(options),
                                         .kernel = options.text("kernel"),
                                         .clusters = options.integer("clusters"),
                                         .updates = options.integer("updates"),
                                         .batch = options.integer("batch"),
                                         .learning_rate = options.number("learning_rate"),
                                         .refit = options.boolean("refit"),
                                         .kernel_plain = plain_kernel_of(options)},
                                        context));
}

FittedModel variational_gp(const TrainingData& data, const Options& options,
                           const FitContext& context) {
  return fitted_model(fit_variational_gp(data,
                                         {.kernel = options.text("kernel"),
                                          .points = options.integer("points"),
                                          .samples = options.integer("samples"),
                                          .iterations = options.integer("iterations")},
                                         context));
}

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
               .summary = "exact Gaussian process over some hundred samples",
               .options = kGaussianProcessOptions,
               .fit = gaussian_process},
    FamilyInfo{.name = ParametricGp::kFamily,
               .summary = "Gaussian process at a few hypothetical inputs, learned sample by sample",
               .options = kParametricGpOptions,
               .fit = parametric_gp},
    FamilyInfo{.name = "parametric_gp_variational",
               .summary = "the same by a variational bound, in closed form",
               .options = kVariationalGpOptions,
               .fit = variational_gp}};

}  // namespace

std::span<const FamilyInfo> gaussian_process_families() noexcept { return kFamilies; }

}  // namespace torsio
