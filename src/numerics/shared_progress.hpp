#pragma once

#include <cstddef>
#include <mutex>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Reports progress of a part of the work to `progress`, which must outlive it, as progress of the
/// whole from `first` to `last`.
[[nodiscard]] inline Progress share_of(const Progress& progress, double first, double last) {
  if (!progress) return {};
  return [&progress, first, last](double share, std::string_view doing) {
    return progress(first + (last - first) * share, doing);
  };
}

/// Progress of work on several threads, reported by one of them at a time.
class SharedProgress {
 public:
  /// The work's units are reported as fractions of [begin, end).
  SharedProgress(const Progress& progress, double begin, double end, std::size_t units,
                 std::string doing)
      : progress_(progress),
        begin_(begin),
        per_unit_((end - begin) / static_cast<double>(units)),
        doing_(std::move(doing)) {}

  /// A unit is done. @throws Cancelled if the listener asks to stop.
  void tick() {
    if (!progress_) return;
    const std::scoped_lock lock(guard_);
    report_progress(progress_, begin_ + per_unit_ * static_cast<double>(++done_), doing_);
  }

 private:
  const Progress& progress_;
  double begin_;
  double per_unit_;
  std::string doing_;
  std::size_t done_ = 0;
  std::mutex guard_;
};

/// Progress of parts of equal length that report on several threads, as that of the whole.
class ProgressOfParts {
 public:
  /// @param progress must outlive this
  ProgressOfParts(const Progress& progress, std::size_t parts)
      : progress_(progress), done_(parts, 0.0) {}

  /// What one part reports to; this must outlive it.
  [[nodiscard]] Progress part(std::size_t index) {
    if (!progress_) return {};
    return [this, index](double fraction, std::string_view doing) {
      const std::scoped_lock lock(guard_);
      done_[index] = fraction;
      return progress_(
          std::accumulate(done_.begin(), done_.end(), 0.0) / static_cast<double>(done_.size()),
          doing);
    };
  }

 private:
  const Progress& progress_;
  std::vector<double> done_;
  std::mutex guard_;
};

}  // namespace torsio
