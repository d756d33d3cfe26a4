#include "torsio/export/step_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "estimate/guard_listing.hpp"
#include "export/graph/graph_builder.hpp"
#include "export/graph/graph_families.hpp"
#include "export/graph/graph_guards.hpp"
#include "export/graph/graph_memory.hpp"
#include "export/graph/graph_models.hpp"
#include "export/graph/graph_pipeline.hpp"
#include "signal/pipeline_listing.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/estimate/estimator_core.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

// The rules of an excursion, as `detail::EstimatorCore` has them.
constexpr double kTicksPerReturn = 2.0;
constexpr double kTicksOfReturn = 3.0;
constexpr double kExcursionDoubt = 2.0;
constexpr double kLargestShare = 2.0;
/// More ticks than any memory lasts; a number of 32 bits counts as far.
constexpr double kMaxMissed = 1e7;

/// The features as numbers of the model, and what they are computed from in wide ones.
GraphFeatures pipeline_features(GraphBuilder& graph, const PipelineListing& listing,
                                const EstimatorSettings& settings, Row raw, Row restarts,
                                Row keeps) {
  graph.use_wide(true);
  graph.begin_scope(restarts);
  GraphFeatures features = add_pipeline(graph, listing, raw, settings.fallback.slope);
  graph.finish(graph.end_scope(), keeps, graph.truth(false));
  graph.use_wide(false);
  features.all = to_real(features.all);
  features.start_std_dev = to_real(features.start_std_dev);
  return features;
}

/// One tick of an estimator with its guards.
class GuardedStep {
 public:
  GuardedStep(GraphBuilder& graph, const AnyModel::Parameters& parameters,
              const GraphGuards& guards, const PipelineListing& listing)
      : graph_(graph), parameters_(parameters), guards_(guards), listing_(listing) {}

  StepGraph finished() {
    const GuardListing& list = guards_.listing;
    const Row raw = graph_.input(listing_.raw_inputs.size());
    const Row is_measured = all_finite(raw);
    const Row never = graph_.truth(false);
    graph_.begin_scope(never);
    const Row poisoned = graph_.truth_state("poisoned");
    const Row missed = graph_.state("missed");
    const Row has_run = graph_.truth_state("has_run");
    const Row last_value = graph_.state("last_value");
    std::optional<GraphMemory> memory;
    if (list.has_memory) {
      memory.emplace(graph_, list);
      if (!list.assumes_jumps) {
        excursion_ticks_ = graph_.state("excursion_ticks");
        excursion_error_ = graph_.state("excursion_share");
      }
    }
    if (list.longest_stroke > 0.0) strokes_.emplace(graph_);
    const GraphBuilder::Scope own = graph_.end_scope();
    GraphFeatures features = pipeline_features(graph_, listing_, guards_.settings, raw,
                                               either(poisoned, 0.5 < missed), is_not(is_measured));
    const Row is_usable_tick = both(is_measured, all_finite(features.all));
    GraphExcursion excursion = add_excursion(graph_, guards_, features.all);
    const Row is_wrong_rate = list.depends_on_rate ? wrong_rate() : never;
    const Row leaves = list.assumes_jumps ? excursion.is_outside : never;
    const Row in_jump = both(is_usable_tick, either(is_wrong_rate, leaves));
    const Row is_accepted = both(is_usable_tick, is_not(in_jump));
    const Row resumes = both(both(is_accepted, 0.5 < missed), has_run);

    Row x = features.all;
    const Row limited = limited_features(graph_, guards_, features.all);
    if (!list.assumes_jumps) x = select(excursion.is_outside, limited, x);
    if (memory)
      follow(*memory, features, excursion, limited, is_accepted, resumes, missed, has_run);
    graph_.begin_scope(list.resets_model ? resumes : never);
    const GraphEstimate raw_estimate = add_model(graph_, parameters_, x);
    const Row is_stepped = list.has_memory ? is_accepted : is_usable_tick;
    const Row value_is_finite = is_finite(raw_estimate.value);
    graph_.finish(graph_.end_scope(), is_not(is_stepped), is_not(value_is_finite));
    Row memory_is_open = graph_.truth(false);
    Row bound = graph_.constant(0.0);
    if (memory) {
      const Row reports =
          either(is_not(value_is_finite),
                 absolute(raw_estimate.fault - fault_number(Fault::model_not_finite)) < 0.5);
      memory->lose(both(is_accepted, reports));
      memory->store();
      memory_is_open = memory->is_open();
      bound = memory->bound();
    }
    const Row stroke_std_dev =
        strokes_ ? follow_strokes(features.all.part(0), is_accepted) : graph_.constant(0.0);
    excursion.fallback = select(in_jump, kBoundless, excursion.fallback);
    const Row is_settled = both(features.is_settled, is_finite(features.start_std_dev));
    const GraphEstimate out = guarded(graph_, guards_,
                                      {.features = features,
                                       .excursion = excursion,
                                       .is_settled = is_settled,
                                       .is_wrong_rate = is_wrong_rate,
                                       .memory_is_open = memory_is_open,
                                       .memory_bound = bound,
                                       .stroke_std_dev = stroke_std_dev,
                                       .last_value = last_value},
                                      raw_estimate);
    const Row value = select(is_usable_tick, out.value, last_value);
    graph_.set_state("poisoned", both(either(poisoned, is_measured), is_not(is_accepted)));
    graph_.set_state("missed", select(is_accepted, 0.0, minimum(missed + 1.0, kMaxMissed)));
    graph_.set_state("has_run", either(has_run, is_stepped));
    graph_.set_state("last_value", value);
    graph_.finish(own, never, never);
    return graph_.finished(
        value, select(is_usable_tick, out.std_dev, kNotMeasured),
        select(is_usable_tick, out.fault, fault_number(Fault::input_not_finite)));
  }

