#include <fmt/format.h>

#include "core/checks.hpp"
#include "torsio/link/can_simple.hpp"

namespace torsio {

CanSimpleLine::CanSimpleLine(std::vector<std::unique_ptr<CanSimpleNode>> nodes)
    : nodes_(std::move(nodes)) {
  for (const auto& each : nodes_) {
    CanSimpleNode*& place = by_number_[each->node()];
    require(place == nullptr, "CAN bus", "a number per node",
            fmt::format("{} twice", each->node()));
    place = each.get();
  }
}

void CanSimpleLine::receive(const CanFrame& frame, std::uint64_t now_ns) noexcept {
  if (frame.is_error) {
    ++counts_.errors;
    return;
  }
  if (frame.is_extended || frame.id > kCanHighestId) {
    ++counts_.extended;
    return;
  }
  const auto number = static_cast<std::uint8_t>(frame.id >> 5U);
  if (number == kCanSimpleBroadcast) {
    if (frame.id != can_simple_id(kCanSimpleBroadcast, CanSimpleCommand::estop)) {
      ++counts_.broadcasts;
      return;
    }
    ++counts_.frames;
    for (const auto& each : nodes_) each->receive(frame, now_ns);
  } else if (CanSimpleNode* const to = by_number_[number]; to != nullptr) {
    ++counts_.frames;
    to->receive(frame, now_ns);
  } else {
    ++counts_.to_no_node;
  }
}

void CanSimpleLine::tick(std::uint64_t now_ns) noexcept {
  for (const auto& each : nodes_) each->tick(now_ns);
}

}  // namespace torsio
