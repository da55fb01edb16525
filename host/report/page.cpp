#include "host/report/page.hpp"

#include <algorithm>
#include <kainjow/mustache.hpp>
#include <stdexcept>

#include "host/io/base64.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/report/templates.hpp"

namespace flexor::report {
namespace {

using Json = nlohmann::ordered_json;
namespace mustache = kainjow::mustache;

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
  for (const char* other : {"heading", "paragraph", "good", "code", "links", "warnings", "cards", "figures",
                            "table", "details"}) {
    out[other] = false;
  }
  out[kind] = std::move(content);
  return out;
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  for (const char c : io::to_utf8(std::string(text))) {
    const char* const entity = c == '&'    ? "&amp;"
                               : c == '<'  ? "&lt;"
                               : c == '>'  ? "&gt;"
                               : c == '"'  ? "&quot;"
                               : c == '\'' ? "&#39;"
                                           : nullptr;
    if (entity != nullptr) {
      out += entity;
    } else {
      out += c;
    }
  }
  return out;
}

void Page::add(const char* kind, Json content) {
  (details_.empty() ? blocks_ : inner_).push_back(block(kind, std::move(content)));
}

void Page::heading(const std::string& t) { add("heading", text(t)); }
void Page::paragraph(const std::string& t) { add("paragraph", text(t)); }
void Page::good(const std::string& t) { add("good", text(t)); }
void Page::code(const std::string& t) { add("code", text(t)); }

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
  add("table", {{"name", t.caption}, {"columns", texts(t.columns)}, {"rows", std::move(rows)}});
}

void Page::figure(const Figure& f, const std::string& svg, const std::string& undrawn) {
  if (svg.empty()) {
    if (!lacks_figures_) warnings({"This report has no figures: " + undrawn});
    lacks_figures_ = true;
    return;
  }
  Json& list = details_.empty() ? blocks_ : inner_;
  if (list.empty() || !list.back().at("figures").is_object()) add("figures", {{"list", Json::array()}});
  list.back()["figures"]["list"].push_back({{"title", f.title},
                                            {"caption", f.caption},
                                            {"svg", for_page(svg, f)},
                                            {"wide", f.wide},
                                            {"jpeg", false}});
}

void Page::figure(const Figure& f, const Gnuplot& drawn, const std::filesystem::path& folder) {
  const std::string svg = drawn.svg(f.name);
  if (!svg.empty()) io::write_file(folder / (f.name + ".svg"), svg);
  figure(f, svg, drawn.undrawn());
}

void Page::picture(const Figure& f, std::string_view jpeg) {
  add("figures", {{"list", Json::array({{{"title", f.title},
                                         {"caption", f.caption},
                                         {"svg", ""},
                                         {"wide", false},
                                         {"jpeg", {{"alt", f.title}, {"base64", io::base64(jpeg)}}}}})}});
}

void Page::begin_details(const std::string& summary) { details_ = summary; }

void Page::end_details() {
  Json content = {{"summary", details_}, {"blocks", std::move(inner_)}};
  details_.clear();
  inner_ = Json::array();
  add("details", std::move(content));
}

std::string Page::html() const {
  mustache::data view = to_data({{"title", title_}, {"blocks", blocks_}});
  view.set("block_list", mustache::partial([] { return page_template("blocks.mustache"); }));
  mustache::mustache page{page_template("page.mustache")};
  if (!page.is_valid()) throw std::logic_error(page.error_message());
  return page.render(view);
}

}  // namespace flexor::report
