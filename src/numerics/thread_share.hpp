#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>

namespace torsio {

/// While it exists, work on this thread that may use several threads uses at most `threads`, which
/// may change meanwhile: several fits then share a machine. No result depends on it.
class ThreadShare {
 public:
  /// @param threads must outlive this; null: as many as the machine has.
  explicit ThreadShare(const std::atomic<std::size_t>* threads) noexcept : before_(own()) {
    own() = threads;
  }
  ~ThreadShare() { own() = before_; }
  ThreadShare(const ThreadShare&) = delete;
  ThreadShare& operator=(const ThreadShare&) = delete;

  [[nodiscard]] static const std::atomic<std::size_t>* current() noexcept { return own(); }

 private:
  /// The share of this thread.
  static const std::atomic<std::size_t>*& own() noexcept {
    thread_local const std::atomic<std::size_t>* threads = nullptr;
    return threads;
  }

  const std::atomic<std::size_t>* before_;
};

/// The threads that work on this thread uses if no number is stated: its share, or as many as the
/// machine has.
inline std::size_t usual_threads() noexcept {
  const std::atomic<std::size_t>* const share = ThreadShare::current();
  return std::max<std::size_t>(1, share == nullptr ? std::thread::hardware_concurrency()
                                                   : share->load(std::memory_order_relaxed));
}

}  // namespace torsio
