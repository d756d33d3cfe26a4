#pragma once

#include <string>
#include <utility>
#include <vector>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// Findings while they are collected.
class DriveFindings {
 public:
  void fail(std::string subject, std::string text) {
    all_.push_back({true, std::move(subject), std::move(text)});
  }
  void warn(std::string subject, std::string text) {
    all_.push_back({false, std::move(subject), std::move(text)});
  }
  [[nodiscard]] std::vector<DriveFinding> take() { return std::move(all_); }

 private:
  std::vector<DriveFinding> all_;
};

}  // namespace torsio
