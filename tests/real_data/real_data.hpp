#pragma once

#include <gtest/gtest.h>

#include <string>

#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/evaluate/comparison.hpp"

namespace torsio {

/// The path of a manifest in this folder.
inline std::string manifest_path(const std::string& name) {
  return std::string(TORSIO_REAL_DATA) + "/" + name + ".yaml";
}

/// Whether the recordings that a manifest names are on this machine.
inline bool has_data(const std::string& name) {
  const Manifest manifest = read_manifest(manifest_path(name));
  try {
    static_cast<void>(data_folder(manifest));
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// What models make of the data of a manifest.
inline Results compared(const std::string& manifest, const std::string& models) {
  const Dataset dataset = load_dataset({manifest_path(manifest)}, {});
  return compare(dataset, model_choices(dataset, models, {}), 1, false).results;
}

}  // namespace torsio

/// Skips a test by name where the real recordings are not at hand.
#define TORSIO_NEEDS_DATA(name)  \
  if (!::torsio::has_data(name)) \
  GTEST_SKIP() << (name) << ": set TORSIO_DATA to the folder of the recordings"
