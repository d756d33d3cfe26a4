#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "torsio/link/link_transport.hpp"

namespace torsio::detail {

/// One open line, of which each joint has an end of its own: an end receives only the frames that its joint has sent. For one
/// thread.
class SplitLine {
 public:
  /// Bytes that are stored for an end which is not read; what arrives beyond is lost.
  static constexpr std::size_t kStored_B = std::size_t{4} << 20;

  SplitLine(std::shared_ptr<LinkTransport> line, NdlcomRules rules);

  [[nodiscard]] std::shared_ptr<LinkTransport> end_of(std::uint8_t joint);
  [[nodiscard]] const LinkTransport& whole() const noexcept;

 private:
  struct Shared;
  class End;
  std::shared_ptr<Shared> shared_;
};

}  // namespace torsio::detail
