#include "host/report/page.hpp"

#include <algorithm>
#include <kainjow/mustache.hpp>
#include <sstream>
#include <stdexcept>

#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/report/templates.hpp"

namespace flexor::report {
namespace {

using Json = nlohmann::ordered_json;
namespace mustache = kainjow::mustache;

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

mustache::data to_data(const Json& json) {
  if (json.is_object()) {
    mustache::data out(mustache::data::type::object);
    for (const auto& item : json.items()) out.set(item.key(), to_data(item.value()));
    return out;
  }
  if (json.is_array()) {
    mustache::data out(mustache::data::type::list);
    for (const Json& item : json) out.push_back(to_data(item));
    return out;
  }
  if (json.is_boolean()) return mustache::data(json.get<bool>());
  return mustache::data(io::to_utf8(json.get<std::string>()));
}

Json text(const std::string& value) { return {{"text", value}}; }

Json texts(const std::vector<std::string>& values) {
  Json out = Json::array();
  for (const std::string& value : values) out.push_back(text(value));
  return out;
}

// A block inside another must not find its parent's content: every kind that it is not is named and false.
Json block(const char* kind, Json content) {
  Json out;
  for (const char* other : {"heading", "paragraph", "good", "steps", "links", "warnings", "cards", "figures",
                            "table", "details"}) {
    out[other] = false;
  }
  out[kind] = std::move(content);
  return out;
}

}  // namespace

void Page::add(const char* kind, Json content) {
  (details_.empty() ? blocks_ : inner_).push_back(block(kind, std::move(content)));
}

void Page::heading(const std::string& t) { add("heading", text(t)); }
void Page::paragraph(const std::string& t) { add("paragraph", text(t)); }
void Page::good(const std::string& t) { add("good", text(t)); }

void Page::steps(const std::vector<std::string>& lines) { add("steps", {{"lines", texts(lines)}}); }

void Page::warnings(const std::vector<std::string>& lines) { add("warnings", {{"lines", texts(lines)}}); }

void Page::links(const std::string& name, const std::vector<Link>& links) {
  Json list = Json::array();
  for (const Link& l : links) list.push_back({{"file", l.file}, {"label", l.label}});
  add("links", {{"name", name}, {"list", std::move(list)}});
}

void Page::cards(const std::vector<Card>& cards) {
  Json list = Json::array();
  for (const Card& c : cards) list.push_back({{"value", c.value}, {"label", c.label}, {"plain", c.plain}});
  add("cards", {{"list", std::move(list)}});
}

void Page::table(const TableBlock& t) {
  Json rows = Json::array();
  for (std::size_t r = 0; r < t.rows.size(); ++r) {
    const std::vector<std::string>& row = t.rows[r];
    rows.push_back({{"marked", std::ranges::find(t.marked, r) != t.marked.end()},
                    {"first", row.front()},
                    {"cells", texts({row.begin() + 1, row.end()})}});
  }
  add("table", {{"name", t.caption},
                {"has_head", !t.columns.empty()},
                {"columns", texts(t.columns)},
                {"words", t.is_text},
                {"rows", std::move(rows)}});
}

void Page::add_figure(const Figure& f, Json content) {
  Json& list = details_.empty() ? blocks_ : inner_;
  if (list.empty() || !list.back().at("figures").is_object()) add("figures", {{"list", Json::array()}});
  Json out = {{"title", f.title}, {"caption", f.caption}, {"wide", f.wide},
              {"svg", ""},        {"jpeg", false},        {"chart", false}};
  out.update(content);
  list.back()["figures"]["list"].push_back(std::move(out));
}

void Page::chart(Chart chart) {
  if (charts_.empty() && page_template("uPlot.iife.min.js").empty())
    warnings({"This page has no curves: this flexor was built without web/node_modules (script/bootstrap)."});
  add_figure(chart.figure, {{"chart", {{"data", to_json(chart)}, {"name", chart.figure.name}}}});
  charts_.push_back(std::move(chart));
}

void Page::drawing(const Figure& f, const std::string& svg) {
  add_figure(f, {{"svg", svg}});
  drawings_.emplace_back(f.name, svg);
}

void Page::picture(const Figure& f, std::string_view jpeg) {
  add_figure(f, {{"jpeg", {{"alt", f.title}, {"base64", io::base64(jpeg)}}}});
}

void Page::begin_details(const std::string& summary) { details_ = summary; }

void Page::end_details() {
  Json content = {{"summary", details_}, {"blocks", std::move(inner_)}};
  details_.clear();
  inner_ = Json::array();
  add("details", std::move(content));
}

std::string Page::html() const {
  Json plots = false;
  if (!charts_.empty()) plots = {{"script", report_script()}, {"style", page_template("uPlot.min.css")}};
  mustache::data view = to_data({{"title", title_}, {"blocks", blocks_}, {"plots", plots}});
  view.set("block_list", mustache::partial([] { return page_template("blocks.mustache"); }));
  mustache::mustache page{page_template("page.mustache")};
  if (!page.is_valid()) throw std::logic_error(page.error_message());
  return page.render(view);
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
