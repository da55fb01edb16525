#include "host/report/page.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <sstream>

#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/report/templates.hpp"

namespace flexor::report {
namespace {

// docs/words.md, a table of two columns.
TableBlock words() {
  TableBlock out{"What the words of this page mean", {}, {}, {}, true};
  std::istringstream lines(page_template("words.md"));
  for (std::string line; std::getline(lines, line);) {
    std::erase_if(line, [](char c) { return c == '*' || c == '`'; });
    const auto bar = line.find(" | ", 2);
    if (bar == std::string::npos) continue;
    out.rows.push_back({line.substr(2, bar - 2), line.substr(bar + 3, line.size() - bar - 5)});
  }
  return out;
}

// Texts of users in a format of ours.
template <class... Texts>
std::string filled(const char* format, const Texts&... texts) {
  return fmt::format(fmt::runtime(format), escape_html(texts)...);
}

std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; }));
}

// What stands in a column of a terminal's table, from top to bottom: its title word by word, then its cells.
struct TextColumn {
  TextColumn(const TableBlock& t, std::size_t c) {
    std::istringstream title(c < t.columns.size() ? t.columns[c] : "");
    for (std::string word; title >> word;) words.push_back(io::one_line(word));
    for (const auto& row : t.rows) cells.push_back(io::one_line(c < row.size() ? row[c] : ""));
    for (const auto& of : {words, cells})
      for (const std::string& text : of) width = std::max(width, width_of(text));
  }
  std::vector<std::string> words;
  std::vector<std::string> cells;
  std::size_t width = 0;
};

// Of the names of rows beside their figures; where one is long, each has a line of its own.
std::size_t room_of(const TextColumn& names) {
  constexpr std::size_t kLongestName = 24;
  return names.width > kLongestName ? 2 : names.width;
}

// Some columns beside the first, which names the rows.
std::string text_of(const TextColumn& names, std::span<const TextColumn> columns) {
  const std::size_t width = room_of(names);
  std::size_t head = names.words.empty() ? 0 : 1;
  for (const TextColumn& c : columns) head = std::max(head, c.words.size());
  std::string out;
  const auto add = [&](const std::string& name, const auto& cell) {
    std::string line = fmt::format("{:<{}}", name, width);
    if (width_of(name) > width) line += fmt::format("\n{:{}}", "", width);
    for (const TextColumn& c : columns) line += fmt::format("  {:>{}}", cell(c), c.width);
    out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  };
  for (std::size_t k = head; k > 0; --k) {
    const auto word = [k](const TextColumn& c) {
      return c.words.size() < k ? "" : c.words[c.words.size() - k];
    };
    add(k == 1 ? fmt::format("{}", fmt::join(names.words, " ")) : "", word);
  }
  for (std::size_t r = 0; r < names.cells.size(); ++r)
    add(names.cells[r], [r](const TextColumn& c) { return c.cells[r]; });
  return out;
}

// As many columns beside one another as a terminal has room for.
std::string text_of(const TableBlock& t) {
  constexpr std::size_t kTerminal = 80;
  std::string out;
  if (t.is_text) {
    for (const auto& row : t.rows)
      out += fmt::format("{:<40}  {}\n", io::one_line(row.front()), io::one_line(row.back()));
    return out;
  }
  if (!t.caption.empty()) out = io::one_line(t.caption) + "\n";
  std::vector<TextColumn> columns;
  for (std::size_t c = 0; !t.rows.empty() && c < t.rows.front().size(); ++c) columns.emplace_back(t, c);
  for (std::size_t begin = 1; begin < columns.size();) {
    std::size_t end = begin;
    std::size_t width = room_of(columns.front());
    while (end < columns.size() && (end == begin || width + 2 + columns[end].width <= kTerminal))
      width += 2 + columns[end++].width;
    out += (begin > 1 ? "\n" : "") + text_of(columns.front(), std::span(columns).subspan(begin, end - begin));
    begin = end;
  }
  return out;
}

std::string each(const char* format, const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += filled(format, text);
  return out;
}

}  // namespace

std::string report_script() { return page_template("uPlot.iife.min.js") + page_template("chart.mjs"); }

std::string report_script_source() {
  std::string digest;
  const std::string hex = page_template("script.sha256");
  for (std::size_t i = 0; i < hex.size(); i += 2)
    digest += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return "'sha256-" + io::base64(digest) + "'";
}

