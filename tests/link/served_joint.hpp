#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "link/recording_joint.hpp"
#include "torsio/link/link_transport.hpp"

namespace torsio::test {

/// A `LinkedJoint` on a line and on the clock of the machine, with a tick per millisecond, in a thread of its own.
class ServedJoint {
 public:
  explicit ServedJoint(std::unique_ptr<LinkTransport> line, JointEndpoint::Settings settings = {})
      : joint_(settings), line_(std::move(line)), thread_([this] { serve(); }) {}
  ~ServedJoint() {
    ends_ = true;
    thread_.join();
  }
  ServedJoint(const ServedJoint&) = delete;
  ServedJoint& operator=(const ServedJoint&) = delete;

  /// `look(joint)`, while the joint waits. @returns what it returns
  template <class Look>
  auto with(const Look& look) {
    const std::lock_guard lock(mutex_);
    return look(joint_);
  }
  /// The share of the frames that the joint sends which is lost.
  std::atomic<double> lost_share = 0.0;

 private:
  void serve() {
    std::array<std::uint8_t, 2048> buffer{};
    while (!ends_) {
      static_cast<void>(line_->wait(500'000));
      const std::lock_guard lock(mutex_);
      const auto since_start = std::chrono::steady_clock::now() - start_;
      const std::uint64_t now_ns =
          LinkedJoint::kStart_ns + LinkedJoint::kTick_ns +
          static_cast<std::uint64_t>(std::chrono::nanoseconds(since_start).count());
      for (std::size_t size = 0; (size = line_->receive(buffer)) > 0;)
        joint_.endpoint.receive(std::span(buffer).first(size), now_ns);
      while (joint_.now_ns + LinkedJoint::kTick_ns <= now_ns) joint_.tick();
      send(joint_.sent.take());
    }
  }
  void send(const LinkBytes& bytes) {
    for (const StoredFrame& frame : decoded(decoder_, bytes))
      if (random_.uniform() >= lost_share) line_->send(encoded(frame));
  }

  std::mutex mutex_;
  LinkedJoint joint_;
  std::unique_ptr<LinkTransport> line_;
  NdlcomDecoder decoder_;
  Random random_ = Random(1);
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace torsio::test
