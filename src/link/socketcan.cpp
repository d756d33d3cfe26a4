// A CAN interface of Linux. Raw sockets: https://docs.kernel.org/networking/can.html
#include <cerrno>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "torsio/link/can_bus.hpp"

#if defined(__linux__)
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#endif

namespace torsio {

#if defined(__linux__)
namespace {

class SocketCan : public CanBus {
 public:
  explicit SocketCan(const std::string& interface) : place_("socketcan:" + interface) {
    require(!interface.empty() && interface.size() < IFNAMSIZ, place_,
            "the name of an interface, as can0", "'" + interface + "'");
    const unsigned index = ::if_nametoindex(interface.c_str());
    if (index == 0)
      detail::refuse_system(
          place_, "there is no such interface", errno,
          "`ip -brief link` lists the interfaces; that of an adapter is made by its "
          "driver.");
    socket_ =
        detail::Descriptor(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
    if (!socket_.is_open())
      detail::refuse_system(place_, "no CAN socket can be made", errno,
                            "The kernel needs the module can_raw: `modprobe can_raw`.");
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(index);
    if (::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
      detail::refuse_system(place_, "cannot be used", errno,
                            "It must be a CAN interface that is up: `ip link set can0 up type can "
                            "bitrate 1000000`.");
  }

  bool receive(CanFrame& frame) noexcept override {
    constexpr int kFramesPerCall = 16;
    for (int n = 0; n < kFramesPerCall; ++n) {
      can_frame raw{};
      const ssize_t got = ::recv(socket_.number(), &raw, sizeof(raw), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return false;
      if (got == CAN_MTU && raw.can_dlc <= kCanDataBytes) {
        frame = of(raw);
        return true;
      }
      ++count().malformed;
    }
    return false;
  }

  bool send(const CanFrame& frame) noexcept override {
    can_frame raw{};
    raw.can_id =
        frame.id | (frame.is_extended ? CAN_EFF_FLAG : 0U) | (frame.is_remote ? CAN_RTR_FLAG : 0U);
    raw.can_dlc = std::min<std::uint8_t>(frame.size, kCanDataBytes);
    const auto data = frame.bytes();
    std::memcpy(raw.data, data.data(), data.size());
    const bool is_sent = ::send(socket_.number(), &raw, sizeof(raw), MSG_NOSIGNAL) ==
                         static_cast<ssize_t>(sizeof(raw));
    count().not_sent += is_sent ? 0U : 1U;
    return is_sent;
  }

  int descriptor() const noexcept override { return socket_.number(); }
  std::string place() const override { return place_; }

 private:
  static CanFrame of(const can_frame& raw) noexcept {
    CanFrame frame{.is_extended = (raw.can_id & CAN_EFF_FLAG) != 0,
                   .is_remote = (raw.can_id & CAN_RTR_FLAG) != 0,
                   .is_error = (raw.can_id & CAN_ERR_FLAG) != 0,
                   .size = raw.can_dlc};
    frame.id = raw.can_id & (frame.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    if (!frame.is_remote) std::memcpy(frame.data.data(), raw.data, raw.can_dlc);
    return frame;
  }

  std::string place_;
  detail::Descriptor socket_ = detail::Descriptor();
};

}  // namespace

std::unique_ptr<CanBus> open_socketcan(const std::string& interface) {
  return std::make_unique<SocketCan>(interface);
}
#else
std::unique_ptr<CanBus> open_socketcan(const std::string& interface) {
  refuse("socketcan:" + interface, "Linux, which has SocketCAN", "another system");
}
#endif

}  // namespace torsio
