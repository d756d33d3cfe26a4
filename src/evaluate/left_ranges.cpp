#include "evaluate/left_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "core/all_finite.hpp"
#include "data/recording_rows.hpp"
#include "evaluate/unused_inputs.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr double kRareShare = 0.01;

/// Where the values of one input are, and how many of them the guard reports.
struct InputCourse {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  std::size_t outside = 0;
};

struct InputCourses {
  std::vector<InputCourse> inputs;
  std::size_t samples = 0;

  void add(std::span<const double> features, const FeatureRanges& trained) {
    ++samples;
    for (std::size_t j = 0; j < features.size(); ++j) {
      InputCourse& course = inputs[j];
      course.lowest = std::min(course.lowest, features[j]);
      course.highest = std::max(course.highest, features[j]);
      const double border = trained.margin * (trained.highest[j] - trained.lowest[j]);
      if (features[j] < trained.lowest[j] - border || features[j] > trained.highest[j] + border)
        ++course.outside;
    }
  }
};

void add_record(InputCourses& courses, FeaturePipeline& pipeline, const FeatureRanges& trained,
                const DatasetRecord& record) {
  pipeline.reset();
  RecordingRows rows(record.recording, pipeline.raw_inputs());
  std::size_t next = 0;
  for (const Segment& segment : record.segments) {
    for (; next < segment.end; ++next) {
      const std::span<const double> raw = rows.at(next);
      if (!all_finite(raw)) continue;
      const std::span<const double> features = pipeline.step(raw);
      const bool counts = next >= segment.begin && segment.role != Role::train;
      if (counts && pipeline.are_filters_settled() && all_finite(features))
        courses.add(features, trained);
    }
  }
}

/// Which training recording would contain the course.
std::string advice(const InputCourse& course, double lowest, double highest, bool is_rate) {
  const double trained = std::max(std::abs(lowest), std::abs(highest));
  const double here = std::max(std::abs(course.lowest), std::abs(course.highest));
  constexpr double kFaster = 1.1;  // Smaller factors show in the ranges.
  if (is_rate && here >= kFaster * trained && trained > 0.0)
    return fmt::format("add a training recording that moves {:.1f} times as fast", here / trained);
  return "add a training recording that covers this range";
}

}  // namespace

std::vector<std::string> left_range_warnings(const EstimatorSettings& settings,
                                             const AnyModel& model, const Dataset& dataset,
                                             bool has_offset) {
  FeaturePipeline pipeline(settings.features, settings.sample_rate_Hz);
  const FeatureRanges& trained = settings.ranges;
  InputCourses courses{.inputs = std::vector<InputCourse>(pipeline.feature_count())};
  for (const DatasetRecord& record : dataset.records)
    if (std::ranges::any_of(record.segments,
                            [](const Segment& segment) { return segment.role != Role::train; }))
      add_record(courses, pipeline, trained, record);
  std::vector<std::string> warnings;
  for (std::size_t j = 0; j < courses.inputs.size(); ++j) {
    const InputCourse& course = courses.inputs[j];
    const double share = static_cast<double>(course.outside) / static_cast<double>(courses.samples);
    if (!(share >= kRareShare)) continue;
    const std::string_view unused = reason_to_leave_out(settings, model, j);
    warnings.push_back(fmt::format(
        "{} is {:.3g} to {:.3g} here and was {:.3g} to {:.3g} in training: outside in {:.1f} % of "
        "the samples, which a guard reports; {}",
        settings.features.inputs[j], course.lowest, course.highest, trained.lowest[j],
        trained.highest[j], 100.0 * share,
        !unused.empty() ? fmt::format("it {}: fit again with --inputs, without it", unused)
        : has_offset    ? "remove the offset first, then evaluate again"
                     : advice(course, trained.lowest[j], trained.highest[j], pipeline.is_rate(j))));
  }
  return warnings;
}

}  // namespace torsio
