#include "torsio/data/dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Two clocks count as one when they drift by less than a sample in 10^9.
bool is_same_rate(double a, double b) { return std::abs(a - b) <= 1e-9 * b; }

void check_segments(const DatasetRecord& record) {
  std::size_t last_end = 0;
  for (const Segment& segment : record.segments) {
    if (segment.begin < last_end || segment.end <= segment.begin ||
        segment.end > record.recording.size())
      throw Error({.place = record.recording.name(),
                   .problem = fmt::format("the segment [{}, {}) is out of order, empty or outside "
                                          "the record's {} samples",
                                          segment.begin, segment.end, record.recording.size())});
    last_end = segment.end;
  }
}

/// Blocks of one role each, next to each other -> segments with the embargo cut off the training
/// side, equal neighbours merged.
std::vector<Segment> with_embargo(const std::vector<Segment>& blocks, std::size_t embargo) {
  std::vector<Segment> segments;
  for (const Segment& block : blocks) {
    if (!segments.empty() && segments.back().role == block.role)
      segments.back().end = block.end;
    else
      segments.push_back(block);
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Segment& segment = segments[i];
    if (segment.role != Role::train) continue;
    const std::size_t before = i > 0 ? embargo : 0;
    const std::size_t after = i + 1 < segments.size() ? embargo : 0;
    const std::size_t length = segment.end - segment.begin;
    if (length <= before || length - before <= after)
      throw Error({.problem = fmt::format("a training block of {} samples is not longer than the "
                                          "embargo of {} samples next to each test block",
                                          length, embargo),
                   .advice = "Use fewer blocks or a shorter embargo."});
    segment.begin += before;
    segment.end -= after;
  }
  return segments;
}

}  // namespace

std::string_view name(Role role) noexcept {
  switch (role) {
    case Role::train: return "train";
    case Role::validation: return "validation";
    case Role::test: return "test";
  }
  return "unknown";
}

bool DatasetRecord::has_role(Role role) const noexcept {
  return std::ranges::find(segments, role, &Segment::role) != segments.end();
}

double Dataset::sample_rate_Hz() const {
  if (records.empty()) throw Error({.problem = "the dataset has no records"});
  return records.front().recording.sample_rate_Hz();
}

bool Dataset::has_role(Role role) const noexcept {
  return std::ranges::any_of(records,
                             [role](const DatasetRecord& record) { return record.has_role(role); });
}

void Dataset::check() const {
  const double rate = sample_rate_Hz();
  for (const DatasetRecord& record : records) {
    const Recording& recording = record.recording;
    if (!is_same_rate(recording.sample_rate_Hz(), rate))
      throw Error(
          {.place = recording.name(),
           .expected =
               fmt::format("{} Hz, the sample rate of {}", rate, records.front().recording.name()),
           .found = fmt::format("{} Hz", recording.sample_rate_Hz()),
           .advice = "Bring all to one rate: --rate HZ, or sample_rate_Hz in the manifest."});
    static_cast<void>(recording.channel(target));
    check_segments(record);
  }
}

std::vector<Segment> whole_record(std::size_t samples, Role role) {
  return {{.begin = 0, .end = samples, .role = role}};
}

std::vector<Segment> interleaved_blocks(std::size_t samples, std::size_t blocks,
                                        std::size_t test_every, std::size_t embargo_samples) {
  if (test_every < 2 || blocks < test_every || samples / std::max<std::size_t>(blocks, 1) == 0)
    throw Error(
        {.problem = fmt::format("{} samples cannot be cut into {} blocks with every {}th "
                                "for the test",
                                samples, blocks, test_every),
         .expected = "at least one sample a block, test_every at least 2, and as many blocks"});
  const auto border = [&](std::size_t block) {
    const std::size_t whole = samples / blocks;
    return block * whole + block * (samples % blocks) / blocks;
  };
  std::vector<Segment> cut;
  for (std::size_t block = 0; block < blocks; ++block)
    cut.push_back({.begin = border(block),
                   .end = border(block + 1),
                   .role = (block + 1) % test_every == 0 ? Role::test : Role::train});
  return with_embargo(cut, embargo_samples);
}

std::vector<Segment> contiguous_blocks(std::size_t samples, double train_fraction,
                                       std::size_t embargo_samples) {
  if (!(train_fraction > 0.0 && train_fraction < 1.0))
    throw Error({.expected = "a training share between 0 and 1",
                 .found = fmt::format("{}", train_fraction)});
  const auto border =
      static_cast<std::size_t>(std::round(train_fraction * static_cast<double>(samples)));
  if (border == 0 || border >= samples)
    throw Error({.problem = fmt::format("{} samples are too few to train on {} of them", samples,
                                        train_fraction)});
  return with_embargo({{.begin = 0, .end = border, .role = Role::train},
                       {.begin = border, .end = samples, .role = Role::test}},
                      embargo_samples);
}

}  // namespace torsio