 private:
  static constexpr double kBoundless = 1e30;

  /// Whether the ticks do not come at the sample rate.
  Row wrong_rate() {
    constexpr double kRounding = 1e-3;
    const Row ticks = graph_.timestep() * guards_.settings.sample_rate_Hz;
    return kRounding < absolute(ticks - 1.0);
  }

  /// What the memory has received, or not, of the inputs of this tick and of those before it.
  void follow(GraphMemory& memory, const GraphFeatures& features, const GraphExcursion& excursion,
              Row limited, Row is_accepted, Row resumes, Row missed, Row has_run) {
    const GuardListing& list = guards_.listing;
    const double width = list.first_width;
    const double travel = detail::kJumpFactor * guards_.settings.disturbances.largest_travel;
    const Row share = std::isfinite(travel) && width > 0.0 ? minimum(missed * (travel / width), 1.0)
                                                           : graph_.constant(1.0);
    memory.interrupt(resumes, missed, share, true);
    if (list.assumes_jumps) {  // no tick outside is accepted
      memory.follow(is_accepted, features.all);
      return;
    }
    const Row ticks = excursion_ticks_;
    const Row error = excursion_error_;
    const Row u = features.all.part(0);
    const Row is_outside = both(both(is_accepted, excursion.is_outside), has_run);
    const Row is_inside = both(is_accepted, is_not(excursion.is_outside));
    // A motion beyond the range hardly exceeds it by more than its width: beyond, the sensor may be wrong.
    const Row beyond = maximum(list.ranges.front().lowest - u, u - list.ranges.front().highest);
    const Row is_beyond = width < beyond;
    const Row worse =
        width > 0.0 ? maximum(error, minimum(beyond * (1.0 / width) + 1.0, kLargestShare)) : error;
    const Row returns = select(0.0 < error, kTicksOfReturn, 0.0);
    const Row counted = ticks + select(is_beyond, 1.0, returns);
    const Row ends = both(is_inside, 0.0 < ticks);
    memory.doubt(ends, ticks * kExcursionDoubt, error);
    const Row left = maximum(ticks - kTicksPerReturn, 0.0);
    graph_.set_state("excursion_ticks", select(is_outside, counted, select(ends, left, ticks)));
    graph_.set_state("excursion_share", select(both(is_outside, is_beyond), worse,
                                               select(both(ends, left <= 0.0), 0.0, error)));
    memory.follow(is_inside, features.all);
    const Row missed_parts = absolute(features.all - limited);
    const Row missed_first =
        width > 0.0 ? minimum(missed_parts.part(0) * (1.0 / width), 1.0) : graph_.constant(1.0);
    memory.interrupt(is_outside, graph_.constant(1.0), missed_first, false);
    memory.miss_others(is_outside, missed_parts);
  }

