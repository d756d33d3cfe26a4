#pragma once

#include <string>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {

/// A file is not the one with which a study began: no result of it may be entered.
class ChangedRecording : public Error {
 public:
  explicit ChangedRecording(ErrorReport report) : Error(std::move(report)) {}
};

/// @param before hash (SHA-256) of the file when the study began
/// @throws ChangedRecording unless both are the same.
inline void refuse_changed_recording(const std::string& file, const std::string& before,
                                     const std::string& now) {
  if (before == now) return;
  throw ChangedRecording({.place = file,
                          .problem = "this recording has changed since the study began",
                          .expected = "SHA-256 " + before,
                          .found = now,
                          .advice = "Restore the file, or begin a study with another name."});
}

}  // namespace torsio
