#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "torsio/core/progress.hpp"

/// A bar on stderr, if that is a terminal and the work lasts over a second; in a log or pipe a line
/// every half minute. It also carries Ctrl-C to the work.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To be handed to the work; valid while the bar lives.
  [[nodiscard]] torsio::Progress listener();

 private:
  void tell(double fraction, std::string_view doing);
  void draw(double fraction, std::string_view doing);

  bool is_terminal_;
  bool is_drawn_ = false;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_;
};
