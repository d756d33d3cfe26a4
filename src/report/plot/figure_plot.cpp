#include "torsio/report/plot/figure_plot.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <exception>
#include <memory>
#include <numeric>

#include "core/lower.hpp"
#include "data/names.hpp"
#include "report/markup_text.hpp"
#include "report/plot/angles.hpp"
#include "report/plot/figure_painter.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
constexpr double kDotsPerInch = 300.0;
constexpr double kLeastPanel_mm = 22.0;
constexpr double kHead_mm = 16.0;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Cairo = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

/// Called by cairo, through whose frames no exception may pass.
cairo_status_t append(void* text, const unsigned char* bytes, unsigned int count) noexcept {
  try {
    static_cast<std::string*>(text)->append(bytes, bytes + count);
  } catch (const std::exception&) {
    return CAIRO_STATUS_WRITE_ERROR;
  }
  return CAIRO_STATUS_SUCCESS;
}

double height_mm(const ReportFigure& figure, const PlotSize& size) {
  const auto* time = std::get_if<TimeFigure>(&figure);
  if (time == nullptr) return size.height_mm;
  const auto panels = static_cast<double>(shown_panels(*time).size());
  return std::max(size.height_mm, panels > 1.0 ? kHead_mm + panels * kLeastPanel_mm : 0.0);
}

Surface surface_of(PlotFormat format, double width, double height, double scale,
                   std::string& bytes) {
  if (format == PlotFormat::png)
    return {
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(width * scale)),
                                   static_cast<int>(std::lround(height * scale))),
        cairo_surface_destroy};
  if (format == PlotFormat::svg)
    return {cairo_svg_surface_create_for_stream(append, &bytes, width, height),
            cairo_surface_destroy};
  Surface surface(cairo_pdf_surface_create_for_stream(append, &bytes, width, height),
                  cairo_surface_destroy);
  // Else the time of the call would be in the file.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                 "2000-01-01T00:00:00Z");
  return surface;
}

void require_success(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error(
        {.place = "--plot", .problem = fmt::format("cairo: {}", cairo_status_to_string(status))});
}

/// In points.
std::vector<double> row_heights(const std::vector<const ReportFigure*>& figures,
                                const PlotSize& size) {
  std::vector<double> heights((figures.size() + size.columns - 1) / size.columns);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    double& height = heights[i / size.columns];
    height = std::max(height, height_mm(*figures[i], size) * kPointsPerMm);
  }
  return heights;
}

std::string drawn(const std::vector<const ReportFigure*>& figures, PlotFormat format,
                  const PlotSize& size, double detail) {
  const std::vector<double> heights = row_heights(figures, size);
  const double height = std::accumulate(heights.begin(), heights.end(), 0.0);
  const double column = size.width_mm * kPointsPerMm;
  const double width = column * static_cast<double>(std::min(size.columns, figures.size()));
  // PNG becomes smaller by its resolution, the others by the number of points.
  const double scale = kDotsPerInch * detail / 72.0;
  std::string bytes;
  const Surface surface = surface_of(format, width, height, scale, bytes);
  std::vector<std::string> texts;
  {
    const Cairo cairo(cairo_create(surface.get()), cairo_destroy);
    if (format == PlotFormat::png) cairo_scale(cairo.get(), scale, scale);
    cairo_set_source_rgb(cairo.get(), 1.0, 1.0, 1.0);
    cairo_paint(cairo.get());
    cairo_select_font_face(cairo.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo.get(), 7.0);
    FigurePainter painter(cairo.get(), format == PlotFormat::png ? 1.0 : detail);
    PlotArea area{.left = 2.0, .top = 0.0, .width = column - 4.0, .height = 0.0};
    for (std::size_t i = 0; i < figures.size(); ++i) {
      if (i > 0 && i % size.columns == 0) area.top += area.height;
      area.left = 2.0 + column * static_cast<double>(i % size.columns);
      area.height = heights[i / size.columns];
      std::visit([&](const auto& figure) { painter.draw(figure, area); }, *figures[i]);
    }
    require_success(cairo_status(cairo.get()));
    texts = painter.texts();
  }
  if (format == PlotFormat::png) {
    require_success(cairo_surface_write_to_png_stream(surface.get(), append, &bytes));
  } else {
    cairo_surface_finish(surface.get());
    require_success(cairo_surface_status(surface.get()));
  }
  if (format == PlotFormat::svg) {
    // Cairo counts the surfaces of a process in this name, which nothing refers to.
    const std::size_t name = bytes.find(" id=\"surface");
    if (name != std::string::npos) bytes.erase(name, bytes.find('>', name) - name);
    const std::size_t at = bytes.find('>', bytes.find("<svg")) + 1;
    bytes.insert(at, fmt::format("\n<title>{}</title>\n<desc>{}</desc>",
                                 markup_text(escaped(title_of(*figures.front()))),
                                 markup_text(fmt::format("{}", fmt::join(texts, "; ")))));
  }
  return bytes;
}

}  // namespace

