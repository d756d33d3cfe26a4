// An FMU in a program of our own, in the place of an importer: no importer is packaged here.

#include "torsio/export/fmu.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "export/exported_families.hpp"
#include "export/fmu_library.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

constexpr double kPeriod_s = 1e-3;

// Value references of the example: time, two inputs, one zero, three outputs.
constexpr unsigned kGear = 1;
constexpr unsigned kJoint = 2;
constexpr unsigned kZero = 3;
constexpr unsigned kValue = 4;
constexpr unsigned kStdDev = 5;
constexpr unsigned kFault = 6;

/// A motion with missing samples, an excursion and a jump.
std::array<double, 2> fmu_motion(std::size_t n) {
  const auto t = static_cast<double>(n);
  std::array<double, 2> raw{0.06 * std::sin(0.01 * t), 0.02 * std::sin(0.0037 * t)};
  if (n == 700 || (n >= 900 && n < 905)) raw[0] = std::numeric_limits<double>::quiet_NaN();
  if (n == 1200) raw[1] = std::numeric_limits<double>::infinity();
  if (n >= 1500 && n < 1800) raw[0] += 0.2;
  return raw;
}

class FmuOfEachVersion : public testing::TestWithParam<FmiVersion> {
 protected:
  [[nodiscard]] static Fmu fmu_of(const AnyModel& model, CReal real = CReal::twofold,
                                  const std::string& name = "joint") {
    return make_fmu(guarded(model), {.name = name, .version = GetParam(), .real = real},
                    "test.safetensors");
  }
  TemporaryFolder folder_;
};
INSTANTIATE_TEST_SUITE_P(, FmuOfEachVersion, testing::Values(FmiVersion::two, FmiVersion::three),
                         [](const auto& version) {
                           return version.param == FmiVersion::two ? "fmi2" : "fmi3";
                         });

Estimate outputs(FmuInstance& fmu) {
  Estimate estimate;
  int fault = -1;
  EXPECT_EQ(fmu.get(kValue, estimate.value), kFmiOk);
  EXPECT_EQ(fmu.get(kStdDev, estimate.std_dev), kFmiOk);
  EXPECT_EQ(fmu.fault(kFault, fault), kFmiOk);
  estimate.fault = static_cast<Fault>(fault);
  return estimate;
}

/// One step, with the inputs of this tick.
Estimate step(FmuInstance& fmu, std::size_t n, std::size_t ticks = 1) {
  const std::array<double, 2> raw = fmu_motion(n);
  EXPECT_EQ(fmu.set(kGear, raw[0]), kFmiOk);
  EXPECT_EQ(fmu.set(kJoint, raw[1]), kFmiOk);
  EXPECT_EQ(fmu.step(static_cast<double>(n) * kPeriod_s, static_cast<double>(ticks) * kPeriod_s),
            kFmiOk)
      << fmu.message();
  return outputs(fmu);
}

/// Steps both; the largest difference of the values as a share of their range. @param ticks of a communication step
double difference(const FmuLibrary& library, const ModelFile& file, std::size_t ticks = 1) {
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
  FmuInstance fmu(library);
  EXPECT_EQ(fmu.initialize(), kFmiOk);
  double lowest = 0.0;
  double highest = 0.0;
  double worst = 0.0;
  std::size_t in_use = 0;
  for (std::size_t n = 0; n < 3000; n += ticks) {
    const std::array<double, 2> raw = fmu_motion(n);
    Estimate expected;
    for (std::size_t i = 0; i < ticks; ++i) expected = own.step(raw);
    const Estimate found = step(fmu, n, ticks);
    lowest = std::min(lowest, expected.value);
    highest = std::max(highest, expected.value);
    worst = std::max(worst, std::abs(found.value - expected.value));
    EXPECT_EQ(found.fault, expected.fault) << n;
    EXPECT_EQ(std::isnan(found.std_dev), std::isnan(expected.std_dev)) << n;
    if (std::isfinite(expected.std_dev)) {
      EXPECT_NEAR(found.std_dev, expected.std_dev, 1e-4 * expected.std_dev);
    }
    if (expected.fault == Fault::none) ++in_use;
  }
  EXPECT_GT(in_use * ticks, 500U);
  return worst / (highest - lowest);
}