Column::Column(std::string name, const std::string& path, const char* format)
    : title(std::move(name)), cell([at = Json::json_pointer(path), format](const Json& row) {
        const Json value = row.is_object() && row.contains(at) ? row.at(at) : Json(nullptr);
        if (value.is_string()) return value.get<std::string>();
        if (value.is_number_integer() && std::string_view(format).starts_with("{}"))
          return fmt::format(fmt::runtime(format), value.get<std::int64_t>());
        return value.is_number() ? fmt::format(fmt::runtime(format), value.get<double>()) : std::string("-");
      }) {}

TableBlock table_of(const std::string& caption, const Json& rows, const std::vector<Column>& columns,
                    const std::string& title) {
  TableBlock out{caption, {}, {}};
  if (rows.is_object()) out.columns.push_back(title);
  for (const auto& [name, row] : rows.items()) {
    if (row.is_object() && row.value("chosen", Json()) == true) out.marked.push_back(out.rows.size());
    out.rows.emplace_back();
    if (rows.is_object()) out.rows.back().push_back(name);
  }
  for (const Column& column : columns) {
    std::vector<std::string> cells;
    for (const Json& row : rows) cells.push_back(column.cell(row));
    if (std::ranges::count(cells, "-") == std::ssize(cells) && !out.columns.empty()) continue;
    out.columns.push_back(column.title);
    for (std::size_t r = 0; r < cells.size(); ++r) out.rows[r].push_back(cells[r]);
  }
  return out;
}

TableBlock scores_table(const std::string& caption, const std::vector<std::pair<std::string, Json>>& scores) {
  const std::vector<Column> figures = {
      {"RMSE", "/rmse_deg", "{:.3f}°"},
      {"95th percentile of the error", "/p95_abs_deg", "{:.3f}°"},
      {"largest error", "/max_abs_deg", "{:.3f}°"},
      {"fit (NRMSE)", "/fit_percent", "{:.3f} %"},
      {"R²", "/r2", "{:.3f}"},
      {"integral of absolute error", "/iae_deg_s", "{:.3f}°s"},
      {"best constant lag (positive: late)", "/best_lag_s", "{:.3f} s"},
      {"RMSE with that lag removed", "/lag_removed_rmse_deg", "{:.3f}°"},
      {"integral with that lag removed", "/lag_removed_iae_deg_s", "{:.3f}°s"},
      {"samples", "/samples"}};
  TableBlock out{caption, {"score"}, {}};
  for (const auto& one : scores) out.columns.push_back(one.first);
  for (const Column& figure : figures) {
    out.rows.push_back({figure.title});
    for (const auto& one : scores) out.rows.back().push_back(figure.cell(one.second));
  }
  return out;
}

void Page::add(const std::string& html) {
  if (std::exchange(has_figures_, false)) body_ += "</div>\n";
  body_ += html;
}

void Page::heading(const std::string& text) {
  add(filled("<h2>{}</h2>\n", text));
  text_ += fmt::format("{}{}\n", text_.empty() ? "" : "\n", io::one_line(text));
}
void Page::paragraph(const std::string& text) {
  add(filled("<p>{}</p>\n", text));
  text_ += io::one_line(text) + "\n";
}
void Page::good(const std::string& text) { add(filled("<p class=\"good\">{}</p>\n", text)); }

void Page::steps(const std::vector<std::string>& lines) {
  add("<ol>\n" + each("<li>{}</li>\n", lines) + "</ol>\n");
  for (std::size_t i = 0; i < lines.size(); ++i)
    text_ += fmt::format("  {}. {}\n", i + 1, io::one_line(lines[i]));
}

void Page::warnings(const std::vector<std::string>& lines) {
  add("<section class=\"warnings\" aria-label=\"Worth knowing\"><b>Worth knowing</b>\n<ul>\n" +
      each("<li>{}</li>\n", lines) + "</ul>\n</section>\n");
}

void Page::links(const std::string& name, const std::vector<Link>& links) {
  add(filled("<nav aria-label=\"{}\">\n<ul>\n", name));
  for (const Link& l : links) add(filled("<li><a href=\"{}\">{}</a></li>\n", l.file, l.label));
  add("</ul>\n</nav>\n");
}

