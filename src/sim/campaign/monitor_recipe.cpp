#include "sim/campaign/monitor_recipe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "model/linear/linear.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using Expressions = std::vector<std::string>;

constexpr std::uint64_t kSeed = 1;
constexpr double kTurn_rad = 2.0 * std::numbers::pi;

/// A quantity with the delay that all sources have.
std::string delayed(const std::string& expression) {
  return fmt::format("lag(lowpass({}, 100Hz), 1)", expression);
}
std::string speed(const std::string& angle) {
  return fmt::format("lowpass(rate({}), 100Hz)", angle);
}
std::string acceleration(const std::string& angle) { return fmt::format("rate({})", speed(angle)); }

double encoder_step(const SheetValue& bits) { return kTurn_rad / std::exp2(bits.value); }

/// Dry friction of a body that is driven at this angle, a part of it in proportion to the load: Dahl's with
/// distances around that of the presliding, which the load lengthens. A play of some
/// steps of the encoder removes its noise, which would count as motion.
Expressions friction(const std::string& angle, double sliding_rad, const std::string& load,
                     double encoder_step_rad) {
  Expressions terms;
  const std::string moved = fmt::format("{0} - stop({0}, {1:.6g})", angle, 2.5 * encoder_step_rad);
  for (const double share : {0.5, 1.0, 2.0}) {
    const std::string state = fmt::format("dahl({}, {:.6g})", moved, share * sliding_rad);
    terms.push_back(delayed(state));
    terms.push_back(delayed(fmt::format("{} * abs({})", state, load)));
  }
  // The load is what is left of the drive's torque: less where friction acts against it.
  terms.push_back(delayed(fmt::format("dahl({}, {:.6g})^2 * {}", moved, sliding_rad, load)));
  terms.push_back(delayed(fmt::format("tanh(rate({}) / 3)", angle)));
  terms.push_back(speed(angle));
  return terms;
}

std::string rate_of(const std::string& expression) {
  return fmt::format("rate(lowpass({}, 100Hz))", expression);
}

/// The twist of a gear, its hysteresis and damping.
Expressions gear_terms(const std::string& twist, double break_away_rad) {
  const std::string filtered = delayed(twist);
  return {filtered, fmt::format("stop({}, {:.6g})", filtered, break_away_rad),
          fmt::format("stop({}, {:.6g})", filtered, 3.0 * break_away_rad), rate_of(twist)};
}

/// The waves of a strain-wave gear's kinematic error: twice and four times a turn of its input.
Expressions kinematic_waves(const std::string& input) {
  Expressions waves;
  for (const int order : {2, 4})
    for (const char* const wave : {"sin", "cos"})
      waves.push_back(fmt::format("{}({} * {})", wave, order, input));
  return waves;
}

/// A drive before a strain-wave gear: the slope of its kinematic error is one of the transmitted torque.
Expressions through_gear(Expressions drive, const std::string& load, const std::string& input) {
  for (const std::string& wave : kinematic_waves(input))
    drive.push_back(delayed(fmt::format("{} * {}", load, wave)));
  return drive;
}

