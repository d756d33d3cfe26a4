// Transports without datagrams: serial lines and pseudo-terminals.
#include <asm/termbits.h>  // termios2, whose rate is a number; not together with <termios.h>
#include <fmt/format.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "torsio/link/link_transport.hpp"

namespace torsio {
namespace {

constexpr double kSlowest_baud = 115200.0;
constexpr double kFastest_baud = 8e6;
constexpr double kBufferedBytes = 4096.0;  // as the buffer of a serial line's driver

std::uint32_t checked_baud(const std::string& place, double baud) {
  require(baud >= kSlowest_baud && baud <= kFastest_baud && baud == std::floor(baud), place,
          fmt::format("a whole rate of {} to {} baud", kSlowest_baud, kFastest_baud), baud);
  return static_cast<std::uint32_t>(baud);
}

/// Bytes to and from a descriptor. A frame that was begun is completed before the next.
class ByteLine : public LinkTransport {
 public:
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    flush();
    for (;;) {
      const ssize_t got = ::read(line_.number(), out.data(), out.size());
      if (got > 0) return static_cast<std::size_t>(got);
      if (got == 0 || errno != EINTR) return 0;
    }
  }
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    flush();
    const bool is_taken = left_.empty() && frame.size() <= rest_.size() && may_send(frame.size());
    if (is_taken) {
      std::memcpy(rest_.data(), frame.data(), frame.size());
      left_ = std::span(rest_).first(frame.size());
      flush();
    }
    count().not_sent += is_taken ? 0U : 1U;
    return is_taken;
  }
  int descriptor() const noexcept override { return line_.number(); }
  double line_B_s() const noexcept override { return serial_B_s(baud_); }

 protected:
  virtual bool may_send(std::size_t /*bytes*/) noexcept { return true; }

  void use(detail::Descriptor line, double baud) noexcept {
    line_ = std::move(line);
    baud_ = baud;
  }

 private:
  void flush() noexcept {
    while (!left_.empty()) {
      const ssize_t sent = ::write(line_.number(), left_.data(), left_.size());
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return;
      left_ = left_.subspan(static_cast<std::size_t>(sent));
    }
  }

  std::array<std::uint8_t, kNdlcomMaxEncodedBytes> rest_ = {};
  std::span<const std::uint8_t> left_ = {};
  detail::Descriptor line_;
  double baud_ = 0.0;
};

class SerialLine : public ByteLine {
 public:
  explicit SerialLine(const SerialSettings& settings) : device_(settings.device) {
    const std::uint32_t baud = checked_baud(device_, settings.baud);
    detail::Descriptor line(::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!line.is_open()) {
      const int error_number = errno;
      detail::refuse_system(
          device_, "cannot open", error_number,
          error_number == EACCES  ? "Your user needs the group of the device, often `dialout`."
          : error_number == EBUSY ? "Another process has it for itself: end that process."
                                  : "Is the adapter connected? `ls /dev/tty*` lists the devices.");
    }
    detail::set_raw(line.number(), baud, device_);
    // From now on no other process can open it.
    if (::ioctl(line.number(), TIOCEXCL) != 0)
      detail::refuse_system(device_, "cannot be reserved", errno);
    use(std::move(line), settings.baud);
  }
  std::string place() const override { return device_; }

 private:
  std::string device_;
};

class PseudoTerminal : public ByteLine {
 public:
  explicit PseudoTerminal(const PseudoTerminalSettings& settings)
      : pace_(serial_B_s(checked_baud("pseudo-terminal", settings.baud)), kBufferedBytes) {
    detail::Descriptor line(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    std::array<char, 64> name{};
    if (!line.is_open() || ::grantpt(line.number()) != 0 || ::unlockpt(line.number()) != 0 ||
        ::ptsname_r(line.number(), name.data(), name.size()) != 0)
      detail::refuse_system("pseudo-terminal", "none can be made", errno);
    device_ = name.data();
    use(std::move(line), settings.baud);
    // Open on this side too: else bytes are lost, and reads fail, while no program has it open.
    other_side_ = detail::Descriptor(::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    if (!other_side_.is_open()) detail::refuse_system(device_, "cannot open", errno);
    detail::set_raw(other_side_.number(), static_cast<std::uint32_t>(settings.baud), device_);
    if (settings.link.empty()) return;
    link_ = detail::OwnedPath(settings.link);
    if (::symlink(device_.c_str(), settings.link.c_str()) != 0)
      detail::refuse_system(settings.link, "the link cannot be made", errno,
                            "Choose a path in a folder that you may write.");
  }
  std::string place() const override { return link_.text().empty() ? device_ : link_.text(); }

 protected:
  bool may_send(std::size_t bytes) noexcept override {
    return pace_.take(bytes, static_cast<std::uint64_t>(detail::monotonic_ns()));
  }

 private:
  std::string device_;
  detail::Descriptor other_side_;
  detail::OwnedPath link_;
  TokenBucket pace_;
};

}  // namespace

void detail::set_raw(int descriptor, std::uint32_t baud, const std::string& place) {
  termios2 line{};
  if (::ioctl(descriptor, TCGETS2, &line) != 0)
    refuse_system(place, "it is not a serial line", errno, "Choose a device such as /dev/ttyUSB0.");
  line.c_iflag = 0;
  line.c_oflag = 0;
  line.c_lflag = 0;
  line.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | BOTHER << IBSHIFT;
  line.c_ispeed = baud;
  line.c_ospeed = baud;
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  if (::ioctl(descriptor, TCSETS2, &line) != 0 || ::ioctl(descriptor, TCGETS2, &line) != 0)
    refuse_system(place, fmt::format("it cannot be set to {} baud", baud), errno);
  // Receivers tolerate about 2 % between both ends.
  if (std::abs(static_cast<double>(line.c_ospeed) - baud) > 0.02 * baud)
    refuse(place, fmt::format("a driver with {} baud", baud), fmt::format("{} baud", line.c_ospeed),
           "Choose a rate that the adapter has.");
}

std::unique_ptr<LinkTransport> open_serial(const SerialSettings& settings) {
  return std::make_unique<SerialLine>(settings);
}

std::unique_ptr<LinkTransport> open_pseudo_terminal(const PseudoTerminalSettings& settings) {
  return std::make_unique<PseudoTerminal>(settings);
}

}  // namespace torsio
