#pragma once

#include <stdexcept>
#include <string>

namespace torsio {

/// What a person needs to correct a mistake. Empty parts are left out of the message.
struct ErrorReport {
  std::string place = {};     ///< file and where in it: "sweep.csv: line 12, column 3 (torque_Nm)"
  std::string problem = {};   ///< one clause, where expected/found are not sufficient
  std::string expected = {};  ///< what would have been right
  std::string found = {};     ///< what was there instead
  std::string advice = {};    ///< what to do about it
};

/// Configuring, loading, training or simulating failed. Never thrown by a `step`.
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorReport report);
  [[nodiscard]] const ErrorReport& report() const noexcept { return report_; }

 private:
  ErrorReport report_;
};

/// The call itself was wrong (an unknown name, an option out of range): the program exits with 2
/// instead of 1.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The user asked to stop (Ctrl-C); nothing was written.
class Cancelled : public Error {
 public:
  Cancelled();
};

}  // namespace torsio