Expressions with(Expressions first, const Expressions& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

SourceRecipe linear(TorqueSource source, Expressions inputs,
                    std::vector<ChannelDefinition> definitions) {
  return {.source = std::move(source),
          .family = "linear",
          .options = {{"rates", "true"}},
          .features = {.inputs = std::move(inputs), .definitions = std::move(definitions)}};
}

/// A drive: its torque, then its friction.
SourceRecipe drive(TorqueSource source, Expressions torque, const Expressions& friction,
                   std::vector<ChannelDefinition> definitions = {}) {
  const std::size_t count = friction.size();
  SourceRecipe recipe =
      linear(std::move(source), with(std::move(torque), friction), std::move(definitions));
  recipe.friction_inputs = count;
  return recipe;
}

SourceRecipe gear(TorqueSource source, const ChannelDefinition& twist, double break_away_rad,
                  const std::string& input) {
  SourceRecipe recipe = linear(std::move(source), gear_terms(twist.name, break_away_rad), {twist});
  recipe.gear_twist = twist.name;
  recipe.gear_input = input;
  return recipe;
}

SourceRecipe spring(TorqueSource source, const std::string& deflection, const std::string& angle,
                    std::vector<ChannelDefinition> definitions = {}) {
  Expressions inputs{delayed(deflection), fmt::format("lowpass(rate({}), 10Hz)", deflection)};
  if (!angle.empty()) inputs.push_back(fmt::format("lowpass(rate({}), 10Hz)", angle));
  return {.source = std::move(source),
          .family = "grey_box",
          .options = {{"residual", "none"}},
          .features = {.inputs = std::move(inputs), .definitions = std::move(definitions)}};
}

MonitoredSignal encoder(std::string name, std::string moves_with = {},
                        double turn_rad = kTurn_rad) {
  return {.name = std::move(name), .turn = turn_rad, .moves_with = std::move(moves_with)};
}

MonitorRecipe series_elastic(const DataSheet& sheet) {
  const double ratio = std::get<GearSheet>(sheet.first).ratio.value;
  const double break_away_rad = std::get<GearSheet>(sheet.first).break_away_rad.value;
  const std::string motor = "motor_angle_rad";
  const ChannelDefinition twist{"gear_twist_rad",
                                fmt::format("motor_angle_rad / {} - gear_angle_rad", ratio)};
  const ChannelDefinition deflection{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"};
  const std::string current = "motor_current_A";
  MonitorRecipe recipe;
  recipe.sources.push_back(
      drive({"current", {"current_sensor", "motor_encoder", "torque_constant", "friction"}},
            through_gear({delayed(current), acceleration(motor)}, current, motor),
            friction(motor, sheet.friction.bristle_rad.value, current,
                     encoder_step(sheet.sensors.motor_encoder_bits)),
            {}));
  recipe.sources.push_back(
      gear({"gear", {"motor_encoder", "gear_encoder", "gear"}}, twist, break_away_rad, motor));
  recipe.sources.push_back(spring({"spring", {"gear_encoder", "joint_encoder", "spring"}},
                                  deflection.name, "joint_angle_rad", {deflection}));
  recipe.plan.signals = {encoder(motor, "gear_angle_rad"),
                         encoder("gear_angle_rad", motor),
                         encoder("joint_angle_rad", "gear_angle_rad"),
                         {.name = current},
                         {.name = "gear_angle_rad - joint_angle_rad"},
                         {.name = twist.expression}};
  return recipe;
}

MonitorRecipe harmonic_drive(const DataSheet& sheet) {
  const auto tube_ratio = std::get<TubeSheet>(sheet.first).ratio.value;
  const auto& strain_wave = std::get<GearSheet>(sheet.second);
  const std::string motor = "motor_angle_rad";
  const std::string wave = "wave_generator_angle_rad";
  const std::string torque = "motor_torque_Nm";
  const ChannelDefinition tube{"tube_twist_rad",
                               fmt::format("{} / {} - {}", motor, tube_ratio, wave)};
  const ChannelDefinition twist{
      "gear_twist_rad", fmt::format("{} / {} - joint_angle_rad", wave, strain_wave.ratio.value)};
  const double sliding_rad = sheet.friction.bristle_rad.value;
  const double wave_step_rad = encoder_step(sheet.sensors.middle_encoder_bits);
  MonitorRecipe recipe;
  recipe.sources.push_back(
      drive({"current",
             {"current_sensor", "motor_encoder", "wave_encoder", "torque_constant", "friction"}},
            through_gear({delayed(torque), acceleration(motor), acceleration(wave), speed(motor)},
                         torque, wave),
            friction(wave, sliding_rad, torque, wave_step_rad), {}));
  recipe.sources.push_back(gear({"gear", {"wave_encoder", "joint_encoder", "gear"}}, twist,
                                strain_wave.break_away_rad.value, wave));
  recipe.sources.push_back(drive(
      {"spring", {"motor_encoder", "wave_encoder", "spring", "friction"}},
      through_gear({delayed(tube.name), rate_of(tube.name), acceleration(wave)}, tube.name, wave),
      friction(wave, sliding_rad, tube.name, wave_step_rad), {tube}));
  recipe.plan.signals = {
      encoder(motor, wave), encoder(wave, motor),      encoder("joint_angle_rad", wave),
      {.name = torque},     {.name = tube.expression}, {.name = twist.expression}};
  return recipe;
}

MonitorRecipe elastomer(const DataSheet& sheet) {
  const std::string motor = "motor_angle_rad";
  const std::string current = "motor_current_A";
  const std::string twist = "spring_deflection_rad";
  MonitorRecipe recipe;
  recipe.sources.push_back(
      drive({"current", {"current_sensor", "motor_encoder", "torque_constant", "friction"}},
            through_gear({delayed(current), acceleration(motor)}, current, motor),
            friction(motor, sheet.friction.bristle_rad.value, current,
                     encoder_step(sheet.sensors.motor_encoder_bits)),
            {}));
  recipe.sources.push_back(spring({"spring", {"twist_sensor", "spring"}}, twist, ""));
  recipe.plan.signals = {encoder(motor), {.name = twist}, {.name = current}};
  return recipe;
}

MonitorRecipe rubber_clutch(const DataSheet& sheet) {
  const double ratio = std::get<ClutchSheet>(sheet.first).ratio.value;
  const std::string input = "input_angle_rad";
  const std::string current = "motor_current_A";
  const ChannelDefinition deflection{"spring_deflection_rad", "input_angle_rad - joint_angle_rad"};
  MonitorRecipe recipe;
  recipe.sources.push_back(
      drive({"current", {"current_sensor", "motor_encoder", "torque_constant", "friction"}},
            {delayed(current), acceleration(input)},
            friction(input, sheet.friction.bristle_rad.value / ratio, current,
                     encoder_step(sheet.sensors.motor_encoder_bits) / ratio),
            {}));
  recipe.sources.push_back(spring({"spring", {"motor_encoder", "joint_encoder", "spring"}},
                                  deflection.name, "joint_angle_rad", {deflection}));
  recipe.plan.signals = {encoder(input, "joint_angle_rad", kTurn_rad / ratio),
                         encoder("joint_angle_rad", input),
                         {.name = current},
                         {.name = deflection.expression}};
  return recipe;
}

MonitorRecipe recipe_of(const DataSheet& sheet) {
  switch (sheet.family) {
    case ActuatorFamily::series_elastic: break;
    case ActuatorFamily::elastomer: return elastomer(sheet);
    case ActuatorFamily::rubber_clutch: return rubber_clutch(sheet);
    case ActuatorFamily::harmonic_drive: return harmonic_drive(sheet);
  }
  return series_elastic(sheet);
}

/// The torque is K (twist + error): linear in the twist and the waves, which gives the error over K.
std::string with_kinematic_error(const SourceRecipe& recipe, const ChannelDefinition& twist,
                                 const Dataset& dataset, const Progress& progress) {
  const Expressions waves = kinematic_waves(recipe.gear_input);
  ModelChoice choice{
      .family = "linear",
      .options = {{"rates", "true"}},
      .features = {.inputs = {delayed(twist.name), rate_of(twist.name)}, .definitions = {twist}}};
  for (const std::string& wave : waves) choice.features.inputs.push_back(delayed(wave));
  const TrainedModel first = train_model(dataset, choice, kSeed, progress);
  const auto coefficient = [&](std::size_t input) { return first.table.at(input).value; };
  const double stiffness_Nm_rad = coefficient(1);
  std::string corrected = twist.expression;
  for (std::size_t i = 0; i < waves.size(); ++i)
    corrected += fmt::format(" + {:.6e} * {}", coefficient(3 + i) / stiffness_Nm_rad, waves[i]);
  return corrected;
}

/// Work is rougher than a training recording of minutes. These models are linear or continue linearly: the
/// monitor has limits of its own for signals, and compares the sources.
void widen(EstimatorSettings& settings) {
  constexpr double kShare = 1.0;
  constexpr double kSteps = 3.0;
  for (std::size_t i = 0; i < settings.ranges.lowest.size(); ++i) {
    const double wider = kShare * (settings.ranges.highest[i] - settings.ranges.lowest[i]);
    settings.ranges.lowest[i] -= wider;
    settings.ranges.highest[i] += wider;
  }
  for (double& step : settings.disturbances.largest_step) step *= kSteps;
}

/// The inputs [begin, end) of a linear model under their names in `inputs`, with or without its bias.
ModelFile part_of(const ModelFile& whole, const Expressions& inputs, std::size_t begin,
                  std::size_t end, bool has_bias) {
  ModelFile part = whole;
  const auto cut = [&](auto& values) {
    values = {values.begin() + static_cast<std::ptrdiff_t>(begin),
              values.begin() + static_cast<std::ptrdiff_t>(end)};
  };
  EstimatorSettings& settings = part.settings;
  settings.features.inputs = inputs;
  cut(settings.features.inputs);
  cut(settings.ranges.lowest);
  cut(settings.ranges.highest);
  cut(settings.fallback.slope);
  if (!has_bias) settings.fallback.intercept = 0.0;
  const auto channels = [](const EstimatorSettings& of) {
    return FeaturePipeline(of.features, of.sample_rate_Hz).raw_inputs();
  };
  const std::vector<std::string> before = channels(whole.settings);
  std::vector<double> largest_step;
  for (const std::string& channel : channels(settings)) {
    const auto place = std::ranges::find(before, channel) - before.begin();
    largest_step.push_back(
        whole.settings.disturbances.largest_step.at(static_cast<std::size_t>(place)));
  }
  settings.disturbances.largest_step = std::move(largest_step);
  const Matrix& all = whole.parameters.get<Linear::Parameters>().coefficients.values;
  Matrix values(1, 1 + end - begin);
  values(0, 0) = has_bias ? all(0, 0) : 0.0;
  for (std::size_t i = begin; i < end; ++i) values(0, 1 + i - begin) = all(0, 1 + i);
  part.parameters = Linear::Parameters{.coefficients = {.values = std::move(values)}};
  return part;
}

constexpr std::string_view kFactor = "friction_factor_1";

/// Every record has a temperature of its own: the factor of its friction that explains it best.
std::vector<double> friction_factors(const FittedSource& drive, const Dataset& dataset) {
  std::vector<double> factors;
  for (const DatasetRecord& record : dataset.records) {
    const auto values = [&](const ModelFile& model) {
      return estimate_recording(make_estimator(model), record.recording)
          .channels.channel(estimate_channel(model.settings.target))
          .values;
    };
    const std::vector<double> torque_Nm = values(drive.torque);
    const std::vector<double> friction_Nm = values(*drive.friction);
    const std::vector<double>& measured_Nm = record.recording.channel(dataset.target).values;
    double product = 0.0;
    double square = 0.0;
    for (std::size_t n = 0; n < torque_Nm.size(); ++n) {
      product += friction_Nm[n] * (measured_Nm[n] - torque_Nm[n]);
      square += friction_Nm[n] * friction_Nm[n];
    }
    factors.push_back(square > 0.0 ? std::clamp(product / square, 0.3, 3.0) : 1.0);
  }
  // Their mean is 1: the friction of the model is that of the mean temperature.
  double mean = 0.0;
  for (const double factor : factors) mean += factor / static_cast<double>(factors.size());
  for (double& factor : factors) factor /= mean;
  return factors;
}

/// A drive whose friction has another factor in each record: the coefficients for given factors and the
/// factors for given coefficients, in turns.
FittedSource fit_drive(const SourceRecipe& recipe, ModelChoice choice, const Dataset& dataset,
                       const Progress& progress) {
  constexpr int kTurns = 4;
  const Expressions inputs = choice.features.inputs;
  const std::size_t first = inputs.size() - recipe.friction_inputs;
  for (std::size_t i = first; i < inputs.size(); ++i)
    choice.features.inputs[i] = fmt::format("{} * {}", kFactor, inputs[i]);
  std::vector<double> factors(dataset.records.size(), 1.0);
  FittedSource fitted{
      .torque = ModelFile{.card = {}, .settings = {}, .parameters = Linear::Parameters{}},
      .friction = {}};
  for (int turn = 0; turn < kTurns; ++turn) {
    Dataset scaled = dataset;
    for (std::size_t r = 0; r < factors.size(); ++r) {
      Recording& recording = scaled.records[r].recording;
      recording.add({.name = std::string(kFactor),
                     .values = std::vector<double>(recording.size(), factors[r])});
    }
    ModelFile whole = train_model(scaled, choice, kSeed, progress).file;
    widen(whole.settings);
    fitted.torque = part_of(whole, inputs, 0, first, true);
    fitted.friction = part_of(whole, inputs, first, inputs.size(), false);
    factors = friction_factors(fitted, dataset);
  }
  return fitted;
}

}  // namespace

SourceModel FittedSource::model() const {
  SourceModel model{.torque = make_estimator(torque)};
  if (friction) model.friction = make_estimator(*friction);
  return model;
}

Recording with_source_delay(const Recording& recording) {
  Recording result(recording.name(), recording.sample_rate_Hz(), recording.time_s(0));
  result.source = recording.source;
  for (Channel channel : recording.channels()) {
    if (channel.name == "torque_Nm" || channel.name == "truth_torque_Nm") {
      FeaturePipeline delay({.inputs = {delayed("torque_Nm")}, .definitions = {}},
                            recording.sample_rate_Hz());
      for (double& value : channel.values) value = delay.step({&value, 1})[0];
    }
    result.add(std::move(channel));
  }
  return result;
}

FittedSource fit_source(const SourceRecipe& recipe, const Dataset& dataset,
                        const Progress& progress) {
  ModelChoice choice{
      .family = recipe.family, .options = recipe.options, .features = recipe.features};
  for (ChannelDefinition& definition : choice.features.definitions)
    if (definition.name == recipe.gear_twist)
      definition.expression = with_kinematic_error(recipe, definition, dataset, progress);
  if (recipe.friction_inputs > 0) return fit_drive(recipe, choice, dataset, progress);
  FittedSource fitted{.torque = train_model(dataset, choice, kSeed, progress).file, .friction = {}};
  widen(fitted.torque.settings);
  return fitted;
}

MonitorRecipe monitor_recipe(const DataSheet& sheet) {
  MonitorRecipe recipe = recipe_of(sheet);
  for (SourceRecipe& source : recipe.sources) {
    // One supply and one clock for all: what they change, no comparison of the sources shows.
    source.source.depends_on.emplace_back("supply");
    source.source.depends_on.emplace_back("clock");
    recipe.plan.sources.push_back(source.source);
  }
  return recipe;
}

}  // namespace torsio
