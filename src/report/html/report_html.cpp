#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>
#include <string_view>
#include <variant>

#include "report/html/linked_report.hpp"
#include "report/html/page_data.hpp"
#include "report/html/page_files.hpp"
#include "report/markup_text.hpp"
#include "torsio/core/version.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/report/plot/figure_plot.hpp"

namespace torsio {
namespace {

std::string paragraph(const std::string& text) {
  return text.empty() ? std::string() : fmt::format("<p>{}</p>\n", markup_text(text));
}

/// The name of a file as a part of an address.
std::string address_text(std::string_view file) {
  std::string text;
  for (const char letter : file) {
    const bool is_plain = (letter >= '0' && letter <= '9') || (letter >= 'A' && letter <= 'Z') ||
                          (letter >= 'a' && letter <= 'z') || letter == '-' || letter == '_' ||
                          letter == '.';
    if (is_plain)
      text += letter;
    else
      text += fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(letter)));
  }
  return text;
}

/// File of a page, by the text of the cell that leads to it.
using Pages = std::map<std::string, std::string>;

std::string cells_html(const std::vector<std::string>& cells, const Pages& pages) {
  std::string html;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    std::string text = markup_text(cells[i]);
    if (const auto page = i == 0 ? pages.find(cells[i]) : pages.end(); page != pages.end())
      text = fmt::format(R"(<a href="{}">{}</a>)", address_text(page->second), text);
    html += fmt::format("<td>{}</td>", text);
  }
  return html;
}

/// Each row is a body of its own, so that its details move with it when the table is sorted.
/// @param label unique in the page, as a region must have a name of its own
std::string table_html(const ReportTable& table, const std::string& label, const Pages& pages) {
  std::string html =
      table.title.empty() ? "" : fmt::format("<h3>{}</h3>\n", markup_text(table.title));
  html += fmt::format(
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" "
      "aria-label=\"{}\"><table{}>\n<thead><tr>",
      markup_text(label), table.is_words ? " class=\"words\"" : "");
  for (const std::string& heading : table.headings)
    html += fmt::format("<th scope=\"col\">{}</th>", markup_text(heading));
  html += "</tr></thead>\n";
  for (const ReportTable::Row& row : table.rows) {
    html += "<tbody><tr>" + cells_html(row.cells, pages) + "</tr>";
    if (!row.details.empty())
      html += fmt::format(R"(<tr><td class="details" colspan="{}">{}</td></tr>)",
                          table.headings.size(), markup_text(row.details));
    html += "</tbody>\n";
  }
  return html + "</table></div>\n";
}

/// A picture that needs no JavaScript. As an image: the names within an SVG file of cairo are those of any other.
std::string static_picture(const ReportFigure& figure) {
  const std::string svg =
      figure_plot({&figure}, PlotFormat::svg, {.width_mm = 120.0, .height_mm = 90.0});
  return fmt::format(R"(<img alt="{}" src="data:image/svg+xml;base64,{}">)",
                     markup_text(title_of(figure)), base64(std::as_bytes(std::span(svg))));
}

bool has_line(const ReportFigure& figure) {
  const auto* xy = std::get_if<XyFigure>(&figure);
  return xy != nullptr && std::ranges::any_of(xy->series, [](const XySeries& series) {
           return series.is_shown && series.style == CurveStyle::line;
         });
}

class Page {
 public:
  Page(const ReportDocument& document, const Pages& pages) : document_(document), pages_(pages) {}

  std::string html() {
    std::string body;
    for (const ReportSection& section : document_.sections) body += section_html(section);
    const PageData data = page_data(figures_);
    return fmt::format(
               "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n"
               "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
               "<meta name=\"generator\" content=\"torsio {}\">\n<title>{}</title>\n"
               "<link rel=\"icon\" href=\"data:,\">\n<style>{}</style></head>\n<body>\n",
               kVersion, markup_text(document_.title), page_style()) +
           fmt::format("<header><h1>{}</h1></header>\n<main>\n", markup_text(document_.title)) +
           summary_html() + body + origin_html() + "</main>\n" +
           fmt::format("<footer><p>torsio {}</p></footer>\n", kVersion) +
           R"(<script type="application/json" id="report-figures">)" + data.figures_json +
           "</script>\n<script type=\"text/plain\" id=\"report-numbers\">" + data.numbers_base64 +
           "</script>\n<script>" + std::string(page_script()) + "</script>\n</body></html>\n";
  }

 private:
  std::string summary_html() const {
    std::string html;
    for (const std::string& sentence : document_.summary)
      html += fmt::format("{}{}", html.empty() ? "" : " ", markup_text(sentence));
    return html.empty() ? html : fmt::format("<p class=\"summary\">{}</p>\n", html);
  }

  std::string section_html(const ReportSection& section) {
    std::string html = fmt::format("<section>\n<h2>{}</h2>\n", markup_text(section.heading));
    html += paragraph(section.text);
    for (const ReportTable& table : section.tables)
      html += table_html(table, unique_label(table.title.empty() ? section.heading : table.title),
                         pages_);
    for (const ReportFigure& figure : section.figures) html += figure_html(figure);
    if (!section.preformatted.empty())
      html += fmt::format(
          "<details{}><summary>as text</summary><pre tabindex=\"0\">{}</pre></details>\n",
          section.tables.empty() && section.figures.empty() ? " open" : "",
          markup_text(section.preformatted));
    return html + "</section>\n";
  }

  std::string figure_html(const ReportFigure& figure) {
    const std::string& title = title_of(figure);
    if (std::holds_alternative<FieldFigure>(figure))
      return fmt::format("<figure><figcaption>{}</figcaption>{}</figure>\n", markup_text(title),
                         static_picture(figure));
    const std::string id = fmt::format("figure-{}", figures_.size() + 1);
    figures_.push_back(&figure);
    std::string still;
    if (!has_picture_ && has_line(figure)) still = static_picture(figure);
    has_picture_ = has_picture_ || !still.empty();
    return fmt::format("<figure><figcaption>{}</figcaption><div id=\"{}\"></div>{}</figure>\n",
                       markup_text(title), id,
                       still.empty() ? still : fmt::format("<noscript>{}</noscript>", still));
  }

  std::string unique_label(const std::string& name) {
    const std::size_t count = ++labels_[name];
    return count == 1 ? name : fmt::format("{} ({})", name, count);
  }

  std::string origin_html() {
    if (document_.origin.empty()) return {};
    ReportTable table{.title = {}, .headings = {"what", "value"}, .rows = {}, .is_words = true};
    for (const auto& [what, value] : document_.origin) table.rows.push_back({{what, value}});
    return fmt::format("<section>\n<h2>How this was made</h2>\n{}</section>\n",
                       table_html(table, unique_label("How this was made"), {}));
  }

  const ReportDocument& document_;
  const Pages& pages_;
  std::vector<const ReportFigure*> figures_;
  std::map<std::string, std::size_t> labels_;
  bool has_picture_ = false;
};

}  // namespace

std::string report_html(const ReportDocument& document) { return linked_report_html(document, {}); }

std::string linked_report_html(const ReportDocument& document,
                               const std::map<std::string, std::string>& pages) {
  return Page(document, pages).html();
}

}  // namespace torsio
