#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "torsio/link.hpp"

// Any bytes on the line must be taken, by both ends and with both rules, and no damaged command reach the joint: the first
// byte of the data chooses the rules, then come the bytes.

namespace {

using namespace torsio;

class FuzzedJoint : public LinkJoint {
 public:
  Identity identity() const noexcept override { return {"fuzzed", "1", "2", "3"}; }
  bool is_initialised() const noexcept override { return true; }
  bool is_at_rest() const noexcept override { return true; }
  bool has_fault() const noexcept override { return false; }
  LinkRefusal enable() noexcept override { return LinkRefusal::none; }
  void disable() noexcept override {}
  void stop(StopCategory /*category*/) noexcept override {}
  LinkRefusal apply(const JointReference& reference) noexcept override {
    if (!is_finite(reference)) std::abort();
    return LinkRefusal::none;
  }
  LinkRefusal change_mode(JointMode /*mode*/) noexcept override { return LinkRefusal::none; }
  std::span<const std::string_view> channels() const noexcept override { return names; }
  void measure(std::span<float> values) const noexcept override {
    for (float& value : values) value = 1.0F;
  }
  std::span<std::uint8_t> begin_upload(std::size_t size,
                                       std::string_view /*actuator*/) noexcept override {
    return size <= space.size() ? std::span<std::uint8_t>(space) : std::span<std::uint8_t>();
  }
  LinkRefusal commit_upload(std::span<const std::uint8_t> /*file*/) noexcept override {
    return LinkRefusal::none;
  }

  std::array<std::string_view, 2> names = {"a", "b"};
  std::array<std::uint8_t, 300> space = {};
};

class FuzzedLine : public LinkSink {
 public:
  explicit FuzzedLine(HostEndpoint& host) : host_(host) {}
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    const std::uint64_t before = host_.counts().refused;
    host_.receive(frame, [](const auto&) {});
    if (host_.counts().refused != before) std::abort();  // what a joint sends is a message
    return true;
  }

 private:
  HostEndpoint& host_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  if (size == 0) return 0;
  const NdlcomRules rules = data[0] % 2 == 0 ? NdlcomRules::strict : NdlcomRules::lenient;
  HostEndpoint host({.id = 200, .joint = 1, .rules = rules});
  HostEndpoint other({.id = 200, .joint = 1, .rules = rules});
  FuzzedLine line(host);
  FuzzedJoint joint;
  double number = 1.0;
  const std::array registers{variable_register(
      {.name = "a", .access = LinkAccess::write, .lowest = 0.0, .highest = 9.0}, number)};
  const RegisterTable table(registers);
  JointEndpoint endpoint({.id = 1, .rules = rules}, joint, table, line);
  std::uint64_t now_ns = 1'000'000'000;
  for (std::span<const std::uint8_t> left(data + 1, size - 1); !left.empty();
       left = left.subspan(left.size() < 40 ? left.size() : 40)) {
    endpoint.tick(now_ns += 1'000'000);
    endpoint.receive(left.first(left.size() < 40 ? left.size() : 40), now_ns);
  }
  if (!(number >= 0.0 && number <= 9.0)) std::abort();
  other.receive({data + 1, size - 1}, [](const auto&) {});
  return 0;
}
