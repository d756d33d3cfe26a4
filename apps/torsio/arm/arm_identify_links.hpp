#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "torsio/identify/identify_links.hpp"

/// The table of `torsio arm identify --links`.
/// @param before and after: torque RMSE on the recordings of `--test`, one per joint; empty: none
[[nodiscard]] std::string links_text(const torsio::IdentifiedLinks& found,
                                     const std::vector<double>& before,
                                     const std::vector<double>& after);
[[nodiscard]] nlohmann::ordered_json links_json(const torsio::IdentifiedLinks& found,
                                                const std::vector<double>& before,
                                                const std::vector<double>& after);
