#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/joined_name.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Networks of one kind that were trained from different initial weights, and held out different
/// records: their mean, and what they disagree by.
///
///     ȳ = Σ yₖ / K,   s² = Σ (yₖ − ȳ)² / (K − 1)
///     std_dev = √(r² + s²),   novelty = s / r
///
/// r is what the members were wrong by on records that they had not learned from. s is small where
/// training data were and grows where each member guesses for itself. Source: deep ensembles
/// (Lakshminarayanan et al. 2017). Cost: that of its members. Nothing is allocated after
/// construction.
template <Model M>
class Ensemble {
 public:
  using Member = M;
  static constexpr std::size_t kMaxMembers = 64;

  static constexpr std::string_view kSuffix = "_ensemble";
  static constexpr std::string_view kFamily = JoinedName<M::kFamily, kSuffix>::kName;

  struct Parameters {
    using Family = Ensemble;
    std::vector<typename M::Parameters> members;
    double residual_std = 0.0;  ///< r, in the target's unit

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("members", self.members);
      visit("residual_std", self.residual_std);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error as its members do, if there are not 2 to `kMaxMembers` of them, if they have not
  /// as many inputs or not one sample period, or r is not positive.
  explicit Ensemble(Parameters parameters) : parameters_(std::move(parameters)) {
    const std::size_t count = parameters_.members.size();
    require(count >= 2 && count <= kMaxMembers, kFamily, "2 to 64 members", std::to_string(count));
    require(std::isfinite(parameters_.residual_std) && parameters_.residual_std > 0.0, kFamily,
            "a positive residual_std", parameters_.residual_std);
    for (const auto& member : parameters_.members) {
      members_.emplace_back(member);
      require(members_.back().input_count() == input_count(), kFamily,
              "members with the same inputs",
              std::to_string(members_.back().input_count()) + " inputs");
      if constexpr (requires { member.sample_period_s; }) {
        require(member.sample_period_s == sample_period(), kFamily, "members of one sample period",
                as_text(member.sample_period_s) + " s");
      }
    }
  }

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return members_.front().input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    std::size_t count = 0;
    for (const M& member : members_) count += member.parameter_count();
    return count;
  }
  [[nodiscard]] double sample_period() const noexcept
    requires requires(const M& member) { member.sample_period(); }
  {
    return members_.front().sample_period();
  }

  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const {
    return detail::memory_of(members_.front(), ranges);
  }

  void reset() noexcept {
    for (M& member : members_) member.reset();
  }

  /// With the fault of the first member that has one.
  Estimate step(Features features) noexcept TORSIO_REALTIME {
    Estimate estimate;
    double squares = 0.0;
    double count = 0.0;
    for (M& member : members_) {
      const Estimate output = member.step(features);
      const double distance = output.value - estimate.value;
      estimate.value += distance / ++count;
      squares += distance * (output.value - estimate.value);
      if (estimate.fault == Fault::none) estimate.fault = output.fault;
    }
    const double spread = std::sqrt(squares / (count - 1.0));
    estimate.std_dev = std::hypot(parameters_.residual_std, spread);
    estimate.novelty = spread / parameters_.residual_std;
    return estimate;
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    for (M& member : members_) detail::visit_state_of(member, bytes);
  }

 private:
  Parameters parameters_;
  std::vector<M> members_;
};

using MlpEnsemble = Ensemble<Mlp>;
using LstmEnsemble = Ensemble<Lstm>;
using GruEnsemble = Ensemble<Gru>;

}  // namespace torsio
