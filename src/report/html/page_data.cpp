#include "report/html/page_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "the page reads little-endian floats");

/// `<` would end the script element, or begin a comment in it.
std::string script_json(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

const char* text_of(CurveRole role) {
  switch (role) {
    case CurveRole::measured: return "measured";
    case CurveRole::model: return "model";
    case CurveRole::limit: return "limit";
    case CurveRole::lower: return "lower";
    case CurveRole::upper: return "upper";
  }
  return "model";
}

const char* text_of(CurveStyle style) {
  switch (style) {
    case CurveStyle::line: return "line";
    case CurveStyle::points: return "points";
    case CurveStyle::columns: return "columns";
  }
  return "line";
}

class FigureWriter {
 public:
  Json operator()(const XyFigure& figure) {
    Json json{{"kind", "xy"},           {"id", ""},
              {"title", figure.title},  {"x", axis(figure.x)},
              {"y", axis(figure.y)},    {"equal", figure.is_equal},
              {"series", Json::array()}};
    if (!figure.colour_label.empty()) json["colour_label"] = figure.colour_label;
    for (const XySeries& series : figure.series) {
      Json one{{"label", series.label},        {"style", text_of(series.style)},
               {"role", text_of(series.role)}, {"shown", series.is_shown},
               {"x", numbers(series.x)},       {"y", numbers(series.y)}};
      if (!series.colour.empty()) one["colour"] = numbers(series.colour);
      if (!series.names.empty()) one["names"] = series.names;
      json["series"].push_back(std::move(one));
    }
    return json;
  }

  Json operator()(const TimeFigure& figure) {
    Json json{{"kind", "time"},
              {"id", ""},
              {"title", figure.title},
              {"start_s", figure.start_s},
              {"rate_Hz", figure.rate_Hz},
              {"samples", figure.samples},
              {"bucket", figure.bucket},
              {"windows", Json::array()},
              {"marks", Json::array()},
              {"panels", Json::array()}};
    for (const DetailWindow& window : figure.windows)
      json["windows"].push_back(
          {{"begin", window.begin}, {"end", window.end}, {"label", window.label}});
    for (const TimeMark& mark : figure.marks)
      json["marks"].push_back({{"begin_s", mark.begin_s},
                               {"end_s", mark.end_s},
                               {"label", mark.label},
                               {"level", mark.is_failure ? "fail" : "warn"}});
    for (const TimeFigure::Panel& panel : figure.panels) {
      Json series = Json::array();
      for (const TimeSeries& one : panel.series)
        series.push_back({{"label", one.label},
                          {"role", text_of(one.role)},
                          {"shown", one.is_shown},
                          {"overview", numbers(one.overview)},
                          {"detail", numbers(one.detail)}});
      json["panels"].push_back({{"label", panel.label}, {"series", std::move(series)}});
      if (!panel.value_names.empty()) json["panels"].back()["names"] = panel.value_names;
    }
    return json;
  }

  Json operator()(const FieldFigure& figure) { return {{"title", figure.title}}; }

  [[nodiscard]] std::string numbers_base64() const {
    return base64(std::as_bytes(std::span(numbers_)));
  }

 private:
  static Json axis(const ReportAxis& axis) {
    return {{"label", axis.label}, {"log", axis.is_logarithmic}};
  }

  /// Appends the values. @returns where they are: first and count
  template <class Value>
  Json numbers(const std::vector<Value>& values) {
    const std::size_t first = numbers_.size();
    for (const Value value : values) {
      const auto number = static_cast<float>(value);
      numbers_.push_back(std::isfinite(number) ? number : std::numeric_limits<float>::quiet_NaN());
    }
    return {first, values.size()};
  }

  std::vector<float> numbers_;
};

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(bytes.size() - i, 3);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8U | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kLetters[word >> (18U - 6U * k) & 63U] : '=';
  }
  return text;
}

PageData page_data(const std::vector<const ReportFigure*>& figures) {
  FigureWriter writer;
  Json json = Json::array();
  for (const ReportFigure* figure : figures) {
    json.push_back(std::visit([&](const auto& one) { return writer(one); }, *figure));
    json.back()["id"] = fmt::format("figure-{}", json.size());
  }
  return {script_json(json), writer.numbers_base64()};
}

}  // namespace torsio
