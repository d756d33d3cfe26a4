#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// A model file on its way from a host into the loop of a joint: received by the loop, read and checked by another thread, since
/// that allocates, used by the loop, and its predecessor freed by the other thread. Neither waits for the other: `stage_`
/// names the one whose turn it is.
class ModelUpload {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20U;

  /// @param sheet outlives it
  explicit ModelUpload(const DataSheet& sheet)
      : sheet_(sheet), full_name_(full_name(sheet)), space_(kMaxBytes) {}

  // By the thread of the loop.

  /// @param actuator its type, with or without variant and serial number
  /// @returns space for a file of that size; empty if it is too large, for another actuator, or the one before is still checked
  [[nodiscard]] std::span<std::uint8_t> begin(std::size_t size,
                                              std::string_view actuator) noexcept TORSIO_REALTIME;
  void commit(std::size_t size) noexcept TORSIO_REALTIME;
  [[nodiscard]] bool is_rejected() const noexcept TORSIO_REALTIME { return is_at(Stage::rejected); }
  /// @returns null until there is a model that the joint can use
  [[nodiscard]] ArmJointModel* checked() noexcept TORSIO_REALTIME {
    return is_at(Stage::checked) ? &*model_ : nullptr;
  }
  /// What the checked model is: "grey_box, 12345 bytes".
  [[nodiscard]] std::string_view description() const noexcept { return description_; }
  /// The result was taken: what is in `checked` now is freed.
  void end() noexcept TORSIO_REALTIME {
    stage_.store(is_rejected() ? Stage::free : Stage::ended, std::memory_order_release);
  }

  // By the other thread.

  /// Does what there is to do. @returns why a file was rejected, or that it was accepted; empty: there was nothing to do
  [[nodiscard]] std::string work();

 private:
  enum class Stage : std::uint8_t { free, committed, checked, rejected, ended };

  [[nodiscard]] bool is_at(Stage stage) const noexcept {
    return stage_.load(std::memory_order_acquire) == stage;
  }
  void check();

  const DataSheet& sheet_;
  std::string full_name_;  ///< as the joint announces itself
  std::vector<std::uint8_t> space_;
  std::size_t size_ = 0;
  std::optional<ArmJointModel> model_ = {};
  std::string description_ = {};
  std::atomic<Stage> stage_ = Stage::free;
};

/// @throws Error if a joint with this actuator cannot use the model, as one with inputs that it does not have, or one of
/// another joint, with another stiffness
[[nodiscard]] ArmJointModel arm_joint_model(const ModelFile& file, std::string_view place,
                                            const DataSheet& sheet);

/// The thread that checks uploads, and frees the models before them.
class ModelWorker {
 public:
  explicit ModelWorker(std::vector<ModelUpload*> uploads);
  ModelWorker(const ModelWorker&) = delete;
  ModelWorker& operator=(const ModelWorker&) = delete;

  struct Remark {
    std::size_t upload = 0;  ///< index
    std::string text = {};
  };
  /// Results since the last call. Not for the loop.
  [[nodiscard]] std::vector<Remark> take_remarks();

 private:
  void run(const std::stop_token& stop);

  std::vector<ModelUpload*> uploads_;
  std::mutex mutex_;
  std::vector<Remark> remarks_;
  std::jthread thread_;  ///< last: it uses the others
};

}  // namespace torsio
