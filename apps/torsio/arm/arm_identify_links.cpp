#include "arm/arm_identify_links.hpp"

#include <fmt/format.h>

#include <array>

#include "torsio/report/text_table.hpp"

namespace {

using LinksJson = nlohmann::ordered_json;

constexpr std::array kMoments{"xx", "yy", "zz", "xy", "xz", "yz"};

/// Value and standard error; in parentheses what the motion does not determine.
std::string link_cell(const torsio::IdentifiedQuantity& of, double scale, int decimals) {
  const std::string text = fmt::format("{} +- {}", torsio::fixed_text(scale * of.value, decimals),
                                       torsio::fixed_text(scale * of.standard_error, decimals));
  return of.is_determined ? text : "(" + text + ")";
}

LinksJson link_json(const torsio::IdentifiedQuantity& of) {
  LinksJson json{{"value", of.value},
                 {"standard_error", of.standard_error},
                 {"is_determined", of.is_determined}};
  if (!of.is_determined) json["reason"] = of.reason;
  return json;
}

}  // namespace

std::string links_text(const torsio::IdentifiedLinks& found, const std::vector<double>& before,
                       const std::vector<double>& after) {
  torsio::TextTable table;
  table.header({"link", "mass [kg]", "centre x [mm]", "y [mm]", "z [mm]", "inertia xx [kg m2]",
                "yy [kg m2]", "zz [kg m2]"});
  for (const torsio::IdentifiedLink& link : found.links)
    table.row({link.name + (link.is_impossible ? " (kept)" : ""), link_cell(link.mass_kg, 1.0, 3),
               link_cell(link.com_m[0], 1e3, 1), link_cell(link.com_m[1], 1e3, 1),
               link_cell(link.com_m[2], 1e3, 1), link_cell(link.inertia_kg_m2[0], 1.0, 4),
               link_cell(link.inertia_kg_m2[1], 1.0, 4), link_cell(link.inertia_kg_m2[2], 1.0, 4)});
  std::string text = table.text() +
                     "in parentheses: not determined, its standard error is above half of what was "
                     "assumed\n";
  if (before.empty()) return text;
  torsio::TextTable gain;
  gain.header({"joint", "torque RMSE with the links of the URDF file [Nm]", "corrected [Nm]"});
  for (std::size_t j = 0; j < before.size(); ++j)
    gain.row(
        {found.joints[j].name, fmt::format("{:.3f}", before[j]), fmt::format("{:.3f}", after[j])});
  return text + "\n" + gain.text() + "on the recordings of --test, means over a window\n";
}

nlohmann::ordered_json links_json(const torsio::IdentifiedLinks& found,
                                  const std::vector<double>& before,
                                  const std::vector<double>& after) {
  LinksJson document{{"windows", found.data.windows},
                     {"blocks", found.data.blocks},
                     {"links", LinksJson::array()},
                     {"test_rmse_before_Nm", before},
                     {"test_rmse_after_Nm", after}};
  for (const torsio::IdentifiedLink& link : found.links) {
    LinksJson row{{"link", link.name},
                  {"is_impossible", link.is_impossible},
                  {"mass_kg", link_json(link.mass_kg)},
                  {"center_of_mass_m", LinksJson::array()},
                  {"inertia_kg_m2", LinksJson::object()}};
    for (const torsio::IdentifiedQuantity& com : link.com_m)
      row["center_of_mass_m"].push_back(link_json(com));
    for (std::size_t i = 0; i < kMoments.size(); ++i)
      row["inertia_kg_m2"][kMoments[i]] = link_json(link.inertia_kg_m2[i]);
    document["links"].push_back(std::move(row));
  }
  return document;
}
