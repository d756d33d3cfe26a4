#pragma once

// Start here for results as text, JSON, pages and pictures.
//
//   ranked_table    scores as a table
//   results_json    scores as JSON
//   check_json      findings as JSON
//   ReportDocument  a page; `comparison_report`, `check_report` and others make one, `report_html` writes it
//   figure_plot     its figures as SVG, PNG or PDF

#include "torsio/report/check.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/plot/figure_plot.hpp"
#include "torsio/report/results.hpp"
