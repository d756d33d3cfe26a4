#pragma once

#include "bench_row.hpp"

namespace torsio::bench {

Row dgmm_5000_query();
Row dgmm_100k_batch();
Row dgmm_online_216k();
Row dgmm_learn_300();
Row dgmm_learn_300_worst();
Row dgmm_learn_5000();
Row dgmm_learn_5000_worst();
Row grey_box_learn();
Row em_k100_iteration();
Row csv_load();
Row batch_4096_grey_box();
Row batch_4096_lstm32();
Row mcap_read();
Row mat_read();
Row mat_read_v7();
Row report_decimate();
Row report_write();
Row grey_box_fit_files();
Row simulate_dfki_120();
Row simulate_single();
Row simulate_electrical();
Row simulate_single_bouc_wen();
Row simulate_single_lugre();
Row simulate_no_ripple();
Row simulate_no_gear_error();
Row simulate_no_play();
Row simulate_no_hysteresis();
Row simulate_no_stribeck();
Row simulate_no_friction();
Row simulate_no_effects();
Row simulate_batched();
Row simulate_batched_held();
Row simulate_batched_bouc_wen();
Row simulate_batched_lugre();
Row arm_simulate();
Row arm_simulate_gears();
Row arm_control_step();
Row arm_control_step_p999();
Row arm_control_step_dgmm();
Row arm_control_step_unmonitored();
Row lstm250_step();
Row lstm32_step();
Row gru64_step();
Row mlp_step();
Row lstm250_x12_step();
Row lstm250_nlms_update();
Row lstm250_rls_update();
Row lstm250_train_batch();
Row lstm250_train_2threads();
Row mlp_epoch();
Row gp_fit_5000();
Row gp_mean_5000();
Row gp_hyper_2000();
Row pgpr_200k();
Row pgpr_step();
Row slip_bank_step();
Row grey_box_step();
Row c_step();
Row frols_40k();
Row viscoelastic_step();
Row hw_fit_40k();
Row hw_step();
Row cascade_step();
Row current_loop_step();
Row impedance_step();
Row torque_loop_linear_step();
Row torque_loop_dgmm300_step();
Row torque_loop_grey_box_step();
Row mailbox_read();
Row recorder_push();
Row redundancy_step();
Row monitor_step();

/// Writes the data of these rows to `scratch_folder()`, as raw doubles row by row, so that the peers use
/// the same data. The peer of `csv_load` reads the file that this row writes there.
void write_query_inputs();
void write_em_inputs();
void write_simulate_inputs();
void write_arm_inputs();
void write_arm_gears_inputs();
void write_lstm250();
void write_lstm32();
void write_gru64();
void write_mlp();
void write_gp_5000();
void write_gp_2000();
void write_frols_40k();
void write_hw_40k();

}  // namespace torsio::bench
