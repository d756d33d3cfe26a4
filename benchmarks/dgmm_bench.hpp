#pragma once

#include <filesystem>

#include "bench_row.hpp"

namespace torsio::bench {

Row dgmm_5000_query();
Row dgmm_100k_batch();
Row dgmm_online_216k();
Row em_k100_iteration();

/// Writes what these rows work on, as raw doubles row by row, for the peers to work on the same.
void write_dgmm_inputs(const std::filesystem::path& folder);

}  // namespace torsio::bench
