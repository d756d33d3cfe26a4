#include "torsio/mujoco/mujoco_springs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <optional>
#include <random>
#include <utility>

#include "estimate/branching_estimator.hpp"
#include "estimate/motion_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A channel as a sum of positions or speeds of hinges.
struct Reading {
  struct Part {
    int address = 0;
    double factor = 0.0;
  };
  std::array<Part, 2> parts = {};
  bool is_speed = false;

  [[nodiscard]] double from(const mjData& data) const noexcept {
    const mjtNum* const values = is_speed ? data.qvel : data.qpos;
    return parts[0].factor * values[parts[0].address] + parts[1].factor * values[parts[1].address];
  }
};

std::string name_of(const mjModel& model, int kind, int id) {
  const char* const name = mj_id2name(&model, kind, id);
  return name == nullptr || *name == '\0' ? fmt::format("number {}", id) : name;
}

std::vector<std::string> names_of(const mjModel& model, int kind, int count) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(count));
  for (int id = 0; id < count; ++id) names.push_back(name_of(model, kind, id));
  return names;
}

/// A spring's actuator and the two hinges of its tendon.
struct Place {
  const mjModel& model;
  int actuator = 0;
  int gear_hinge = 0;
  int joint_hinge = 0;

  [[nodiscard]] std::string title() const {
    return fmt::format("MuJoCo actuator {}", name_of(model, mjOBJ_ACTUATOR, actuator));
  }
  [[noreturn]] void refuse(std::string expected, std::string found, std::string advice = {}) const {
    throw UsageError({.place = title(),
                      .expected = std::move(expected),
                      .found = std::move(found),
                      .advice = std::move(advice)});
  }
};

int hinge_of(const Place& place, std::string_view what, int joint) {
  if (place.model.jnt_type[joint] != mjJNT_HINGE)
    place.refuse(
        fmt::format("a hinge as {}", what),
        fmt::format("the joint {} of another type", name_of(place.model, mjOBJ_JOINT, joint)));
  return joint;
}

void check_actuator(const Place& place) {
  const mjModel& model = place.model;
  const int id = place.actuator;
  if (model.actuator_biastype[id] != mjBIAS_USER)
    place.refuse(R"(biastype="user")", "another biastype");
  if (model.actuator_gaintype[id] != mjGAIN_FIXED ||
      model.actuator_gainprm[static_cast<std::ptrdiff_t>(id) * mjNGAIN] != 0.0 ||
      model.actuator_dyntype[id] != mjDYN_NONE)
    place.refuse(R"(gaintype="fixed", gainprm="0" and no dyntype)",
                 "an actuator whose force depends on its control");
  if (model.actuator_gear[static_cast<std::ptrdiff_t>(id) * 6] == 0.0)
    place.refuse(R"(gear="-1" or another number but 0)", "0");
  if (model.actuator_trntype[id] != mjTRN_TENDON)
    place.refuse("the tendon of the deflection as its transmission", "another transmission");
}

/// Finds the hinges of the tendon.
void find_hinges(Place& place) {
  const mjModel& model = place.model;
  const int tendon = model.actuator_trnid[static_cast<std::ptrdiff_t>(place.actuator) * 2];
  const int first = model.tendon_adr[tendon];
  const char* const expected =
      R"(a fixed tendon of two hinges, the gear side with coef="1" and the joint with coef="-1")";
  if (model.tendon_num[tendon] != 2)
    place.refuse(expected, fmt::format("a tendon of {} parts", model.tendon_num[tendon]));
  std::optional<int> gear;
  std::optional<int> joint;
  for (int i = first; i < first + 2; ++i) {
    if (model.wrap_type[i] != mjWRAP_JOINT) place.refuse(expected, "a spatial tendon");
    if (model.wrap_prm[i] == 1.0) gear = model.wrap_objid[i];
    if (model.wrap_prm[i] == -1.0) joint = model.wrap_objid[i];
  }
  if (!gear || !joint)
    place.refuse(expected, fmt::format("the coefficients {:g} and {:g}", model.wrap_prm[first],
                                       model.wrap_prm[first + 1]));
  if (model.tendon_stiffness[tendon] != 0.0)
    place.refuse("a tendon without a stiffness: the model has that of the spring",
                 fmt::format("stiffness=\"{:g}\"", model.tendon_stiffness[tendon]));
  place.gear_hinge = hinge_of(place, "the gear side", *gear);
  place.joint_hinge = hinge_of(place, "the joint", *joint);
}

