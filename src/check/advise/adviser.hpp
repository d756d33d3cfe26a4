#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "check/advise/condition_advice.hpp"
#include "check/advise/expected_error.hpp"
#include "check/advise/quick_model.hpp"
#include "check/advise/region_errors.hpp"
#include "check/advise/strokes.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// The strokes of every recording, in its order.
using AllStrokes = std::vector<std::vector<Stroke>>;

/// Two significant digits.
[[nodiscard]] inline double rounded(double value) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10.0, 1.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

/// Which recording to make next: the regions of the motion and their errors (advice.cpp), and the
/// proposals (proposals.cpp).
class Adviser {
 public:
  Adviser(const Dataset& dataset, const FeatureSpec& spec, const std::vector<WantedRange>& wanted,
          const Progress& progress)
      : dataset_(dataset), spec_(spec), wanted_(wanted), progress_(progress) {
    advice_.input = spec.inputs.front();
    advice_.target = dataset.target;
    x_unit_ = unit_label(spec.inputs.front());
    y_unit_ = unit_label(dataset.target);
  }

  Advice run();

 private:
  void undetermined(std::string text) { advice_.undetermined.push_back(std::move(text)); }
  [[nodiscard]] const WantedRange* wanted(std::string_view quantity) const {
    const auto at = std::ranges::find(wanted_, quantity, &WantedRange::quantity);
    return at == wanted_.end() ? nullptr : &*at;
  }
  [[nodiscard]] std::size_t total_strokes() const;
  void find_strokes();
  void choose_range();
  std::vector<Block> blocks(const QuickModel& model);
  void list_regions(const RegionErrors& errors);
  /// The regions of the intended use with their weights.
  void choose_use(const ExpectedError::Covered& covered);
  [[nodiscard]] double slack() const { return 0.1 * grid_.half_range; }
  /// The region's motion within the wanted frequencies and, where its slow half suffices, speeds.
  [[nodiscard]] TriangleMotion realisable(const RegionKey& key) const;
  /// Mean over the intended use. @param known the regions that count; null: all
  [[nodiscard]] double mean_square_of_use(const ExpectedError& expected,
                                          const ExpectedError::Covered& covered,
                                          const std::set<RegionKey>* known = nullptr) const;
  [[nodiscard]] static double duration_of(const TriangleMotion& motion);
  void propose_motions(const RegionErrors& errors, const ExpectedError& expected);
  /// By how much the squared error in a covered region falls with a recording of the usual length.
  [[nodiscard]] double gain_of_more(const RegionKey& key,
                                    const std::map<RegionKey, double>& decreases) const;
  [[nodiscard]] const Region& region_of(const RegionKey& key) const {
    return advice_.regions[region_index_.at(key)];
  }
  [[nodiscard]] std::string motion_text(const TriangleMotion& motion, double duration_s) const;
  /// The motion of a region with numbers that are easy to set.
  [[nodiscard]] TriangleMotion settable(const RegionKey& key) const;
  void add_motion(const RegionErrors& errors, const ExpectedError& expected, const RegionKey& key,
                  const ExpectedError::Covered& covered);
  void propose_conditions(const RegionErrors& errors);
  [[nodiscard]] double recorded_s() const;
  void learning_curve(const RegionErrors& errors);
  void find_limits(const RegionErrors& errors);
  void report_undetermined();
  void rank();

  const Dataset& dataset_;
  const FeatureSpec& spec_;
  const std::vector<WantedRange>& wanted_;
  const Progress& progress_;
  std::string x_unit_;
  std::string y_unit_;
  TrainingData data_;
  std::vector<ConditionValues> conditions_;
  AllStrokes strokes_;
  WantedRange recorded_;
  RegionGrid grid_;
  double fastest_ = 0.0;
  double speed_limit_ = std::numeric_limits<double>::infinity();
  double lowest_Hz_ = 0.0;
  double highest_Hz_ = std::numeric_limits<double>::infinity();
  double slope_ = 0.0;
  std::map<RegionKey, std::size_t> region_index_;  ///< in `Advice::regions`
  std::map<RegionKey, double> use_;                ///< weights of the intended use
  Advice advice_;
};

}  // namespace torsio
