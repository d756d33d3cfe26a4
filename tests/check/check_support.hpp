#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "support/bench_dataset.hpp"
#include "torsio/check/check.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio::test {

/// The findings for some inputs. For a fit, the checks that can only warn are left out: what fails
/// must be the same.
inline std::vector<Finding> findings_of(const Dataset& dataset, const FeatureSpec& spec) {
  const std::vector<Finding> findings = check_dataset(dataset, spec);
  std::string failures;
  for (const Finding& finding : findings)
    if (finding.verdict == Verdict::fail) failures += finding.check + finding.message + '\n';
  std::string found_for_fit;
  for (const Finding& finding : check_for_fit(dataset, spec, true).failures)
    found_for_fit += finding.check + finding.message + '\n';
  EXPECT_EQ(found_for_fit, failures);
  return findings;
}

inline std::vector<Finding> findings_of(const Dataset& dataset) {
  return findings_of(dataset, resolve_inputs(dataset, {}));
}

/// The worst verdict of one check.
inline Verdict verdict_of(const std::vector<Finding>& findings, const std::string& check) {
  Verdict worst = Verdict::pass;
  bool is_found = false;
  for (const Finding& finding : findings) {
    if (finding.check != check) continue;
    worst = std::max(worst, finding.verdict);
    is_found = true;
  }
  EXPECT_TRUE(is_found) << check;
  return worst;
}

inline const Finding& first_of(const std::vector<Finding>& findings, const std::string& check) {
  return *std::ranges::find_if(findings,
                               [&](const Finding& finding) { return finding.check == check; });
}

/// Every finding that is not PASS, for messages.
inline std::string text_of(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings)
    if (finding.verdict != Verdict::pass)
      text += finding.check + ": " + finding.recording + ": " + finding.message + '\n';
  return text;
}

/// A dataset of one recording.
inline Dataset alone(Recording recording) {
  Dataset dataset;
  add_record(dataset, std::move(recording), Role::train);
  return dataset;
}

/// A copy of a recording with one channel changed.
inline Recording with_channel(const Recording& sound, const std::string& channel,
                              const std::function<void(Channel&)>& change) {
  Recording recording(sound.name(), sound.sample_rate_Hz());
  for (Channel copy : sound.channels()) {
    if (copy.name == channel) change(copy);
    recording.add(std::move(copy));
  }
  return recording;
}

/// The good bench with one record changed.
inline Dataset with_record(Recording recording) {
  Dataset dataset = bench_dataset();
  add_record(dataset, std::move(recording), Role::train);
  return dataset;
}

inline Recording changed(const std::string& channel, const std::function<void(Channel&)>& change) {
  return with_channel(bench_recording("changed"), channel, change);
}

}  // namespace torsio::test
