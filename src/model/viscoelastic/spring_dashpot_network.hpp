#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// The numbers are stored in model files: never reorder.
enum class NetworkKind : std::uint8_t { spring = 0, dashpot = 1, series = 2, parallel = 3 };

/// A spring or dashpot, or an operator that joins the networks before it. Plain data.
struct NetworkNode {
  std::size_t kind = 0;
  std::size_t label = 0;     ///< 1 + the number after its k or d; 0: no number
  double value = 0.0;        ///< k [Nm/rad] or d [Nm s/rad]; NaN: not given
  std::size_t children = 0;  ///< number of networks that series or parallel joins

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("kind", self.kind);
    visit("label", self.label);
    visit("value", self.value);
    visit("children", self.children);
  }
  bool operator==(const NetworkNode&) const = default;

  [[nodiscard]] bool is(NetworkKind wanted) const noexcept {
    return kind == static_cast<std::size_t>(wanted);
  }
  [[nodiscard]] bool is_leaf() const noexcept {
    return is(NetworkKind::spring) || is(NetworkKind::dashpot);
  }
  /// "k1", "d2", "k".
  [[nodiscard]] std::string name() const;
};

/// Springs and dashpots in series and parallel, each operator after its operands (postfix).
struct SpringDashpotNetwork {
  std::vector<NetworkNode> nodes;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("nodes", self.nodes);
  }
  bool operator==(const SpringDashpotNetwork&) const = default;

  /// Names of springs and dashpots, in the order of the text.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] std::vector<double> values() const;
  /// @param values one a spring or dashpot
  void set_values(const std::vector<double>& values);
};

inline constexpr std::size_t kMaxNetworkNodes = 100;
/// Smallest k [Nm/rad] or d [Nm s/rad].
inline constexpr double kSmallestElement = 1e-12;
inline constexpr double kLargestElement = 1e12;

/// Reads a network:
///
///     network = spring | dashpot | join '(' network ',' network ... ')' | pair '(' spring ',' dashpot ')'
///     spring = 'k' [number] ['=' value]        join = series | parallel
///     dashpot = 'd' [number] ['=' value]       pair = kv | maxwell
///
/// `kv` (Kelvin-Voigt) is a spring and a dashpot in parallel, `maxwell` in series; depth is free.
/// Values are in Nm/rad and Nm s/rad. Every name occurs once: one parameter for two elements could
/// not be distinguished from two parameters. Instead of a network one of these names:
///
///     hooke  maxwell  kelvin_voigt  standard_linear_solid  burgers  generalised_maxwell(n)
///     003a  003b  003c  003d
///
/// the last four with the published values of paper 003 (Table 3, specification 2.1; those of 003d
/// do not describe the paper's coupling).
/// @throws UsageError that points at the place and states what was expected there.
[[nodiscard]] SpringDashpotNetwork parse_network(std::string_view text);

/// The reverse; values that are given are written with `digits` digits, not at all if 0.
[[nodiscard]] std::string text_of(const SpringDashpotNetwork& network, int digits = 0);

/// A branch of a generalised Maxwell model, a spring in series with a dashpot.
struct RelaxationBranch {
  double stiffness = 0.0;  ///< g [Nm/rad]
  double rate_1_s = 0.0;   ///< p [1/s], stiffness over damping
  bool operator==(const RelaxationBranch&) const = default;
};

/// What a network is from outside. Its operator from deflection to torque is that of a generalised
/// Maxwell model, with no other number in it negative:
///
///     H(s) = d s + k + sum_i g_i s / (s + p_i)
///
/// (springs and dashpots are two kinds of elements: the theorem of Foster and Cauer on such
/// networks). So this is the minimal state space, diagonal, and passive term by term.
struct RelaxationSpectrum {
  double damping = 0.0;                    ///< d [Nm s/rad]
  double stiffness = 0.0;                  ///< k [Nm/rad], of the relaxed network
  std::vector<RelaxationBranch> branches;  ///< rising rates
};

/// The spectrum of a network whose values are positive. Parallel networks add their operators.
/// Series networks add s / H, which is again of that form: its rates are the zeros of H(s) / s,
/// which lie between its poles and are computed there by bisection, relative to the nearer pole.
/// Every number is accurate to a few roundings however far apart the rates are.
/// @throws Error for nodes that are not a network, a value outside `kSmallestElement` to
/// `kLargestElement`, more nodes than `kMaxNetworkNodes`, or two elements with one name.
[[nodiscard]] RelaxationSpectrum relaxation_spectrum(const SpringDashpotNetwork& network);

}  // namespace torsio