TEST_P(FmuOfEachVersion, IsTheEstimator) {
  for (const AnyModel& model : {any_example<GreyBox>(), any_example<MaxwellSlipModel>(),
                                any_example<Viscoelastic>(), any_example<Linear>()}) {
    const FmuLibrary library(folder_, fmu_of(model));
    EXPECT_LT(difference(library, guarded(model)), 1e-9) << model.family();
  }
}

TEST_P(FmuOfEachVersion, InFloatIsNearlyTheEstimator) {
  const AnyModel model = any_example<Linear>();
  const FmuLibrary library(folder_, fmu_of(model, CReal::single));
  EXPECT_LT(difference(library, guarded(model)), 1e-4);
}

TEST_P(FmuOfEachVersion, HoldsItsInputsForSeveralTicks) {
  const AnyModel model = any_example<MaxwellSlipModel>();
  const FmuLibrary library(folder_, fmu_of(model));
  EXPECT_LT(difference(library, guarded(model), 5), 1e-9);
}

TEST_P(FmuOfEachVersion, RefusesOtherSteps) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  FmuInstance fmu(library);
  ASSERT_EQ(fmu.initialize(2.0), kFmiOk);
  for (const double size_s : {1.5e-3, 0.4e-3, 0.0, -1e-3, 1e-3 * (1.0 + 2e-4), 1e9,
                              std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(fmu.step(2.0, size_s), kFmiError) << size_s;
    EXPECT_THAT(fmu.message(), HasSubstr("only whole multiples of 0.001 s"));
  }
  EXPECT_EQ(fmu.step(2.001, 1e-3), kFmiError);
  EXPECT_THAT(fmu.message(), HasSubstr("ended at 2 s"));
  // What an importer computes as the difference of two times.
  EXPECT_EQ(fmu.step(2.0, 2.001 - 2.0), kFmiOk) << fmu.message();
  EXPECT_EQ(fmu.step(2.001, 0.1), kFmiOk) << fmu.message();
  EXPECT_EQ(fmu.step(2.0, 1e-3), kFmiError);
  double time_s = 0.0;
  EXPECT_EQ(fmu.get(0, time_s), kFmiOk);
  EXPECT_NEAR(time_s, 2.101, 1e-12);
}

TEST_P(FmuOfEachVersion, RefusesOtherValueReferences) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  FmuInstance fmu(library);
  double value = 0.0;
  int fault = 0;
  for (const unsigned reference : {kFault, 7U, 4294967295U}) {
    EXPECT_EQ(fmu.get(reference, value), kFmiError);
    EXPECT_THAT(fmu.message(), HasSubstr("value reference " + std::to_string(reference)));
  }
  for (const unsigned reference : {0U, kValue, kStdDev, kFault, 7U})
    EXPECT_EQ(fmu.set(reference, 1.0), kFmiError) << reference;
  EXPECT_EQ(fmu.fault(kValue, fault), kFmiError);
  EXPECT_THAT(fmu.message(), HasSubstr("value reference 4"));
  EXPECT_EQ(fmu.get(kGear, value), kFmiOk);
  EXPECT_EQ(value, 0.0);
}

