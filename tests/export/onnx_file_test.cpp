// ONNX files that torsio writes: valid graphs, and networks that `torsio import` reads back.

#include "torsio/export/onnx_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <onnx/checker.h>
#include <onnx/onnx_pb.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "export/exported_families.hpp"
#include "support/random_network.hpp"
#include "torsio/core/error.hpp"
#include "torsio/import/import_network.hpp"
#include "torsio/import/onnx_network.hpp"

namespace torsio::test {
namespace {

onnx::ModelProto parsed(const std::string& bytes) {
  onnx::ModelProto model;
  EXPECT_TRUE(model.ParseFromString(bytes));
  return model;
}

std::string metadata_of(const onnx::ModelProto& model, const std::string& key) {
  for (const auto& entry : model.metadata_props())
    if (entry.key() == key) return entry.value();
  return {};
}

template <class Family>
class OnnxFiles : public testing::Test {};
TYPED_TEST_SUITE(OnnxFiles, Exported, ExportedName);

TYPED_TEST(OnnxFiles, AreValidGraphs) {
  for (const GraphPrecision precision :
       {GraphPrecision::single, GraphPrecision::mixed, GraphPrecision::twofold}) {
    const std::string bytes = onnx_bytes(remembering(any_example<TypeParam>()),
                                         {.precision = precision, .origin = "test.safetensors"});
    const onnx::ModelProto model = parsed(bytes);
    EXPECT_NO_THROW(onnx::checker::check_model(model));
    EXPECT_EQ(model.graph().input(0).name(), "inputs");
    EXPECT_EQ(metadata_of(model, "inputs"), R"(["gear_angle_rad","joint_angle_rad"])");
    EXPECT_EQ(metadata_of(model, "sample_rate_Hz"), "1000");
  }
}

/// The features that simulators give to a learned actuator.
ModelFile driven(const AnyModel& model, std::vector<std::string> inputs) {
  ModelFile file = guarded(model);
  file.settings.features.inputs = std::move(inputs);
  return file;
}

const std::vector<std::string> kDriveInputs{"joint_speed_rad_s",
                                            "joint_target_rad - joint_angle_rad"};

ModelFile imported(const std::string& bytes) {
  const ForeignNetwork network = parse_onnx(std::as_bytes(std::span(bytes)), "test.onnx", "output");
  ImportOptions options;
  options.features.inputs = kDriveInputs;
  options.target = "torque_Nm";
  options.sample_rate_Hz = 1000.0;
  return import_network(network, {}, options, nullptr).file;
}

template <class Family>
class NetworkFiles : public testing::Test {};
using Networks = testing::Types<Mlp, Gru, Lstm>;
TYPED_TEST_SUITE(NetworkFiles, Networks, ExportedName);

TYPED_TEST(NetworkFiles, AreReadBackAsTheSameNetwork) {
  const ModelFile file = guarded(any_example<TypeParam>());
  const std::string bytes = onnx_bytes(file, {.layout = OnnxLayout::network});
  EXPECT_NO_THROW(onnx::checker::check_model(parsed(bytes)));
  AnyModel own(file.parameters);
  AnyModel again(imported(bytes).parameters);
  double largest = 0.0;
  for (int n = 0; n < 400; ++n) {
    const std::vector<double> x{0.1 * std::sin(0.05 * n), std::cos(0.03 * n)};
    const double expected = own.step(x).value;
    largest = std::max(largest, std::abs(expected));
    EXPECT_NEAR(again.step(x).value, expected, 1e-5 * largest);
  }
}

/// Newton's states have one number of units.
template <class Family>
AnyModel even_network() {
  return AnyModel(AnyModel::Parameters(random_network<Family>({.units = {6, 6}}, 3)));
}

TYPED_TEST(NetworkFiles, HaveTheInputsOfNewton) {
  const ModelFile file = driven(even_network<TypeParam>(), kDriveInputs);
  const std::string bytes = onnx_bytes(file, {.layout = OnnxLayout::newton});
  const onnx::ModelProto model = parsed(bytes);
  EXPECT_NO_THROW(onnx::checker::check_model(model));
  const auto metadata = nlohmann::json::parse(metadata_of(model, "metadata"));
  EXPECT_EQ(metadata["sample_rate_Hz"], 1000.0);
  if (TypeParam::kFamily == "mlp") {
    EXPECT_EQ(metadata["input_idx"], std::vector<int>{0});
    return;
  }
  EXPECT_EQ(model.graph().input(1).name(), "hidden");
  EXPECT_EQ(model.graph().input(1).type().tensor_type().shape().dim(0).dim_value(), 2);
  if (TypeParam::kFamily == "gru")
    EXPECT_EQ(metadata["input_columns"], (std::vector<std::string>{"position_error", "velocity"}));
  else
    EXPECT_EQ(metadata["hidden_size"], 6);
}

TEST(NewtonLayouts, HaveCentresAndScalesInTheWeights) {
  const ModelFile file = driven(even_network<Mlp>(), kDriveInputs);
  AnyModel own(file.parameters);
  AnyModel again(imported(onnx_bytes(file, {.layout = OnnxLayout::newton})).parameters);
  for (int n = 0; n < 400; ++n) {
    const double speed_rad_s = 0.1 * std::sin(0.05 * n);
    const double error_rad = std::cos(0.03 * n);
    const double expected = own.step(std::vector{speed_rad_s, error_rad}).value;
    EXPECT_NEAR(again.step(std::vector{error_rad, speed_rad_s}).value, expected, 1e-5 * 100.0);
  }
}

TEST(NewtonLayouts, RefuseLayersOfDifferentWidths) {
  EXPECT_THAT(
      [] {
        (void)onnx_bytes(driven(any_example<Lstm>(), kDriveInputs), {.layout = OnnxLayout::newton});
      },
      testing::ThrowsMessage<UsageError>(testing::HasSubstr("units in each recurrent layer")));
}

TEST(NewtonLayouts, TakeLagsOfAnMlp) {
  const ModelFile file = driven(
      any_example<Mlp>(), {"lag(joint_speed_rad_s, 2)", "lag(joint_target_rad-joint_angle_rad,2)"});
  const onnx::ModelProto model = parsed(onnx_bytes(file, {.layout = OnnxLayout::newton}));
  EXPECT_EQ(nlohmann::json::parse(metadata_of(model, "metadata"))["input_idx"],
            std::vector<int>{2});
}

TEST(NewtonLayouts, RefuseOtherInputsByName) {
  EXPECT_THAT(
      [] { (void)onnx_bytes(guarded(any_example<Mlp>()), {.layout = OnnxLayout::newton}); },
      testing::ThrowsMessage<UsageError>(testing::HasSubstr("joint_target_rad - joint_angle_rad")));
  EXPECT_THAT(
      [] {
        (void)onnx_bytes(driven(any_example<Mlp>(), {"joint_speed_rad_s",
                                                     "lag(joint_target_rad - joint_angle_rad, 1)"}),
                         {.layout = OnnxLayout::newton});
      },
      testing::ThrowsMessage<UsageError>(testing::HasSubstr("the same lags")));
  EXPECT_THAT(
      [] { (void)onnx_bytes(guarded(any_example<GreyBox>()), {.layout = OnnxLayout::network}); },
      testing::ThrowsMessage<UsageError>(testing::HasSubstr("grey_box")));
}

}  // namespace
}  // namespace torsio::test
