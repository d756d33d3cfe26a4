#pragma once

#include <cstddef>
#include <span>

#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "torsio/core/error.hpp"

namespace torsio {

/// One network and the states of several joints that share it. A step reads the weights once for
/// all joints: each joint gets the value that a network of its own would give it, to the bit, for a
/// fraction of the time. Nothing is allocated after construction.
///
/// @tparam Network `Lstm` or `Gru`.
template <class Network>
class NetworkBank {
 public:
  /// @throws Error as the network's constructor; UsageError if there is no joint.
  NetworkBank(const typename Network::Parameters& parameters, std::size_t joints)
      : network_(parameters, checked(joints), Network::kFamily) {}

  [[nodiscard]] std::size_t input_count() const noexcept { return network_.input_count(); }
  [[nodiscard]] std::size_t joint_count() const noexcept { return network_.joint_count(); }

  /// All joints to the zero state, or one.
  void reset() noexcept { network_.reset(); }
  void reset(std::size_t joint) noexcept { network_.reset(joint); }

  /// @param features joints x inputs, row by row: all inputs of joint 0, then of joint 1, ...
  /// @param estimates one per joint, as `Network::step` returns it.
  void step(std::span<const double> features,
            std::span<Estimate> estimates) noexcept TORSIO_REALTIME {
    network_.step(features, estimates);
  }

 private:
  static std::size_t checked(std::size_t joints) {
    if (joints == 0)
      throw UsageError(
          {.place = "network bank", .expected = "at least one joint", .found = "none"});
    return joints;
  }

  RecurrentNetwork<typename Network::Layer> network_;
};

using LstmBank = NetworkBank<Lstm>;
using GruBank = NetworkBank<Gru>;

}  // namespace torsio