Place place_of(const mjModel& model, const std::string& actuator) {
  const int id = mj_name2id(&model, mjOBJ_ACTUATOR, actuator.c_str());
  if (id < 0)
    throw UsageError({.place = fmt::format("MuJoCo actuator {}", actuator),
                      .expected = fmt::format(
                          "one of {}", fmt::join(names_of(model, mjOBJ_ACTUATOR, model.nu), ", ")),
                      .found = "an actuator that the model does not have"});
  Place place{.model = model, .actuator = id};
  check_actuator(place);
  find_hinges(place);
  return place;
}

Reading::Part part_of(const mjModel& model, int hinge, bool is_speed, double factor) {
  return {.address = is_speed ? model.jnt_dofadr[hinge] : model.jnt_qposadr[hinge],
          .factor = factor};
}

std::optional<Reading> mapped(const Place& place, const MujocoSpring& spring,
                              const std::string& channel) {
  const auto found = std::ranges::find(spring.channels, channel, &MujocoChannel::channel);
  if (found == spring.channels.end()) return std::nullopt;
  const int joint = mj_name2id(&place.model, mjOBJ_JOINT, found->joint.c_str());
  if (joint < 0)
    place.refuse(fmt::format("a hinge for the channel {}: one of {}", channel,
                             fmt::join(names_of(place.model, mjOBJ_JOINT, place.model.njnt), ", ")),
                 found->joint);
  if (!std::isfinite(found->factor))
    place.refuse("a finite factor", fmt::format("{:g} for {}", found->factor, channel));
  const auto parts = split_channel_name(channel);
  const std::string_view unit = parts ? parts->unit->si_suffix : std::string_view();
  if (unit != "rad" && unit != "rad_s")
    place.refuse("a channel in rad or rad_s, which a hinge has", channel);
  hinge_of(place, channel, joint);
  Reading reading{.is_speed = unit == "rad_s"};
  reading.parts.fill(part_of(place.model, joint, reading.is_speed, 0.0));
  reading.parts[0].factor = found->factor;
  return reading;
}

std::vector<std::string_view> known_channels() {
  std::vector<std::string_view> names;
  names.reserve(kMotionChannels.size());
  for (const MotionChannel& each : kMotionChannels) names.push_back(each.name);
  return names;
}

Reading reading_of(const Place& place, const MujocoSpring& spring, const std::string& channel) {
  if (const auto reading = mapped(place, spring, channel)) return *reading;
  const MotionChannel* const known = find_motion_channel(channel);
  if (known == nullptr)
    place.refuse(
        fmt::format("a model whose channels MuJoCo has: {}", fmt::join(known_channels(), ", ")),
        fmt::format("the channel {}", channel),
        "Train a model without it, or map it to a hinge (MujocoSpring::channels).");
  if (known->is_of_motor && !(std::abs(spring.gear_ratio) > 0.0))
    place.refuse(fmt::format("the ratio of the gear, since the model uses {}", channel),
                 fmt::format("{:g}", spring.gear_ratio), "Set MujocoSpring::gear_ratio.");
  const double gear = known->gear * (known->is_of_motor ? spring.gear_ratio : 1.0);
  return {.parts = {part_of(place.model, place.gear_hinge, known->is_speed, gear),
                    part_of(place.model, place.joint_hinge, known->is_speed, known->joint)},
          .is_speed = known->is_speed};
}