void Page::cards(const std::vector<Card>& cards) {
  add("<div class=\"cards\">\n");
  for (const Card& c : cards) {
    text_ += fmt::format("{:>8}  {}\n", io::one_line(c.value), io::one_line(c.label));
    add(filled("<div class=\"card{}\"><b>{}</b>{}</div>\n", c.plain ? " plain" : "", c.value, c.label));
  }
  add("</div>\n");
}

void Page::table(const TableBlock& t) {
  text_ += text_of(t);
  add(filled("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">\n", t.caption));
  add(t.is_text ? "<table class=\"words\">\n" : "<table>\n");
  add(filled("<caption>{}</caption>\n", t.caption));
  if (!t.columns.empty())
    add("<thead><tr>" + each("<th scope=\"col\">{}</th>", t.columns) + "</tr></thead>\n");
  add("<tbody>\n");
  for (std::size_t r = 0; r < t.rows.size(); ++r) {
    const std::vector<std::string>& row = t.rows[r];
    add(std::ranges::find(t.marked, r) != t.marked.end() ? "<tr class=\"marked\">" : "<tr>");
    add(filled("<th scope=\"row\">{}</th>", row.front()) + each("<td>{}</td>", {row.begin() + 1, row.end()}) +
        "</tr>\n");
  }
  add("</tbody>\n</table>\n</div>\n");
}

void Page::add_figure(const Figure& f, const std::string& html) {
  if (!std::exchange(has_figures_, true)) body_ += "<div class=\"figures\">\n";
  body_ += f.wide ? "<figure class=\"wide\">\n" : "<figure>\n";
  body_ += filled("<h2>{}</h2>\n", f.title) + html;
  body_ += filled("<figcaption>{}</figcaption>\n</figure>\n", f.caption);
}

void Page::chart(Chart chart) {
  if (charts_.empty() && page_template("uPlot.iife.min.js").empty())
    warnings({"This page has no curves: this flexor was built without web/node_modules (script/bootstrap)."});
  const Figure& f = chart.figure;
  add_figure(f, filled("<div class=\"chart\" id=\"{}\" role=\"group\" aria-label=\"{}\">", f.name, f.title) +
                    "<script type=\"application/json\">" + to_json(chart) + "</script></div>\n");
  charts_.push_back(std::move(chart));
}

void Page::drawing(const Figure& f, const std::string& svg) {
  constexpr const char* kScroll =
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}, drawing\">";
  add_figure(f, f.wide ? filled(kScroll, f.title) + svg + "</div>" : svg);
  drawings_.emplace_back(f.name, svg);
}

void Page::picture(const Figure& f, std::string_view jpeg) {
  add_figure(f, filled("<img alt=\"{}\" src=\"data:image/jpeg;base64,{}\">\n", f.title, io::base64(jpeg)));
}

void Page::begin_details(const std::string& summary) {
  add(filled("<details><summary>{}</summary>\n", summary));
}

// What stands between {{ and }} in the template, each once: nothing that comes from a user is looked through.
std::string Page::html() const {
  const auto value = [this](std::string_view name) {
    if (name == "title") return escape_html(title_);
    if (name == "body") return body_ + (has_figures_ ? "</div>\n" : "");
    if (charts_.empty()) return std::string();
    if (name == "style") return page_template("uPlot.min.css");
    return "<script type=\"module\">" + report_script() + "</script>\n";
  };
  const std::string page = page_template("page.html");
  std::string out;
  std::size_t done = 0;
  for (std::size_t at = 0; (at = page.find("{{", done)) != page.npos;) {
    out += page.substr(done, at - done);
    done = page.find("}}", at) + 2;
    out += value(std::string_view(page).substr(at + 2, done - at - 4));
  }
  return out + page.substr(done);
}

void Page::write(const Saved& saved, const std::string& file) {
  begin_details("Words");
  table(words());
  end_details();
  paragraph("flexor " + saved.text("version") + ".");
  if (saved.draws_files()) {
    draw_files(charts_, saved.folder());
    for (const auto& [name, svg] : drawings_) io::write_file(saved.folder() / (name + ".svg"), svg);
  }
  io::write_file(saved.folder() / file, html());
}

}  // namespace flexor::report
