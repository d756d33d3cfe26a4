#include "files/training_checkpoint.hpp"

#include <fmt/format.h>

#include "files/leaf_tensors.hpp"
#include "files/safetensors.hpp"
#include "files/whole_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

constexpr const char* kRecipeKey = "torsio_checkpoint";
constexpr const char* kPrefix = "training";
constexpr std::size_t kTables = 4;  ///< each as large as the network

}  // namespace

void save_checkpoint(const std::filesystem::path& path, const TrainingCheckpoint& checkpoint) {
  Safetensors contents;
  contents.metadata[kRecipeKey] = checkpoint.recipe;
  put_leaves(contents, kPrefix, checkpoint);
  write_whole_file(path, safetensors_bytes(contents));
}

TrainingCheckpoint load_checkpoint(const std::filesystem::path& path) {
  const std::string place = path.string();
  const auto bytes = read_whole_file(path, kTables * kMaxModelFileBytes + kMaxHeaderBytes);
  Safetensors contents = parse_safetensors(bytes, place);
  const auto recipe = contents.metadata.find(kRecipeKey);
  if (recipe == contents.metadata.end())
    throw Error({.place = fmt::format("{}: /__metadata__/{}", place, kRecipeKey),
                 .expected = "the checkpoint of a training",
                 .found = "none",
                 .advice = "Give the file that torsio fit left when it was stopped."});
  TrainingCheckpoint checkpoint;
  checkpoint.recipe = recipe->second;
  take_leaves(contents, kPrefix, place, checkpoint, [](std::string_view) { return false; });
  if (!contents.tensors.empty())
    throw Error({.place = fmt::format("{}: /{}", place, contents.tensors.begin()->first),
                 .expected = "only tensors of a checkpoint",
                 .found = "one that it does not have"});
  return checkpoint;
}

}  // namespace torsio
