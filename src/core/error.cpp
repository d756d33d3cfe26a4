#include "torsio/core/error.hpp"

#include <utility>

namespace torsio {
namespace {

std::string message(const ErrorReport& report) {
  std::string text = report.place;
  const auto append = [&text](std::string_view separator, const std::string& part) {
    if (part.empty()) return;
    if (!text.empty()) text += separator;
    text += part;
  };
  append(": ", report.problem);
  const std::string_view after_place = report.problem.empty() ? ": " : "; ";
  if (!report.expected.empty()) append(after_place, "expected " + report.expected);
  if (!report.found.empty())
    append(report.expected.empty() ? after_place : ", ", "found " + report.found);
  append("\n  ", report.advice);
  return text;
}

}  // namespace

Error::Error(ErrorReport report)
    : std::runtime_error(message(report)), report_(std::move(report)) {}

Cancelled::Cancelled() : Error({.problem = "stopped on request; no output was touched"}) {}

}  // namespace torsio