TEST_P(FmuOfEachVersion, ASavedStateIsABranch) {
  const FmuLibrary library(folder_, fmu_of(any_example<GreyBox>()));
  FmuInstance fmu(library);
  ASSERT_EQ(fmu.initialize(), kFmiOk);
  std::size_t n = 0;
  for (; n < 1400; ++n) step(fmu, n);
  void* state = nullptr;
  ASSERT_EQ(fmu.get_state(state), kFmiOk);
  std::vector<double> first;
  for (std::size_t i = n; i < n + 800; ++i) first.push_back(step(fmu, i).value);
  ASSERT_EQ(fmu.set_state(state), kFmiOk);
  for (std::size_t i = n; i < n + 800; ++i) ASSERT_EQ(step(fmu, i).value, first[i - n]) << i;

  const std::vector<unsigned char> bytes = fmu.serialized(state);
  FmuInstance other(library);
  void* read = nullptr;
  ASSERT_EQ(other.deserialize(bytes, read), kFmiOk) << other.message();
  ASSERT_EQ(other.set_state(read), kFmiOk);
  for (std::size_t i = n; i < n + 800; ++i) ASSERT_EQ(step(other, i).value, first[i - n]) << i;

  std::vector<unsigned char> damaged = bytes;
  damaged[bytes.size() / 2] ^= 1;
  EXPECT_EQ(other.deserialize(damaged, read), kFmiError);
  EXPECT_THAT(other.message(), HasSubstr("damaged"));
  EXPECT_EQ(other.deserialize({bytes.begin(), bytes.end() - 1}, read), kFmiError);
  damaged = bytes;
  damaged[5] ^= 1;
  EXPECT_EQ(other.deserialize(damaged, read), kFmiError);
  EXPECT_THAT(other.message(), HasSubstr("not a state of this FMU"));
  EXPECT_EQ(fmu.free_state(state), kFmiOk);
  EXPECT_EQ(state, nullptr);
  EXPECT_EQ(fmu.free_state(state), kFmiOk);
  EXPECT_EQ(other.free_state(read), kFmiOk);
  EXPECT_EQ(other.set_state(nullptr), kFmiError);
}

TEST_P(FmuOfEachVersion, InstancesAreIndependent) {
  const FmuLibrary library(folder_, fmu_of(any_example<MaxwellSlipModel>()));
  FmuInstance alone(library);
  FmuInstance one(library);
  FmuInstance two(library);
  for (FmuInstance* fmu : {&alone, &one, &two}) ASSERT_EQ(fmu->initialize(), kFmiOk);
  std::vector<double> expected;
  for (std::size_t n = 0; n < 600; ++n) expected.push_back(step(alone, n).value);
  ASSERT_EQ(two.set(kGear, 0.03), kFmiOk);
  for (std::size_t n = 0; n < 600; ++n) {
    ASSERT_EQ(step(one, n).value, expected[n]) << n;
    ASSERT_EQ(two.step(static_cast<double>(n) * kPeriod_s, kPeriod_s), kFmiOk);
  }
  EXPECT_NE(outputs(two).value, expected.back());
}

TEST_P(FmuOfEachVersion, AResetIsANewInstance) {
  const FmuLibrary library(folder_, fmu_of(any_example<GreyBox>()));
  FmuInstance fmu(library);
  ASSERT_EQ(fmu.set(kZero, 0.01), kFmiOk);
  ASSERT_EQ(fmu.initialize(), kFmiOk);
  for (std::size_t n = 0; n < 400; ++n) step(fmu, n);
  ASSERT_EQ(fmu.call("Reset"), kFmiOk);
  FmuInstance fresh(library);
  for (FmuInstance* each : {&fmu, &fresh}) {
    const Estimate before = outputs(*each);
    EXPECT_EQ(before.value, 0.0);
    EXPECT_TRUE(std::isnan(before.std_dev));
    EXPECT_EQ(before.fault, Fault::warming_up);
    ASSERT_EQ(each->initialize(), kFmiOk);
  }
  for (std::size_t n = 0; n < 400; ++n) ASSERT_EQ(step(fmu, n).value, step(fresh, n).value) << n;
}

