#pragma once

#include <string>
#include <vector>

#include "products/survey.hpp"
#include "products/write_products.hpp"

namespace seastitch {

// report.json. Times, memory and rates of the run are both flat (wall_s, ...) and under "run"; the
// keys that differ from run to run are listed under "not_reproducible".
std::string ReportJson(const Survey& survey,
                       const ProductSummary& summary,
                       const ProductOptions& options);

// Text of report.html: one page, with a map in it (MapViewer::Data(); empty: without); its pictures
// are the PNG files beside it. The same in every run.
std::string ReportHtml(const Survey& survey,
                       const ProductSummary& summary,
                       const ProductOptions& options,
                       const std::string& map_data);

}  // namespace seastitch