const std::string& title_of(const ReportFigure& figure) {
  return std::visit([](const auto& one) -> const std::string& { return one.title; }, figure);
}

PlotFormat plot_format(std::string_view path) {
  const std::string name = lower(path);
  if (name.ends_with(".svg")) return PlotFormat::svg;
  if (name.ends_with(".png")) return PlotFormat::png;
  if (name.ends_with(".pdf")) return PlotFormat::pdf;
  throw UsageError({.place = "--plot",
                    .expected = "a file that ends in .svg, .png or .pdf",
                    .found = std::string(path)});
}

PlotSize plot_size(std::string_view text) {
  PlotSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width_mm);
  if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
    const auto height = std::from_chars(width.ptr + 1, end, size.height_mm);
    const auto is_good = [](double mm) { return mm >= 40.0 && mm <= 400.0; };
    if (height.ec == std::errc() && std::string_view(height.ptr, end) == "mm" &&
        is_good(size.width_mm) && is_good(size.height_mm))
      return size;
  }
  throw UsageError({.place = "--plot-size",
                    .expected = "width x height in millimetres, from 40 to 400, such as 85x64mm",
                    .found = std::string(text)});
}

std::vector<const ReportFigure*> figures_of(const ReportDocument& document,
                                            const std::vector<std::string>& words,
                                            std::string_view preferred) {
  std::vector<const ReportFigure*> all;
  for (const ReportSection& section : document.sections)
    for (const ReportFigure& figure : section.figures) all.push_back(&figure);
  if (all.empty())
    throw UsageError({.place = "--plot", .problem = "this result has no figure to draw"});
  const auto contains = [](const ReportFigure* figure, std::string_view word) {
    return lower(title_of(*figure)).find(lower(word)) != std::string::npos;
  };
  if (words.empty()) {
    const auto found = std::ranges::find_if(
        all, [&](const ReportFigure* figure) { return contains(figure, preferred); });
    return {found == all.end() ? all.front() : *found};
  }
  std::vector<const ReportFigure*> chosen;
  for (const std::string& word : words) {
    bool is_found = false;
    for (const ReportFigure* figure : all) {
      if (!contains(figure, word)) continue;
      is_found = true;
      if (std::ranges::find(chosen, figure) == chosen.end()) chosen.push_back(figure);
    }
    if (is_found) continue;
    std::vector<std::string> titles;
    titles.reserve(all.size());
    for (const ReportFigure* figure : all) titles.push_back("'" + title_of(*figure) + "'");
    throw UsageError({.place = "--plot-figure",
                      .expected = fmt::format("a word of one of {}", fmt::join(titles, ", ")),
                      .found = word});
  }
  return chosen;
}

std::string figure_plot(const std::vector<const ReportFigure*>& figures, PlotFormat format,
                        const PlotSize& size) {
  if (figures.empty() || size.columns == 0)
    throw UsageError({.place = "figure_plot",
                      .expected = "at least one figure and one column",
                      .found = fmt::format("{} and {}", figures.size(), size.columns)});
  std::vector<ReportFigure> in_deg;
  in_deg.reserve(figures.size());
  for (const ReportFigure* figure : figures) in_deg.push_back(in_degrees(*figure));
  std::vector<const ReportFigure*> shown;
  shown.reserve(in_deg.size());
  for (const ReportFigure& figure : in_deg) shown.push_back(&figure);
  std::string bytes;
  double detail = 1.0;
  for (int attempt = 0; attempt < 8; ++attempt) {
    bytes = drawn(shown, format, size, detail);
    if (bytes.size() <= kMaxPlotBytes) return bytes;
    detail *= 0.7;
  }
  throw UsageError({.place = "--plot",
                    .expected = fmt::format("a picture of at most {} bytes", kMaxPlotBytes),
                    .found = fmt::format("{} bytes", bytes.size()),
                    .advice = "Choose fewer figures by --plot-figure or a smaller --plot-size."});
}

}  // namespace torsio
