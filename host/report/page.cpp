#include "host/report/page.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

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

std::string each(const char* format, const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += filled(format, text);
  return out;
}

}  // namespace

void Page::add(const std::string& html) {
  if (std::exchange(has_figures_, false)) body_ += "</div>\n";
  body_ += html;
}

void Page::heading(const std::string& text) { add(filled("<h2>{}</h2>\n", text)); }
void Page::paragraph(const std::string& text) { add(filled("<p>{}</p>\n", text)); }
void Page::good(const std::string& text) { add(filled("<p class=\"good\">{}</p>\n", text)); }

void Page::steps(const std::vector<std::string>& lines) {
  add("<ol>\n" + each("<li>{}</li>\n", lines) + "</ol>\n");
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
  for (const Card& c : cards)
    add(filled("<div class=\"card{}\"><b>{}</b>{}</div>\n", c.plain ? " plain" : "", c.value, c.label));
  add("</div>\n");
}

void Page::table(const TableBlock& t) {
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

void Page::end_details() { add("</details>\n"); }

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
  saved.go_on();
  if (saved.draws_files()) {
    draw_files(charts_, saved.folder());
    for (const auto& [name, svg] : drawings_) io::write_file(saved.folder() / (name + ".svg"), svg);
  }
  io::write_file(saved.folder() / file, html());
}

}  // namespace flexor::report
