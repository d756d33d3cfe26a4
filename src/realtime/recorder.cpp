#include "torsio/realtime/recorder.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <set>
#include <thread>

#include "core/checks.hpp"
#include "realtime/block_file.hpp"
#include "realtime/block_format.hpp"
#include "realtime/frame_ring.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxRingFrames = std::size_t{1} << 24;
constexpr double kLongest_s = 3600.0;
constexpr std::size_t kMaxBlockHeadBytes = 64;
/// How often the writing thread polls the ring: no thread wakes it, because that could block.
constexpr auto kPoll = std::chrono::milliseconds(5);

void check_channels(const std::vector<std::string>& channels) {
  if (channels.empty() || channels.size() > kMaxChannels)
    throw UsageError({.place = "recorder: channels",
                      .expected = fmt::format("from 1 to {}", kMaxChannels),
                      .found = fmt::format("{}", channels.size())});
  std::set<std::string> names;
  for (const std::string& channel : channels) {
    const auto parts = split_channel_name(channel);
    if (!parts || parts->si() != channel)
      throw UsageError({.place = "recorder: channel " + channel,
                        .problem = "the name does not end in an SI unit",
                        .expected = "a name like torque_Nm or joint_angle_rad"});
    if (!names.insert(channel).second)
      throw UsageError({.place = "recorder: channel " + channel, .problem = "named twice"});
  }
}

void check_range(const char* what, double value, double least, double most) {
  require<UsageError>(value >= least && value <= most, {"recorder", what},
                      fmt::format("from {} to {}", least, most), value);
}

std::size_t bytes_of_frame(const RecorderOptions& options) noexcept {
  return sizeof(std::int64_t) + options.channels.size() * sizeof(double);
}

const RecorderOptions& checked(const RecorderOptions& options) {
  check_channels(options.channels);
  check_range("period_s", options.period_s, 1e-6, kLongest_s);
  check_range("ring_frames", static_cast<double>(options.ring_frames), 2.0,
              static_cast<double>(kMaxRingFrames));
  const std::size_t frame_bytes = bytes_of_frame(options);
  const std::size_t max_frames = kMaxPayloadBytes / 2 / frame_bytes;
  check_range("block_frames", static_cast<double>(options.block_frames), 1.0,
              static_cast<double>(max_frames));
  check_range("seal_after_s", options.seal_after_s, 0.0, kLongest_s);
  check_range("sync_after_s", options.sync_after_s, 0.0, kLongest_s);
  return options;
}

Clock::duration duration_of(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// Signals are the program's, a file that outgrows its limit is an error code, and a thread that was
/// started from a real-time one does not run like it.
void become_ordinary() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  const sched_param none{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
}

}  // namespace

/// Both ends: the ring that is filled, and the thread that empties it into the file.
class Recorder::Writer {
 public:
  Writer(const std::filesystem::path& path, const RecorderOptions& options)
      : options_(checked(options)),
        ring_(options_.channels.size(), options_.ring_frames),
        file_(path) {
    block_.ticks.reserve(options_.block_frames);
    block_.values.reserve(options_.block_frames * ring_.channels());
    bytes_.reserve(kMaxBlockHeadBytes + options_.block_frames * bytes_of_frame(options_));
    seal({.channels = options_.channels, .period_s = options_.period_s}, bytes_);
    if (!file_.append(bytes_)) {
      const std::string trouble = file_.trouble();
      file_.close();
      throw Error({.place = path.string(), .problem = "cannot record into it: " + trouble});
    }
    thread_ = std::thread([this] { write_until_closed(); });
  }
  ~Writer() { close(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  FrameRing& ring() noexcept { return ring_; }
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return ring_.dropped() + lost_.load(std::memory_order_relaxed);
  }

  RecorderReport close() {
    if (thread_.joinable()) {
      closes_.store(true, std::memory_order_release);
      thread_.join();
    }
    return report_;
  }

 private:
  void write_until_closed() {
    become_ordinary();
    sealed_at_ = synced_at_ = Clock::now();
    bool is_last = false;
    while (!is_last) {
      // Asked before the ring is emptied: what was pushed before `close` is then in the file.
      is_last = closes_.load(std::memory_order_acquire);
      empty_ring(is_last);
      sync_when_due();
      if (!is_last) std::this_thread::sleep_for(kPoll);
    }
    report_.dropped = dropped();
    seal({.dropped = report_.dropped, .frames = report_.frames}, bytes_);
    (void)file_.append(bytes_);
    file_.close();
    report_.trouble = file_.trouble();
  }

  void empty_ring(bool is_last) {
    while (true) {
      ring_.drain(block_, options_.block_frames);
      const bool is_full = block_.ticks.size() == options_.block_frames;
      const bool is_due =
          is_last || Clock::now() - sealed_at_ >= duration_of(options_.seal_after_s);
      if (is_full || (is_due && !block_.ticks.empty())) write_block();
      if (!is_full) return;
    }
  }

  void write_block() {
    block_.dropped += lost_;
    seal(block_, ring_.channels(), bytes_);
    if (file_.append(bytes_)) {
      report_.frames += block_.ticks.size();
      ++report_.blocks;
    } else {
      lost_ += block_.ticks.size();
    }
    block_.clear();
    sealed_at_ = Clock::now();
  }

  void sync_when_due() {
    if (options_.sync_after_s <= 0.0 ||
        Clock::now() - synced_at_ < duration_of(options_.sync_after_s))
      return;
    (void)file_.sync();
    synced_at_ = Clock::now();
  }

  RecorderOptions options_;
  FrameRing ring_;
  BlockFile file_;
  FrameBlock block_;
  std::vector<std::byte> bytes_;
  std::atomic<std::uint64_t> lost_{0};  ///< frames that the disk did not take
  Clock::time_point sealed_at_;
  Clock::time_point synced_at_;
  RecorderReport report_;
  std::atomic<bool> closes_{false};
  std::thread thread_;
};

Recorder::Recorder(const std::filesystem::path& path, const RecorderOptions& options)
    : writer_(std::make_unique<Writer>(path, options)) {}

Recorder::~Recorder() = default;

bool Recorder::push(std::int64_t tick, std::span<const double> values) noexcept {
  return writer_->ring().push(tick, values);
}

std::uint64_t Recorder::dropped() const noexcept { return writer_->dropped(); }

RecorderReport Recorder::close() { return writer_->close(); }

}  // namespace torsio
