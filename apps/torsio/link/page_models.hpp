#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/live/live_page.hpp"

/// Model files that estimate beside a joint, from its telemetry.
class PageModels {
 public:
  /// @param joint for messages @param channels of the telemetry, at `rate_Hz`
  /// @throws torsio::Error for a file that is not a model, or one for another rate; what the joint does not measure is a remark, and
  /// that model is left out.
  PageModels(const std::vector<std::string>& files, const std::string& joint,
             const std::vector<std::string>& channels, double rate_Hz);

  [[nodiscard]] std::vector<torsio::LivePage::Model> models() const;
  [[nodiscard]] std::vector<bool> are_on() const;
  void switch_model(std::size_t model, bool is_on);
  /// Steps the models that are on. @param number of the sample: one that is left out is a gap
  /// @param out an estimate and its standard deviation for each model, NaN for one that is off
  void step(std::uint64_t number, std::span<const double> telemetry, std::span<double> out);

 private:
  struct Running {
    std::string name;
    torsio::Estimator estimator;
    std::vector<std::size_t>
        channels;  ///< channels of the raw inputs; kDeflection: gear angle less joint angle
    std::vector<double> raw;
    bool is_on = true;
  };
  std::vector<Running> running_ = {};
  std::size_t gear_ = 0;
  std::size_t joint_ = 0;
  std::uint64_t next_ = 0;
};
