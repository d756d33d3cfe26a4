#include "files/training_checkpoint.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "files/safetensors.hpp"
#include "files/whole_file.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TrainingCheckpoint example_checkpoint() {
  return {.recipe = "lstm of two, seed 1",
          .epoch = 3,
          .batch = 17,
          .updates = 77,
          .epoch_loss = 0.1,
          .best_epoch = 2,
          .best_loss = 1.0 / 3.0,
          .weights = {0.1F, -2.0F},
          .mean = {1e-30F, 0.0F},
          .square = {3.0F, 1e-38F},
          .best = {0.3F, 4.0F},
          .finished = {7.0F, -8.0F},
          .finished_loss = {0.25}};
}

class CheckpointFile : public testing::Test {
 protected:
  void write(const Safetensors& contents) { write_whole_file(path_, safetensors_bytes(contents)); }
  [[nodiscard]] Safetensors contents() const {
    return parse_safetensors(read_whole_file(path_, 1 << 20), "checkpoint");
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("joint.checkpoint");
};

TEST_F(CheckpointFile, GivesBackEveryBit) {
  save_checkpoint(path_, example_checkpoint());
  EXPECT_EQ(load_checkpoint(path_), example_checkpoint());
}

TEST_F(CheckpointFile, OfAnotherKindIsRefused) {
  write({.tensors = {}, .metadata = {{"torsio", "a card"}}});
  EXPECT_THAT(test::error_message([&] { (void)load_checkpoint(path_); }),
              HasSubstr("the checkpoint of a training"));
  save_checkpoint(path_, example_checkpoint());
  EXPECT_THAT(test::error_message([&] { (void)load_model(path_); }),
              HasSubstr("the card of a torsio model"));
}

TEST_F(CheckpointFile, WithTensorsMissingUnknownOrNotFiniteIsRefused) {
  save_checkpoint(path_, example_checkpoint());
  Safetensors missing = contents();
  missing.tensors.erase("training.mean");
  write(missing);
  EXPECT_THAT(test::error_message([&] { (void)load_checkpoint(path_); }),
              HasSubstr("/training.mean"));

  save_checkpoint(path_, example_checkpoint());
  Safetensors unknown = contents();
  unknown.tensors["training.more"] = unknown.tensors["training.mean"];
  write(unknown);
  EXPECT_THAT(test::error_message([&] { (void)load_checkpoint(path_); }),
              HasSubstr("/training.more"));

  TrainingCheckpoint infinite = example_checkpoint();
  infinite.weights[1] = std::numeric_limits<float>::infinity();
  save_checkpoint(path_, infinite);
  EXPECT_THAT(test::error_message([&] { (void)load_checkpoint(path_); }),
              HasSubstr("finite numbers"));
}

}  // namespace
}  // namespace torsio