/// The time between two ticks on MuJoCo's clock.
double period_of(const Place& place, const Estimator& estimator) {
  constexpr double kTolerance = 1e-3;  // as that of a model's rate
  const double step_s = place.model.opt.timestep;
  const double rate_Hz = estimator.settings().sample_rate_Hz;
  const double steps = std::round(1.0 / (rate_Hz * step_s));
  if (!(steps >= 1.0) || std::abs(rate_Hz * step_s * steps - 1.0) > kTolerance)
    place.refuse(
        fmt::format("a model at {:g} Hz, 1 / timestep, or at a whole part of that", 1.0 / step_s),
        fmt::format("a model at {:g} Hz with timestep=\"{:g}\"", rate_Hz, step_s),
        fmt::format("Set timestep=\"{:.9g}\", or load the model for this rate: "
                    "load_estimator(path, {{.rate_Hz = {:.9g}}}).",
                    1.0 / rate_Hz, 1.0 / step_s));
  return steps * step_s;
}

Estimator with_zeros(Estimator estimator) {
  const std::vector<std::string> unset = estimator.unset_zeros();
  for (const std::string& channel : unset) estimator.set_zero(channel, 0.0);
  return estimator;
}

void check_target(const Place& place, const Estimator& estimator) {
  const std::string& target = estimator.settings().target;
  if (const auto parts = split_channel_name(target); !parts || parts->unit->si_suffix != "Nm")
    place.refuse("a model whose target is a torque in Nm", fmt::format("the target '{}'", target));
}

std::size_t record_size_of(const Estimator& estimator) noexcept {
  return BranchingEstimator::record_size(estimator.state_size());
}

}  // namespace

struct MujocoSprings::Adapter {
  struct Spring {
    int actuator = 0;
    double force_per_torque = 0.0;  ///< force of the actuator over torque on the joint
    std::size_t first_userdata = 0;
    std::vector<Reading> readings = {};
    BranchingEstimator estimator;

    [[nodiscard]] std::span<mjtNum> record(const mjData& data) const noexcept {
      // What `userdata` points at is not const.
      return {data.userdata + first_userdata, estimator.record_size()};
    }
    std::span<const double> read(
        const mjData& data,
        std::array<double, BranchingEstimator::kMaxInputs>& raw) const noexcept {
      for (std::size_t i = 0; i < readings.size(); ++i) raw[i] = readings[i].from(data);
      return std::span(raw).first(readings.size());
    }
  };

  /// The adapters of the process, found by the numbers in their models.
  static constexpr std::uint64_t kMaxAdapters = 1024;
  static std::array<std::atomic<const Adapter*>, kMaxAdapters>& all() noexcept {
    static std::array<std::atomic<const Adapter*>, kMaxAdapters> adapters = {};
    return adapters;
  }
  /// The callback that was registered before.
  static std::atomic<mjfAct>& previous() noexcept {
    static std::atomic<mjfAct> callback = nullptr;
    return callback;
  }
  static std::mutex& registration() noexcept {
    static std::mutex mutex;
    return mutex;
  }

  Adapter() = default;
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;
  ~Adapter() {
    const std::lock_guard lock(registration());
    if (number != 0) all()[number % kMaxAdapters].store(nullptr);
  }

  /// Takes a free place and a number that no other adapter has, of another process either: a saved model may contain it.
  void enter() {
    const std::lock_guard lock(registration());
    if (mjcb_act_bias != &act_bias) {
      previous().store(mjcb_act_bias);
      mjcb_act_bias = &act_bias;
    }
    for (std::uint64_t place = 0; place < kMaxAdapters; ++place) {
      if (all()[place].load() != nullptr) continue;
      std::random_device random;
      number = (std::uint64_t{random()} + 1) * kMaxAdapters + place;
      all()[place].store(this);
      return;
    }
    throw Error({.place = "springs of MuJoCo",
                 .expected = fmt::format("at most {} adapters at a time", kMaxAdapters),
                 .found = "one more",
                 .advice = "Threads can share a model and its adapter, each with its own mjData."});
  }

