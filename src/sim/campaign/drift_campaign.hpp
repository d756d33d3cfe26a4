#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/evaluate/drift.hpp"

namespace torsio {

struct DriftCampaignSettings {
  std::uint64_t seed = 1;
  std::size_t specimens = 300;  ///< that have changed, and as many that have not
  /// Names for `data_sheet`, without serial number; they take turns. Empty: the series-elastic
  /// actuators.
  std::vector<std::string> actuators = {};
  std::string family = "grey_box";  ///< family of the models
  std::size_t threads = 0;          ///< 0: as many as the machine has
  /// Results are appended to this file, and those that are in it are not simulated again; empty: none.
  std::string resume = {};
};

/// One specimen: what was changed, and what was found.
struct DriftSpecimen {
  std::string actuator;
  std::string changed = {};        ///< "stiffness", "friction", or empty: nothing
  double amount = 0.0;             ///< relative change
  double estimate = kNotMeasured;  ///< its estimate
  bool is_found = false;           ///< the quantity that was changed is reported as changed
  bool is_other_found = false;     ///< another quantity of the joint is reported as changed
  bool is_undetermined = false;    ///< the joint cannot be determined
  bool is_covered = false;         ///< the 95 % interval contains the change
  double scale = kNotMeasured;     ///< relative changes that were estimated
  double friction = kNotMeasured;
  double backlash_rad = kNotMeasured;
};

struct DriftCampaignRow {
  std::string actuator;
  std::string changed;  ///< empty: nothing
  std::size_t specimens = 0;
  std::size_t found = 0;
  std::size_t other_found = 0;
  std::size_t undetermined = 0;
  std::size_t covered = 0;
};

struct DriftCampaignResult {
  std::uint64_t seed = 1;
  std::vector<DriftSpecimen> specimens = {};
  std::vector<DriftCampaignRow> rows = {};
  std::size_t changed = 0;
  std::size_t found = 0;
  double missed_upper_95 = 1.0;  ///< bound of the share that is missed
  std::size_t healthy = 0;
  std::size_t false_alarms = 0;
  double false_upper_95 = 1.0;  ///< bound of the share of false alarms
};

/// Measures `detect_drift`. Each specimen gets a model from three sweeps, a chirp and noise. Afterwards it is
/// recorded again, with other motion and noise, at 25 +- 10 degC: one half with stiffness (by 3 to 15 %) or
/// friction (by 10 to 50 %) of its spring changed, up or down; the other half with the load cell
/// remounted, i.e. another zero (+-1 % of its range), gain (+-0.5 %), axis (2 deg) and a bending moment
/// (0.1 %). Found: the quantity that was changed is reported. False alarm: any quantity of a joint that has
/// not changed. Deterministic for a seed, whatever the number of threads.
/// @throws UsageError for settings out of range, Error if `resume` belongs to another campaign; Cancelled.
[[nodiscard]] DriftCampaignResult run_drift_campaign(const DriftCampaignSettings& settings,
                                                     const Progress& progress = {});

}  // namespace torsio
