#include "link/split_line.hpp"

#include <algorithm>
#include <array>
#include <span>

namespace torsio::detail {

/// Outlives every end.
struct SplitLine::Shared {
  struct Queue {
    std::vector<std::uint8_t> bytes = {};
    std::size_t taken = 0;
  };
  std::shared_ptr<LinkTransport> line;
  NdlcomDecoder decoder;
  std::map<std::uint8_t, Queue> queues = {};

  /// @returns false if nothing has arrived
  bool receive() noexcept {
    std::array<std::uint8_t, 2048> buffer;
    const std::size_t size = line->receive(buffer);
    std::span<const std::uint8_t> bytes = std::span(buffer).first(size);
    while (const auto frame = decoder.next(bytes)) store(*frame);
    return size > 0;
  }
  void store(const NdlcomFrame& frame) noexcept {
    const auto found = queues.find(frame.sender);
    if (found == queues.end()) return;
    std::vector<std::uint8_t>& stored = found->second.bytes;
    if (stored.size() > kStored_B) return;
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> encoded;
    const std::size_t size = encode_ndlcom(frame, encoded);
    stored.insert(stored.end(), encoded.begin(),
                  encoded.begin() + static_cast<std::ptrdiff_t>(size));
  }
};

class SplitLine::End : public LinkTransport {
 public:
  End(std::shared_ptr<Shared> shared, std::uint8_t joint)
      : shared_(std::move(shared)), queue_(shared_->queues[joint]) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    const bool is_sent = shared_->line->send(frame);
    if (!is_sent) ++count().not_sent;
    return is_sent;
  }
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    while (queue_.bytes.empty())
      if (!shared_->receive()) return 0;
    const auto first = queue_.bytes.begin() + static_cast<std::ptrdiff_t>(queue_.taken);
    const std::size_t size = std::min(out.size(), queue_.bytes.size() - queue_.taken);
    std::copy_n(first, size, out.begin());
    queue_.taken += size;
    if (queue_.taken == queue_.bytes.size()) {
      queue_.bytes.clear();
      queue_.taken = 0;
    }
    return size;
  }
  int descriptor() const noexcept override { return shared_->line->descriptor(); }
  std::string place() const override { return shared_->line->place(); }
  double line_B_s() const noexcept override { return shared_->line->line_B_s(); }

 private:
  std::shared_ptr<Shared> shared_;
  Shared::Queue& queue_;
};

SplitLine::SplitLine(std::shared_ptr<LinkTransport> line, NdlcomRules rules)
    : shared_(std::make_shared<Shared>(
          Shared{.line = std::move(line), .decoder = NdlcomDecoder(rules)})) {}

std::shared_ptr<LinkTransport> SplitLine::end_of(std::uint8_t joint) {
  return std::make_shared<End>(shared_, joint);
}

const LinkTransport& SplitLine::whole() const noexcept { return *shared_->line; }

}  // namespace torsio::detail
