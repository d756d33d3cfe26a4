#include "sim/joints/model_upload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/checks.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(5);
/// A model of the same actuator has a slope within this factor of that of the data sheet; other sizes differ by more.
constexpr double kSlopeFactor = 1.6;

/// A model of another joint can have the right inputs: then its stiffness is another one.
void require_stiffness(const EstimatorSettings& settings, const DataSheet& sheet,
                       std::string_view place) {
  if (settings.fallback.slope.empty()) return;
  const double expected_Nm_rad = series_elastic_joint(sheet).stiffness_Nm_rad;
  double found_Nm_rad = settings.fallback.slope.front();
  if (settings.target == "spring_deflection_rad") found_Nm_rad = 1.0 / found_Nm_rad;
  require(found_Nm_rad < kSlopeFactor * expected_Nm_rad &&
              found_Nm_rad > expected_Nm_rad / kSlopeFactor,
          std::string(place),
          fmt::format("a model of {}, {:.4g} Nm/rad within a factor of {}", sheet.name,
                      expected_Nm_rad, kSlopeFactor),
          fmt::format("{:.4g} Nm/rad", found_Nm_rad));
}

}  // namespace

ArmJointModel arm_joint_model(const ModelFile& file, std::string_view place,
                              const DataSheet& sheet) {
  const std::string& serial = file.card.device_serial;
  require(serial.empty() || serial == full_name(sheet), std::string(place),
          fmt::format("a model of any device, or of {}", full_name(sheet)), serial);
  require_stiffness(file.settings, sheet, place);
  ArmJointModel made{.inverse = AnyInverse::of(file.settings, file.parameters)};
  made.estimator.emplace(make_estimator(file, kBenchRate_Hz));
  return made;
}

std::span<std::uint8_t> ModelUpload::begin(std::size_t size, std::string_view actuator) noexcept {
  const bool is_own = actuator == sheet_.name || actuator == full_name_;
  if (!is_at(Stage::free) || size > space_.size() || !is_own) return {};
  return std::span(space_).first(size);
}

void ModelUpload::commit(std::size_t size) noexcept {
  size_ = size;
  stage_.store(Stage::committed, std::memory_order_release);
}

std::string ModelUpload::work() {
  if (is_at(Stage::ended)) {
    model_.reset();
    stage_.store(Stage::free, std::memory_order_release);
    return {};
  }
  if (!is_at(Stage::committed)) return {};
  try {
    check();
    stage_.store(Stage::checked, std::memory_order_release);
    return "model accepted: " + description_;
  } catch (const std::exception& error) {
    model_.reset();
    stage_.store(Stage::rejected, std::memory_order_release);
    return fmt::format("model rejected: {}", error.what());
  }
}

void ModelUpload::check() {
  constexpr std::string_view kUploadPlace = "uploaded model";
  const ModelFile file = parse_model(std::as_bytes(std::span(space_).first(size_)), kUploadPlace);
  model_.emplace(arm_joint_model(file, kUploadPlace, sheet_));
  description_ = fmt::format("{}, {} bytes", file.parameters.family(), size_);
}

ModelWorker::ModelWorker(std::vector<ModelUpload*> uploads)
    : uploads_(std::move(uploads)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

void ModelWorker::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    for (std::size_t k = 0; k < uploads_.size(); ++k) {
      std::string remark = uploads_[k]->work();
      if (remark.empty()) continue;
      const std::lock_guard lock(mutex_);
      remarks_.push_back({k, std::move(remark)});
    }
    std::this_thread::sleep_for(kPoll);
  }
}

std::vector<ModelWorker::Remark> ModelWorker::take_remarks() {
  const std::lock_guard lock(mutex_);
  return std::exchange(remarks_, {});
}

}  // namespace torsio
