#include "common/progress_bar.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "common/interrupt.hpp"
#include "common/output.hpp"

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr auto kBetweenLines = std::chrono::seconds(30);
constexpr int kWidth = 30;

}  // namespace

ProgressBar::ProgressBar()
    : is_terminal_(isatty(STDERR_FILENO) != 0), start_(Clock::now()), last_(start_) {}

ProgressBar::~ProgressBar() {
  if (is_drawn_) std::fputs("\r\033[K", stderr);
}

torsio::Progress ProgressBar::listener() {
  return [this](double fraction, std::string_view doing) {
    if (is_terminal_)
      draw(fraction, doing);
    else
      print_line(fraction, doing);
    return !is_interrupted();
  };
}

void ProgressBar::print_line(double fraction, std::string_view doing) {
  const auto now = Clock::now();
  if (now - last_ < kBetweenLines) return;
  last_ = now;
  const std::chrono::duration<double> spent = now - start_;
  remark(fmt::format("{:.0f} % after {:.0f} s: {}", 100.0 * std::clamp(fraction, 0.0, 1.0),
                     spent.count(), doing));
}

void ProgressBar::draw(double fraction, std::string_view doing) {
  const auto now = Clock::now();
  if (now - start_ < kPatience || now - last_ < kRedraw) return;
  last_ = now;
  is_drawn_ = true;
  const double share = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(share * kWidth);
  const std::chrono::duration<double> spent = now - start_;
  const std::string left =
      share > 0.02 ? fmt::format("{:.0f} s left", spent.count() * (1.0 - share) / share) : "";
  const std::string line = fmt::format("\r\033[K[{:#<{}}{:.<{}}] {:3.0f} %  {}  {}", "", filled, "",
                                       kWidth - filled, 100.0 * share, doing, left);
  std::fputs(line.c_str(), stderr);
}
