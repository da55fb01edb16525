// The page's templates inside the program.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace flexor::report {

const std::map<std::string_view, const char*>& templates();

// "page.html", "chart.mjs", "words.md"; of uPlot "uPlot.iife.min.js" and "uPlot.min.css", empty where web/node_modules was
// missing. Throws std::out_of_range for any other name.
inline std::string page_template(std::string_view name) { return templates().at(name); }

// The one script of a page with charts, and its name in a Content-Security-Policy: 'sha256-...'.
std::string report_script();
std::string report_script_source();

}  // namespace flexor::report
