#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// What Gaussian processes are fitted to.
struct KernelData {
  NetworkScaling scaling;
  Table table;  ///< standardised
};

/// Inputs and target to mean 0 and standard deviation 1.
[[nodiscard]] NetworkScaling scaling_of(const Table& table);
/// Leaves everything in its own unit.
[[nodiscard]] NetworkScaling no_scaling(std::size_t inputs);
[[nodiscard]] Table standardised(const NetworkScaling& scaling, Table table);

/// At most that many rows, drawn without replacement and kept in their order; 0: all.
[[nodiscard]] Table thinned(const Table& table, std::size_t most, Random& random);

/// Median distance between two of the points, over pairs drawn by chance; 1 if that is 0.
[[nodiscard]] double median_distance(const Matrix& points, Random& random);

/// Numbers to start from: length scales of distances at that distance, periods at twice that, 0.3 for
/// what multiplies a linear kernel, 1 for the rest. Source: specification 3.3 (`recommended`).
void set_start(KernelExpression& kernel, double distance);

/// k-means from k-means++ (Arthur and Vassilvitskii 2007), at most 30 rounds. Fewer centres come back
/// where fewer points differ.
[[nodiscard]] Matrix cluster_centres(const Matrix& points, std::size_t clusters, Random& random,
                                     const Progress& progress = {});

/// The centres of the clusters of the samples, of 20 000 of them at most: more do not move the centres.
[[nodiscard]] Matrix training_centres(const Table& table, std::size_t clusters, Random& random,
                                      const Progress& progress);

/// "input support_m is constant in the training data", for each that is.
[[nodiscard]] std::vector<std::string> constant_inputs(const TrainingData& data,
                                                       const Matrix& features);

}  // namespace torsio
