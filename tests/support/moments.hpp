#pragma once

#include <cmath>
#include <vector>

namespace torsio::test {

struct Moments {
  double mean = 0.0;
  double std_dev = 0.0;
};
inline Moments moments(const std::vector<double>& values) {
  Moments of;
  for (const double value : values) of.mean += value;
  of.mean /= static_cast<double>(values.size());
  for (const double value : values) of.std_dev += (value - of.mean) * (value - of.mean);
  of.std_dev = std::sqrt(of.std_dev / static_cast<double>(values.size()));
  return of;
}

}  // namespace torsio::test
