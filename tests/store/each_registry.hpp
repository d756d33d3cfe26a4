#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "support/example_model_file.hpp"
#include "support/examples/linear.hpp"
#include "support/postgresql_server.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/store/registry.hpp"

namespace torsio::test {

/// The bytes of a model file of a device; another `seed`, other bytes.
inline std::string model_file_of(const std::string& serial, std::uint64_t seed = 1) {
  ModelFile file = example_model_file(AnyModel(example<Linear>()));
  file.card.device_serial = serial;
  file.card.seed = seed;
  const std::vector<std::byte> bytes = model_bytes(file);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline NewModel new_model_of(const std::string& serial, std::uint64_t seed = 1) {
  return {.device = serial,
          .bytes = model_file_of(serial, seed),
          .file = "joint.safetensors",
          .by = "robot@bench"};
}

/// The server that all tests of this program share, started by the first that needs it.
inline PostgresqlServer& registry_server() {
  static PostgresqlServer shared;
  return shared;
}

/// A store of each kind.
class EachRegistry : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "postgresql" && PostgresqlServer::programs().empty())
      GTEST_SKIP() << "no PostgreSQL server is installed";
    if (GetParam() == "postgresql")
      address_ = store_address(registry_server().new_database());
    else if (GetParam() == "sqlite")
      address_ = store_address(folder_.path("store.sqlite"));
  }

  TemporaryFolder folder_;
  StoreAddress address_;
};

}  // namespace torsio::test
