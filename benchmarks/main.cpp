#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "bench_row.hpp"
#include "dgmm_bench.hpp"

namespace torsio::bench {
namespace {

using Json = nlohmann::ordered_json;

/// A row is a function and the peer that benchmarks/peers measures for it, if any.
struct Bench {
  std::string_view name;
  Row (*run)();
  std::string_view peer;
};

constexpr std::array kBenches{
    Bench{"dgmm_5000_query", dgmm_5000_query, "numpy"},
    Bench{"dgmm_100k_batch", dgmm_100k_batch, "numpy"},
    Bench{"dgmm_online_216k", dgmm_online_216k, ""},
    Bench{"em_k100_iteration", em_k100_iteration, "Armadillo"},
};

struct Arguments {
  std::string json;    ///< file to write the rows to
  std::string only;    ///< one row
  std::string peers;   ///< file with {"row": value} as the peers wrote it
  std::string inputs;  ///< folder to write the peers' inputs to, instead of measuring
};

Arguments parse(int count, char** values) {
  Arguments arguments;
  for (int k = 1; k < count; ++k) {
    const std::string_view flag = values[k];
    std::string* const target = flag == "--json"     ? &arguments.json
                                : flag == "--only"   ? &arguments.only
                                : flag == "--peers"  ? &arguments.peers
                                : flag == "--inputs" ? &arguments.inputs
                                                     : nullptr;
    if (target == nullptr || k + 1 == count)
      throw std::invalid_argument(
          "usage: torsio_bench [--json FILE] [--only ROW] [--peers FILE] | --inputs FOLDER");
    *target = values[++k];
  }
  return arguments;
}

/// How many times better the first is: less time, or more of something in a second.
double ratio(const Row& row, double better, double worse) {
  return row.unit.ends_with("/s") ? better / worse : worse / better;
}

Json document(const Bench& bench, const Row& row, const Json& peers) {
  Json result = {{"name", bench.name},    {"value", row.value}, {"unit", row.unit},
                 {"floor", nullptr},      {"x_floor", nullptr}, {"peer", nullptr},
                 {"peer_value", nullptr}, {"x_peer", nullptr}};
  if (row.floor) {
    result["floor"] = *row.floor;
    result["x_floor"] = ratio(row, *row.floor, row.value);
  }
  if (const auto peer = peers.find(bench.name); peer != peers.end()) {
    const double peer_value = peer->get<double>();
    result["peer"] = bench.peer;
    result["peer_value"] = peer_value;
    result["x_peer"] = ratio(row, row.value, peer_value);
  }
  return result;
}

void print(const Json& row) {
  const auto times = [&](const char* key) {
    return row[key].is_null() ? std::string("-") : fmt::format("{:.2f}", row[key].get<double>());
  };
  fmt::print("{:<24} {:>12.5g} {:<8} {:>8} x floor  {:>8} x faster than {}\n",
             row["name"].get<std::string>(), row["value"].get<double>(),
             row["unit"].get<std::string>(), times("x_floor"), times("x_peer"),
             row["peer"].is_null() ? "-" : row["peer"].get<std::string>());
  std::fflush(stdout);
}

int run(const Arguments& arguments) {
  if (!arguments.inputs.empty()) {
    write_dgmm_inputs(arguments.inputs);
    return 0;
  }
  Json peers = Json::object();
  if (!arguments.peers.empty()) {
    std::ifstream file(arguments.peers);
    if (!file) throw std::invalid_argument(arguments.peers + ": cannot be read");
    peers = Json::parse(file);
  }
  Json rows = Json::array();
  for (const Bench& bench : kBenches) {
    if (!arguments.only.empty() && arguments.only != bench.name) continue;
    rows.push_back(document(bench, bench.run(), peers));
    print(rows.back());
  }
  if (rows.empty()) throw std::invalid_argument("no row is called " + arguments.only);
  if (!arguments.json.empty()) std::ofstream(arguments.json) << rows.dump(2) << '\n';
  return 0;
}

}  // namespace
}  // namespace torsio::bench

int main(int argc, char** argv) {
  try {
    return torsio::bench::run(torsio::bench::parse(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "torsio_bench: {}\n", error.what());
    return 2;
  }
}