  static const Spring* find(const mjModel& model, int actuator) noexcept {
    const mjtNum* const parameters =
        model.actuator_biasprm + static_cast<std::ptrdiff_t>(actuator) * mjNBIAS;
    constexpr double kLargest = 9e15;  // every whole number up to it is a double
    if (!(parameters[0] >= 1.0 && parameters[0] <= kLargest)) return nullptr;
    const auto number = static_cast<std::uint64_t>(parameters[0]);
    const Adapter* const adapter = all()[number % kMaxAdapters].load(std::memory_order_acquire);
    if (adapter == nullptr || adapter->number != number) return nullptr;
    for (const Spring& spring : adapter->springs)
      if (spring.actuator == actuator) return &spring;
    return nullptr;
  }

  static mjtNum act_bias(const mjModel* model, const mjData* data, int actuator) {
    const Spring* const spring = find(*model, actuator);
    if (spring == nullptr) {
      const mjfAct other = previous().load(std::memory_order_relaxed);
      return other == nullptr ? 0.0 : other(model, data, actuator);
    }
    std::array<double, BranchingEstimator::kMaxInputs> raw{};
    return spring->force_per_torque *
           spring->estimator.value(spring->record(*data), data->time, spring->read(*data, raw));
  }

  std::uint64_t number = 0;
  std::vector<Spring> springs = {};
};

MujocoSprings::MujocoSprings(mjModel& model, const std::vector<MujocoSpring>& springs,
                             MujocoOptions options)
    : adapter_(std::make_unique<Adapter>()) {
  std::size_t next = options.first_userdata;
  for (const MujocoSpring& each : springs) {
    const Place place = place_of(model, each.actuator);
    if (std::ranges::find(adapter_->springs, place.actuator, &Adapter::Spring::actuator) !=
        adapter_->springs.end())
      place.refuse("one spring for each actuator", "a second one");
    check_target(place, each.estimator);
    const double period_s = period_of(place, each.estimator);
    Adapter::Spring spring{
        .actuator = place.actuator,
        .force_per_torque =
            -1.0 / model.actuator_gear[static_cast<std::ptrdiff_t>(place.actuator) * 6],
        .first_userdata = next,
        .estimator = BranchingEstimator(with_zeros(each.estimator), period_s, options.threads)};
    for (const std::string& channel : each.estimator.raw_inputs())
      spring.readings.push_back(reading_of(place, each, channel));
    next += spring.estimator.record_size();
    adapter_->springs.push_back(std::move(spring));
  }
  if (model.nuserdata < 0 || static_cast<std::size_t>(model.nuserdata) < next)
    throw UsageError({.place = "springs of MuJoCo",
                      .expected = fmt::format("<size nuserdata=\"{}\"/> or more", next),
                      .found = fmt::format("nuserdata=\"{}\"", model.nuserdata)});
  adapter_->enter();
  for (const Adapter::Spring& spring : adapter_->springs)
    model.actuator_biasprm[static_cast<std::ptrdiff_t>(spring.actuator) * mjNBIAS] =
        static_cast<double>(adapter_->number);
}

MujocoSprings::MujocoSprings(MujocoSprings&& other) noexcept = default;
MujocoSprings& MujocoSprings::operator=(MujocoSprings&& other) noexcept = default;
MujocoSprings::~MujocoSprings() = default;

std::size_t MujocoSprings::userdata_size(std::span<const MujocoSpring> springs) noexcept {
  std::size_t size = 0;
  for (const MujocoSpring& spring : springs) size += record_size_of(spring.estimator);
  return size;
}

std::size_t MujocoSprings::size() const noexcept { return adapter_->springs.size(); }

void MujocoSprings::commit(mjData& data) const noexcept {
  for (const Adapter::Spring& spring : adapter_->springs)
    spring.estimator.commit(spring.record(data), data.time);
}

Estimate MujocoSprings::estimate(const mjData& data, std::size_t spring) const noexcept {
  const Adapter::Spring& found = adapter_->springs[spring];
  return BranchingEstimator::last(found.record(data));
}

void MujocoSprings::settle(mjData& data, double longest_s) const noexcept {
  for (const Adapter::Spring& spring : adapter_->springs) {
    std::array<double, BranchingEstimator::kMaxInputs> raw{};
    spring.estimator.settle(spring.record(data), spring.read(data, raw), longest_s);
  }
}

}  // namespace torsio
