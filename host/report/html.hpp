// What all reports share: their looks, and text that HTML cannot mistake.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>

#include "host/io/json.hpp"

namespace flexor::report {

inline constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; max-width: 60rem;
       padding: 1rem; }
h1 { font-size: 1.5rem; margin: .5rem 0; } h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; }
.cards { display: flex; flex-wrap: wrap; gap: 1rem; margin: 1rem 0; }
.card { flex: 1 1 12rem; border: 1px solid #ddd; border-radius: .5rem; padding: .75rem 1rem; }
.card b { display: block; font-size: 1.9rem; line-height: 1.2; color: #0072B2; }
.card.plain b { color: #9a6a00; }
.warnings { border-left: 4px solid #D55E00; background: #fff6f0; padding: .5rem 1rem; }
.good { border-left: 4px solid #009E73; background: #f0faf6; padding: .5rem 1rem; }
figure { margin: 1rem 0; } figure svg { width: 100%; height: auto; } figcaption { color: #555; font-size: .9rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .25rem .5rem; border-bottom: 1px solid #e5e5e5; }
th:first-child, td:first-child { text-align: left; } tr.chosen { background: #eef6fb; font-weight: 600; }
.scroll { overflow-x: auto; } code { background: #f3f3f3; padding: 0 .25rem; }
details { margin: 1rem 0; } summary { cursor: pointer; font-weight: 600; }
)";

inline std::string escape(const std::string& text) {
  std::string out;
  for (const char c : io::to_utf8(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

class Page {
 public:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
    out_.push_back('\n');
  }
  std::string text() const { return fmt::to_string(out_); }

 private:
  fmt::memory_buffer out_;
};

}  // namespace flexor::report
