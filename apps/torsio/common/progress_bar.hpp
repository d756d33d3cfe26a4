#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "torsio/core/progress.hpp"

/// A progress bar on stderr if that is a terminal and the work lasts over a second; in a log or
/// pipe a line every half minute. It also stops the work after Ctrl-C.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To be passed to the work; valid as long as this object exists.
  [[nodiscard]] torsio::Progress listener();

 private:
  void print_line(double fraction, std::string_view doing);
  void draw(double fraction, std::string_view doing);

  bool is_terminal_;
  bool is_drawn_ = false;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_;
};
