#include "link/page_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "common/output.hpp"
#include "torsio/core/error.hpp"
#include "torsio/files/model_file.hpp"

namespace {

constexpr std::size_t kDeflection = std::numeric_limits<std::size_t>::max();
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

std::optional<std::size_t> index_of(const std::vector<std::string>& channels,
                                    std::string_view name) {
  const auto found = std::ranges::find(channels, name);
  if (found == channels.end()) return std::nullopt;
  return static_cast<std::size_t>(found - channels.begin());
}

}  // namespace

PageModels::PageModels(const std::vector<std::string>& files, const std::string& joint,
                       const std::vector<std::string>& channels, double rate_Hz) {
  const auto gear = index_of(channels, "gear_angle_rad");
  const auto output = index_of(channels, "joint_angle_rad");
  gear_ = gear.value_or(0);
  joint_ = output.value_or(0);
  for (const std::string& file : files) {
    torsio::Estimator estimator = torsio::load_estimator(file);
    const double model_Hz = estimator.settings().sample_rate_Hz;
    if (std::abs(model_Hz - rate_Hz) > 1e-6 * model_Hz)
      throw torsio::Error(
          {.place = file,
           .expected = fmt::format("a model for the rate of {}, {:g} Hz", joint, rate_Hz),
           .found = fmt::format("one for {:g} Hz", model_Hz),
           .advice = "Give the rate of the model by --rate."});
    std::vector<std::size_t> places;
    std::string missing;
    for (const std::string& name : estimator.raw_inputs()) {
      auto place = index_of(channels, name);
      if (!place && name == "spring_deflection_rad" && gear && output) place = kDeflection;
      if (place)
        places.push_back(*place);
      else
        missing += (missing.empty() ? "" : ", ") + name;
    }
    if (!missing.empty()) {
      remark(fmt::format("{} is not used for {}, whose telemetry does not have {}", file, joint,
                         missing));
      continue;
    }
    for (const std::string& channel : estimator.unset_zeros())
      remark(
          fmt::format("{}: {} has no zero, so that the estimate has no error bar", file, channel));
    const std::size_t inputs = places.size();
    running_.push_back({.name = std::filesystem::path(file).stem().string(),
                        .estimator = std::move(estimator),
                        .channels = std::move(places),
                        .raw = std::vector<double>(inputs)});
  }
}

std::vector<torsio::LivePage::Model> PageModels::models() const {
  std::vector<torsio::LivePage::Model> all;
  for (const Running& each : running_)
    all.push_back(
        {.name = each.name, .target = each.estimator.settings().target, .is_on = each.is_on});
  return all;
}

std::vector<bool> PageModels::are_on() const {
  std::vector<bool> all;
  for (const Running& each : running_) all.push_back(each.is_on);
  return all;
}

void PageModels::switch_model(std::size_t model, bool is_on) {
  Running& each = running_.at(model);
  // Its state is from before it was turned off.
  if (is_on && !each.is_on) each.estimator.reset();
  each.is_on = is_on;
}

void PageModels::step(std::uint64_t number, std::span<const double> telemetry,
                      std::span<double> out) {
  const std::uint64_t missed = next_ == 0 || number < next_ ? 0 : number - next_;
  next_ = number + 1;
  for (std::size_t k = 0; k < running_.size(); ++k) {
    Running& each = running_[k];
    out[2 * k] = out[2 * k + 1] = kNoNumber;
    if (!each.is_on) continue;
    if (missed > 0) each.estimator.miss(static_cast<double>(missed));
    for (std::size_t i = 0; i < each.raw.size(); ++i)
      each.raw[i] = each.channels[i] == kDeflection ? telemetry[gear_] - telemetry[joint_]
                                                    : telemetry[each.channels[i]];
    const torsio::Estimate estimate = each.estimator.step(each.raw);
    out[2 * k] = estimate.value;
    out[2 * k + 1] = estimate.std_dev;
  }
}