TEST_P(FmuOfEachVersion, ZerosAreParameters) {
  const ModelFile file = guarded(any_example<Linear>());
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  FmuInstance fmu(library);
  EXPECT_EQ(fmu.set(kZero, std::numeric_limits<double>::quiet_NaN()), kFmiError);
  EXPECT_THAT(fmu.message(), HasSubstr("must be finite"));
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  own.set_zero("joint_angle_rad", 0.02);
  ASSERT_EQ(fmu.set(kZero, 0.02), kFmiOk);
  ASSERT_EQ(fmu.initialize(), kFmiOk);
  for (std::size_t n = 0; n < 1000; ++n) {
    if (n == 500) {
      own.set_zero("joint_angle_rad", 0.015);
      ASSERT_EQ(fmu.set(kZero, 0.015), kFmiOk);
    }
    const Estimate expected = own.step(fmu_motion(n));
    const Estimate found = step(fmu, n);
    ASSERT_NEAR(found.value, expected.value, 1e-9) << n;
    ASSERT_EQ(found.fault, expected.fault) << n;
  }
  double zero = 0.0;
  EXPECT_EQ(fmu.get(kZero, zero), kFmiOk);
  EXPECT_EQ(zero, 0.015);
}

TEST_P(FmuOfEachVersion, RefusesCallsInTheWrongOrder) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  FmuInstance fmu(library);
  EXPECT_EQ(fmu.step(0.0, kPeriod_s), kFmiError);
  EXPECT_THAT(fmu.message(), HasSubstr("before the initialization"));
  EXPECT_EQ(fmu.call("ExitInitializationMode"), kFmiError);
  EXPECT_EQ(fmu.call("Terminate"), kFmiError);
  ASSERT_EQ(fmu.initialize(), kFmiOk);
  EXPECT_EQ(fmu.initialize(), kFmiError);
  ASSERT_EQ(fmu.step(0.0, kPeriod_s), kFmiOk);
  ASSERT_EQ(fmu.call("Terminate"), kFmiOk);
  EXPECT_EQ(fmu.step(kPeriod_s, kPeriod_s), kFmiError);
  EXPECT_EQ(fmu.set(kGear, 0.0), kFmiError);
  EXPECT_THAT(fmu.message(), HasSubstr("after the end"));
  double value = 0.0;
  EXPECT_EQ(fmu.get(kValue, value), kFmiOk);
}

TEST_P(FmuOfEachVersion, RefusesTheTokenOfAnotherAndAcceptsNull) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  FmuLog log;
  EXPECT_EQ(instantiated(library, "{0}", log), nullptr);
  ASSERT_EQ(log.size(), 1U);
  EXPECT_THAT(log[0], HasSubstr("another FMU"));
  void* const none = nullptr;
  void* state = nullptr;
  double value = 0.0;
  const unsigned reference = kValue;
  const bool is_two = library.is_two();
  EXPECT_EQ(library.call("Reset", none), kFmiError);
  EXPECT_EQ(library.call("Terminate", none), kFmiError);
  EXPECT_EQ(library.call("ExitInitializationMode", none), kFmiError);
  EXPECT_EQ(library.call(is_two ? "GetFMUstate" : "GetFMUState", none, &state), kFmiError);
  EXPECT_EQ(library.call(is_two ? "GetReal" : "GetFloat64", none, &reference, std::size_t{1},
                         &value, std::size_t{1}),
            kFmiError);
  EXPECT_EQ(library.call("DoStep", none, 0.0, kPeriod_s, 1, &value, &value, &value, &value),
            kFmiError);
  library.function<void (*)(void*)>("FreeInstance")(none);
}

TEST_P(FmuOfEachVersion, PrefixesItsFunctionsWhereSeveralAreLinked) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()),
                           GetParam() == FmiVersion::two
                               ? "-DFMI2_FUNCTION_PREFIX=joint_ -fvisibility=default"
                               : "-DFMI3_FUNCTION_PREFIX=joint_ -fvisibility=default");
  const std::string fmi = library.is_two() ? "fmi2" : "fmi3";
  EXPECT_TRUE(library.has("joint_" + fmi + "DoStep"));
  EXPECT_FALSE(library.has(fmi + "DoStep"));
}

