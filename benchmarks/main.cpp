#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "bench_row.hpp"
#include "report/json_text.hpp"
#include "rows.hpp"

namespace torsio::bench {
namespace {

using Json = nlohmann::ordered_json;

/// The other library that does the work of a row.
struct Peer {
  std::string_view name;
  void (*write_inputs)() = nullptr;
};

struct Bench {
  std::string_view name;
  Row (*run)();
  std::optional<Peer> peer = {};
};

constexpr std::array kBenches{
    Bench{"dgmm_5000_query", dgmm_5000_query, Peer{"numpy", write_query_inputs}},
    Bench{"dgmm_100k_batch", dgmm_100k_batch, Peer{"numpy", write_query_inputs}},
    Bench{"dgmm_online_216k", dgmm_online_216k},
    Bench{"dgmm_learn_300", dgmm_learn_300},
    Bench{"dgmm_learn_300_worst", dgmm_learn_300_worst},
    Bench{"dgmm_learn_5000", dgmm_learn_5000},
    Bench{"dgmm_learn_5000_worst", dgmm_learn_5000_worst},
    Bench{"grey_box_learn", grey_box_learn},
    Bench{"em_k100_iteration", em_k100_iteration, Peer{"Armadillo", write_em_inputs}},
    Bench{"csv_load", csv_load, Peer{"numpy.loadtxt"}},
    Bench{"mcap_read", mcap_read, Peer{"@mcap/core"}},
    Bench{"mat_read", mat_read, Peer{"scipy.io"}},
    Bench{"mat_read_v7", mat_read_v7, Peer{"scipy.io"}},
    Bench{"report_decimate", report_decimate},
    Bench{"report_write", report_write},
    Bench{"grey_box_fit_files", grey_box_fit_files},
    Bench{"simulate_dfki_120", simulate_dfki_120},
    Bench{"simulate_single", simulate_single, Peer{"MuJoCo", write_simulate_inputs}},
    Bench{"simulate_electrical", simulate_electrical},
    Bench{"simulate_single_bouc_wen", simulate_single_bouc_wen},
    Bench{"simulate_single_lugre", simulate_single_lugre},
    Bench{"simulate_no_ripple", simulate_no_ripple},
    Bench{"simulate_no_gear_error", simulate_no_gear_error},
    Bench{"simulate_no_play", simulate_no_play},
    Bench{"simulate_no_hysteresis", simulate_no_hysteresis},
    Bench{"simulate_no_stribeck", simulate_no_stribeck},
    Bench{"simulate_no_friction", simulate_no_friction},
    Bench{"simulate_no_effects", simulate_no_effects},
    Bench{"simulate_batched", simulate_batched},
    Bench{"simulate_batched_held", simulate_batched_held},
    Bench{"simulate_batched_bouc_wen", simulate_batched_bouc_wen},
    Bench{"simulate_batched_lugre", simulate_batched_lugre},
    Bench{"arm_simulate", arm_simulate, Peer{"MuJoCo", write_arm_inputs}},
    Bench{"arm_simulate_gears", arm_simulate_gears, Peer{"MuJoCo", write_arm_gears_inputs}},
    Bench{"arm_control_step", arm_control_step},
    Bench{"arm_control_step_p999", arm_control_step_p999},
    Bench{"arm_control_step_dgmm", arm_control_step_dgmm},
    Bench{"arm_control_step_unmonitored", arm_control_step_unmonitored},
    Bench{"lstm250_step", lstm250_step, Peer{"libtorch", write_lstm250}},
    Bench{"lstm32_step", lstm32_step, Peer{"libtorch", write_lstm32}},
    Bench{"gru64_step", gru64_step, Peer{"libtorch", write_gru64}},
    Bench{"mlp_step", mlp_step, Peer{"libtorch", write_mlp}},
    Bench{"lstm250_x12_step", lstm250_x12_step, Peer{"libtorch", write_lstm250}},
    Bench{"lstm250_nlms_update", lstm250_nlms_update},
    Bench{"lstm250_rls_update", lstm250_rls_update},
    Bench{"lstm250_train_batch", lstm250_train_batch, Peer{"PyTorch"}},
    Bench{"lstm250_train_2threads", lstm250_train_2threads},
    Bench{"mlp_epoch", mlp_epoch, Peer{"scikit-learn"}},
    Bench{"gp_fit_5000", gp_fit_5000, Peer{"scikit-learn", write_gp_5000}},
    Bench{"gp_mean_5000", gp_mean_5000, Peer{"scikit-learn", write_gp_5000}},
    Bench{"gp_hyper_2000", gp_hyper_2000, Peer{"scikit-learn", write_gp_2000}},
    Bench{"pgpr_200k", pgpr_200k},
    Bench{"pgpr_step", pgpr_step},
    Bench{"slip_bank_step", slip_bank_step},
    Bench{"grey_box_step", grey_box_step},
    Bench{"c_step", c_step},
    Bench{"batch_4096_grey_box", batch_4096_grey_box},
    Bench{"batch_4096_lstm32", batch_4096_lstm32},
    Bench{"frols_40k", frols_40k, Peer{"numpy", write_frols_40k}},
    Bench{"viscoelastic_step", viscoelastic_step},
    Bench{"hw_fit_40k", hw_fit_40k, Peer{"Octave optim", write_hw_40k}},
    Bench{"hw_step", hw_step},
    Bench{"cascade_step", cascade_step},
    Bench{"current_loop_step", current_loop_step},
    Bench{"impedance_step", impedance_step},
    Bench{"torque_loop_linear_step", torque_loop_linear_step},
    Bench{"torque_loop_dgmm300_step", torque_loop_dgmm300_step},
    Bench{"torque_loop_grey_box_step", torque_loop_grey_box_step},
    Bench{"mailbox_read", mailbox_read},
    Bench{"recorder_push", recorder_push},
    Bench{"link_encode", link_encode},
    Bench{"link_encode_bytewise", link_encode_bytewise},
    Bench{"link_encode_escapes", link_encode_escapes},
    Bench{"link_decode", link_decode},
    Bench{"link_decode_bytewise", link_decode_bytewise},
    Bench{"link_decode_escapes", link_decode_escapes},
    Bench{"link_round_trip", link_round_trip},
    Bench{"joints_cycle", joints_cycle},
    Bench{"joints_cycle_p999", joints_cycle_p999},
    Bench{"redundancy_step", redundancy_step},
    Bench{"monitor_step", monitor_step},
};

struct Arguments {
  std::string json;   ///< file to write the rows to
  std::string only;   ///< one row
  std::string peers;  ///< command that measures a peer
};

Arguments parse(int count, char** values) {
  Arguments arguments;
  for (int k = 1; k < count; ++k) {
    const std::string_view flag = values[k];
    std::string* const target = flag == "--json"    ? &arguments.json
                                : flag == "--only"  ? &arguments.only
                                : flag == "--peers" ? &arguments.peers
                                                    : nullptr;
    if (target == nullptr || k + 1 == count)
      throw std::invalid_argument(
          "usage: torsio_bench [--json FILE] [--only ROW] [--peers COMMAND]\n"
          "COMMAND ROW FOLDER prints what a peer takes for ROW, in the unit of ROW, on the inputs "
          "in FOLDER.");
    *target = values[++k];
  }
  return arguments;
}

/// Ratio by which the first is better: less time, or more per second.
double ratio(const Row& row, double better, double worse) {
  return row.unit.ends_with("/s") ? better / worse : worse / better;
}

double peer_value(const Peer& peer, std::string_view row, const std::string& command) {
  if (peer.write_inputs != nullptr) peer.write_inputs();
  const std::string call = fmt::format("{} {} '{}'", command, row, scratch_folder().string());
  std::FILE* const output = popen(call.c_str(), "r");
  double value = 0.0;
  const bool is_number = output != nullptr && std::fscanf(output, "%lf", &value) == 1;
  if (output == nullptr || pclose(output) != 0 || !is_number)
    throw std::runtime_error("the peer could not be measured: " + call);
  return value;
}

Json measure(const Bench& bench, const std::string& peers) {
  const Row row = bench.run();
  Json result = {{"schema_version", kJsonSchemaVersion},
                 {"name", bench.name},
                 {"value", row.value},
                 {"unit", row.unit},
                 {"floor", nullptr},
                 {"x_floor", nullptr},
                 {"peer", nullptr},
                 {"peer_value", nullptr},
                 {"x_peer", nullptr}};
  if (row.floor) {
    result["floor"] = *row.floor;
    result["x_floor"] = ratio(row, *row.floor, row.value);
  }
  if (bench.peer && !peers.empty()) {
    const double value = peer_value(*bench.peer, bench.name, peers);
    result["peer"] = bench.peer->name;
    result["peer_value"] = value;
    result["x_peer"] = ratio(row, row.value, value);
  }
  return result;
}

void print(const Json& row) {
  const auto number = [&](const char* key) {
    return row[key].is_null() ? std::string("-") : fmt::format("{:.5g}", row[key].get<double>());
  };
  fmt::print("{:<26} {:>10} {:<8} {:>10} {:>8} {:>11} {:>7}  {}\n", row["name"].get<std::string>(),
             number("value"), row["unit"].get<std::string>(), number("floor"), number("x_floor"),
             number("peer_value"), number("x_peer"),
             row["peer"].is_null() ? "-" : row["peer"].get<std::string>());
  std::fflush(stdout);
}

int run(const Arguments& arguments) {
  std::ofstream file;
  if (!arguments.json.empty()) {
    file.open(arguments.json);
    if (!file) throw std::invalid_argument(arguments.json + ": cannot be written");
  }
  fmt::print("{:<26} {:>10} {:<8} {:>10} {:>8} {:>11} {:>7}  {}\n", "row", "value", "unit", "floor",
             "x_floor", "peer value", "x_peer", "peer");
  Json rows = Json::array();
  for (const Bench& bench : kBenches) {
    if (!arguments.only.empty() && arguments.only != bench.name) continue;
    rows.push_back(measure(bench, arguments.peers));
    print(rows.back());
  }
  if (rows.empty()) throw std::invalid_argument("no row is called " + arguments.only);
  if (!arguments.json.empty() && !(file << rows.dump(2) << std::endl))
    throw std::runtime_error(arguments.json + ": cannot be written");
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
