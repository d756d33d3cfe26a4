#include "report/plot/angles.hpp"

#include <array>
#include <cctype>
#include <optional>
#include <string>
#include <string_view>

#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Whether the `_rad` at this place is the unit of a channel, not of a stiffness or a damping.
bool is_unit_suffix(std::string_view name, std::size_t at) {
  for (const std::string_view unit : {"_Nm", "_Nms", "_A", "_As"})
    if (name.substr(0, at).ends_with(unit)) return false;
  std::string_view rest = name.substr(at + std::string_view("_rad").size());
  if (rest.starts_with("_s2")) rest.remove_prefix(3);
  if (rest.starts_with("_s")) rest.remove_prefix(2);
  return rest.empty() ||
         (std::isalnum(static_cast<unsigned char>(rest.front())) == 0 && rest.front() != '_');
}

std::string named_in_degrees(std::string name) {
  for (std::size_t at = name.find("_rad"); at != std::string::npos; at = name.find("_rad", at + 1))
    if (is_unit_suffix(name, at)) name.replace(at, 4, "_deg");
  return name;
}

/// The label of an axis in degrees; none if it is not one of angles.
std::optional<std::string> labelled_in_degrees(std::string label) {
  for (const std::string_view unit : {"[rad]", "[rad/s]", "[rad/s2]"}) {
    const std::size_t at = label.find(unit);
    if (at == std::string::npos) continue;
    label.replace(at + 1, 3, "deg");
    return named_in_degrees(label);
  }
  return std::nullopt;
}

void convert(XyFigure& figure) {
  const auto axis = [&](ReportAxis& of, std::vector<double> XySeries::*values) {
    const auto label = labelled_in_degrees(of.label);
    if (!label) return;
    of.label = *label;
    for (XySeries& series : figure.series)
      for (double& value : series.*values) value = deg_from_rad(value);
  };
  axis(figure.x, &XySeries::x);
  axis(figure.y, &XySeries::y);
}

void convert(TimeFigure& figure) {
  for (TimeFigure::Panel& panel : figure.panels) {
    const auto label = labelled_in_degrees(panel.label);
    if (!label) continue;
    panel.label = *label;
    for (TimeSeries& series : panel.series) {
      series.label = named_in_degrees(series.label);
      for (std::vector<float> TimeSeries::*values : {&TimeSeries::overview, &TimeSeries::detail})
        for (float& value : series.*values) value = static_cast<float>(deg_from_rad(value));
    }
  }
}

void convert(FieldFigure& /*figure*/) {}

}  // namespace

ReportFigure in_degrees(ReportFigure figure) {
  std::visit([](auto& of) { convert(of); }, figure);
  return figure;
}

}  // namespace torsio