  /// The members of `detail::StrokeClock`.
  struct Strokes {
    explicit Strokes(GraphBuilder& graph)
        : ticks(graph.state("stroke_ticks")),
          previous(graph.state("previous_stroke")),
          since_extreme(graph.state("since_extreme")),
          extreme(graph.state("extreme")),
          direction(graph.state("stroke_direction")) {}
    Row ticks, previous, since_extreme, extreme, direction;
  };

  /// One accepted tick of `detail::StrokeClock`. @returns what the stroke adds to the error bar
  Row follow_strokes(Row x, Row is_accepted) {
    const StrokeGuard& settings = guards_.settings.strokes;
    const Row extreme = select(strokes_->ticks < 0.5, x, strokes_->extreme);
    const Row ticks = minimum(strokes_->ticks + 1.0, kMaxMissed);
    const Row since = minimum(strokes_->since_extreme + 1.0, kMaxMissed);
    const Row moved = x - extreme;
    const Row is_far = settings.dead_band < absolute(moved);
    const Row is_unknown = absolute(strokes_->direction) < 0.5;
    const Row turns = both(is_far, moved * strokes_->direction < 0.0);
    const Row begins = both(is_unknown, is_far);
    const Row advances =
        either(begins, both(is_not(is_unknown), is_not(moved * strokes_->direction < 0.0)));
    const Row is_extreme = either(turns, advances);
    const Row direction =
        select(either(begins, turns), select(0.0 < moved, 1.0, -1.0), strokes_->direction);
    const Row new_ticks = select(turns, since, ticks);
    const Row previous = select(turns, ticks - since, strokes_->previous);
    const auto store = [&](const char* name, Row value, Row old) {
      const Row stored = select(is_accepted, value, old);
      graph_.set_state(name, stored);
      return stored;
    };
    const Row present = store("stroke_ticks", new_ticks, strokes_->ticks);
    const Row before = store("previous_stroke", previous, strokes_->previous);
    store("since_extreme", select(is_extreme, 0.0, since), strokes_->since_extreme);
    store("extreme", select(is_extreme, x, extreme), strokes_->extreme);
    store("stroke_direction", direction, strokes_->direction);
    const Row share = maximum(present, before) * (1.0 / guards_.listing.longest_stroke);
    const Row beyond = maximum(share - 1.0, 0.0);
    return minimum(beyond * beyond * settings.growth / maximum(share, 1.0), settings.limit);
  }

  GraphBuilder& graph_;
  const AnyModel::Parameters& parameters_;
  const GraphGuards& guards_;
  const PipelineListing& listing_;
  Row excursion_ticks_ = {};
  Row excursion_error_ = {};  ///< the share of the range that may have been wrong in them
  std::optional<Strokes> strokes_ = {};
};

StepGraph plain_step(GraphBuilder& graph, const ModelFile& model, const PipelineListing& listing) {
  const Row raw = graph.input(listing.raw_inputs.size());
  const Row never = graph.truth(false);
  const GraphFeatures features =
      pipeline_features(graph, listing, model.settings, raw, never, never);
  graph.begin_scope(never);
  const GraphEstimate own = add_model(graph, model.parameters, features.all);
  graph.finish(graph.end_scope(), never, never);
  return graph.finished(own.value, model_std_dev(graph, model.settings, own), own.fault);
}

}  // namespace

StepGraph step_graph(const ModelFile& model, const StepGraphOptions& options) {
  const AnyModel own(model.parameters);
  const detail::EstimatorCore core(model.settings, own);
  const FeaturePipeline pipeline(model.settings.features, model.settings.sample_rate_Hz);
  const PipelineListing listing = pipeline.listing();
  const GuardListing guards = core.listing();
  GraphBuilder builder(options.precision);
  StepGraph graph =
      options.has_guards
          ? GuardedStep(builder, model.parameters, {model.settings, guards}, listing).finished()
          : plain_step(builder, model, listing);
  graph.raw_inputs = listing.raw_inputs;
  graph.zeroed_channels = model.settings.zeroed_channels;
  graph.target = model.settings.target;
  graph.sample_rate_Hz = model.settings.sample_rate_Hz;
  graph.family = std::string(model.parameters.family());
  return graph;
}

}  // namespace torsio