TEST_P(FmuOfEachVersion, HasAllFunctionsThatAnImporterLooksFor) {
  const FmuLibrary library(folder_, fmu_of(any_example<Linear>()));
  const std::vector<std::string> of_two{"GetTypesPlatform",
                                        "GetVersion",
                                        "SetDebugLogging",
                                        "Instantiate",
                                        "FreeInstance",
                                        "SetupExperiment",
                                        "EnterInitializationMode",
                                        "ExitInitializationMode",
                                        "Terminate",
                                        "Reset",
                                        "GetReal",
                                        "GetInteger",
                                        "GetBoolean",
                                        "GetString",
                                        "SetReal",
                                        "SetInteger",
                                        "SetBoolean",
                                        "SetString",
                                        "GetFMUstate",
                                        "SetFMUstate",
                                        "FreeFMUstate",
                                        "SerializedFMUstateSize",
                                        "SerializeFMUstate",
                                        "DeSerializeFMUstate",
                                        "GetDirectionalDerivative",
                                        "SetRealInputDerivatives",
                                        "GetRealOutputDerivatives",
                                        "DoStep",
                                        "CancelStep",
                                        "GetStatus",
                                        "GetRealStatus",
                                        "GetIntegerStatus",
                                        "GetBooleanStatus",
                                        "GetStringStatus"};
  std::vector<std::string> of_three{"GetVersion",
                                    "SetDebugLogging",
                                    "InstantiateModelExchange",
                                    "InstantiateCoSimulation",
                                    "InstantiateScheduledExecution",
                                    "FreeInstance",
                                    "EnterInitializationMode",
                                    "ExitInitializationMode",
                                    "EnterEventMode",
                                    "Terminate",
                                    "Reset",
                                    "GetNumberOfVariableDependencies",
                                    "GetVariableDependencies",
                                    "GetFMUState",
                                    "SetFMUState",
                                    "FreeFMUState",
                                    "SerializedFMUStateSize",
                                    "SerializeFMUState",
                                    "DeserializeFMUState",
                                    "GetDirectionalDerivative",
                                    "GetAdjointDerivative",
                                    "EnterConfigurationMode",
                                    "ExitConfigurationMode",
                                    "GetIntervalDecimal",
                                    "GetIntervalFraction",
                                    "GetShiftDecimal",
                                    "GetShiftFraction",
                                    "SetIntervalDecimal",
                                    "SetIntervalFraction",
                                    "SetShiftDecimal",
                                    "SetShiftFraction",
                                    "EvaluateDiscreteStates",
                                    "UpdateDiscreteStates",
                                    "EnterContinuousTimeMode",
                                    "CompletedIntegratorStep",
                                    "SetTime",
                                    "SetContinuousStates",
                                    "GetContinuousStateDerivatives",
                                    "GetEventIndicators",
                                    "GetContinuousStates",
                                    "GetNominalsOfContinuousStates",
                                    "GetNumberOfEventIndicators",
                                    "GetNumberOfContinuousStates",
                                    "EnterStepMode",
                                    "GetOutputDerivatives",
                                    "DoStep",
                                    "ActivateModelPartition"};
  for (const char* type : {"Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32",
                           "UInt32", "Int64", "UInt64", "Boolean", "String", "Binary", "Clock"})
    for (const char* verb : {"Get", "Set"}) of_three.push_back(std::string(verb) + type);
  EXPECT_EQ(of_three.size(), 75U);
  const bool is_two = library.is_two();
  for (const std::string& name : is_two ? of_two : of_three)
    EXPECT_TRUE(library.has((is_two ? "fmi2" : "fmi3") + name)) << name;
  EXPECT_STREQ(library.function<const char* (*)()>("GetVersion")(), is_two ? "2.0" : "3.0");
  FmuInstance fmu(library);
  if (is_two) {
    EXPECT_STREQ(library.function<const char* (*)()>("GetTypesPlatform")(), "default");
    double time_s = -1.0;
    EXPECT_EQ(library.call("GetRealStatus", fmu.address(), 2, &time_s), kFmiOk);
    EXPECT_EQ(time_s, 0.0);
    EXPECT_EQ(library.call("GetRealStatus", fmu.address(), 0, &time_s), kFmiDiscard);
  } else {
    EXPECT_EQ(fmu.call("EnterEventMode"), kFmiError);
    EXPECT_THAT(fmu.message(), HasSubstr("does not have it"));
  }
}

}  // namespace
}  // namespace torsio::test
