#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/training_checkpoint.hpp"
#include "fit/common/fitted.hpp"
#include "model/network/ensemble.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"

namespace torsio {

/// A network of a family as it came out of its training.
template <class Family>
struct Trained {
  typename Family::Parameters parameters;
  std::vector<float> weights;
  double best_loss = 0.0;  ///< standardised mean square error
  double rmse = 0.0;       ///< in the target's unit, by `best_loss`
  std::vector<std::string> notes;
};

/// Which member of an ensemble a network is; empty: of none.
struct EnsembleMember {
  std::string name;                      ///< ends the recipe
  std::size_t of = 1;                    ///< so many members
  std::span<const float> finished = {};  ///< its weights, if an earlier call has come so far
  double finished_loss = 0.0;
};

/// Trains the members of an ensemble one after the other, each with a seed of its own. A stopped
/// call keeps those that were done in the checkpoint of the one that was not.
/// @param train_one a single fit: (context, member) -> Trained<Member>
template <class Member, class TrainOne>
Fitted<Ensemble<Member>> fit_ensemble(std::size_t members, const FitContext& context,
                                      const TrainOne& train_one) {
  if (members < 2 || members > Ensemble<Member>::kMaxMembers)
    throw UsageError({.place = "option members",
                      .expected = fmt::format("2 to {}", Ensemble<Member>::kMaxMembers),
                      .found = fmt::format("{}", members)});
  const std::size_t known = context.resume == nullptr ? 0 : context.resume->finished_loss.size();
  if (known >= members)
    throw UsageError({.place = "checkpoint",
                      .expected = fmt::format("of an ensemble of {} members", members),
                      .found = fmt::format("{} members done", known),
                      .advice = "Resume with the settings of the first call."});
  TrainingCheckpoint done;  // only its `finished` fields
  typename Ensemble<Member>::Parameters parameters;
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  for (std::size_t k = 0; k < members; ++k) {
    EnsembleMember member{.name = fmt::format(", member {} of {}", k + 1, members), .of = members};
    FitContext own = context;
    own.seed = k == 0 ? context.seed : Random(context.seed + k).bits();
    own.resume = k == known ? context.resume : nullptr;
    if (context.progress) {
      own.progress = [&, k](double share, std::string_view doing) {
        return context.progress((static_cast<double>(k) + share) / static_cast<double>(members),
                                fmt::format("member {} of {}: {}", k + 1, members, doing));
      };
    }
    if (context.keep) {
      own.keep = [&](TrainingCheckpoint checkpoint) {
        checkpoint.finished = done.finished;
        checkpoint.finished_loss = done.finished_loss;
        context.keep(checkpoint);
      };
    }
    if (k < known) {
      const std::size_t each = context.resume->finished.size() / known;
      member.finished = std::span(context.resume->finished).subspan(k * each, each);
      member.finished_loss = context.resume->finished_loss[k];
    }
    const Trained<Member> trained = train_one(own, member);
    parameters.members.push_back(trained.parameters);
    parameters.residual_std += trained.rmse / static_cast<double>(members);
    least = std::min(least, trained.rmse);
    most = std::max(most, trained.rmse);
    done.finished.insert(done.finished.end(), trained.weights.begin(), trained.weights.end());
    done.finished_loss.push_back(trained.best_loss);
  }
  return {std::move(parameters),
          {fmt::format("{} members: RMSE {:.4g} to {:.4g} in the target's unit, each on what it "
                       "held out",
                       members, least, most)}};
}

}  // namespace torsio
