#include "host/report/page.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace flexor::report {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(Page, ShowsMarkupAndTemplatesAsText) {
  const std::string bad = "<b>&\"'{{title}}{{> block_list}}\xff";
  Page page(bad);
  page.heading(bad);
  page.paragraph(bad);
  page.warnings({bad});
  page.cards({{bad, bad}});
  page.table({bad, {bad}, {{bad, bad}}, {}});
  page.steps({bad});
  const std::string html = page.html();
  EXPECT_EQ(html.find("<b>&\""), std::string::npos);
  EXPECT_EQ(html.find('\xff'), std::string::npos);
  EXPECT_EQ(count(html, "&lt;b&gt;&amp;&quot;"), 13U) << html;
  EXPECT_EQ(count(html, "{{title}}"), 13U);
}

TEST(Page, KeepsTheOrderOfItsBlocksAndRepeatsNone) {
  Page page("T");
  page.paragraph("one");
  page.begin_details("more");
  page.paragraph("two");
  page.table({"numbers", {"a", "b"}, {{"row", "3"}}, {0}});
  page.end_details();
  page.good("four");
  const std::string html = page.html();
  std::size_t at = 0;
  for (const char* part :
       {"<h1>T</h1>", "<p>one</p>", "<summary>more</summary>", "<p>two</p>", "class=\"marked\"",
        "<th scope=\"row\">row</th><td>3</td>", "</details>", "<p class=\"good\">four</p>"}) {
    const auto next = html.find(part, at);
    ASSERT_NE(next, std::string::npos) << part << html;
    EXPECT_EQ(count(html, part), 1U) << part;
    at = next;
  }
}

TEST(Page, LinksToItsOtherPagesWithTextsAsText) {
  Page page("T");
  page.links("Joints & more", {{"joint-1.html", "<b>one"}, {"joint-2.html", "two"}});
  const std::string html = page.html();
  EXPECT_EQ(count(html, "<nav aria-label=\"Joints &amp; more\">"), 1U) << html;
  EXPECT_EQ(count(html, "<li><a href=\"joint-1.html\">&lt;b&gt;one</a></li>"), 1U);
  EXPECT_EQ(count(html, "<li><a href="), 2U);
}

TEST(Page, ItsTablesFitATerminalAndAColumnWithoutAnyValueIsLeftOut) {
  Json rows = Json::array();
  std::vector<Column> columns = {{"name", "/name"}, {"none", "/none"}};
  for (int c = 0; c < 12; ++c) columns.emplace_back(fmt::format("figure {}", c), "/value", "{:.2f}°");
  rows.push_back({{"name", std::string(60, 'n')}, {"value", 1.5}, {"chosen", true}});
  rows.push_back({{"name", "short"}, {"value", nullptr}, {"none", nullptr}});
  const TableBlock table = table_of("numbers", rows, columns);
  EXPECT_EQ(table.columns.size(), 13U);
  EXPECT_EQ(table.marked, std::vector<std::size_t>{0});
  EXPECT_EQ(table.rows[1][1], "-");
  Page page("T");
  page.table(table);
  std::istringstream lines(page.text());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 90U) << line;  // bytes
  EXPECT_EQ(count(page.text(), "1.50°"), 12U) << page.text();
  EXPECT_EQ(count(page.text(), "short"), 2U) << "in two pieces";
}

TEST(Page, NeedsNothingElseAndRunsNothing) {
  Page page("T");
  page.picture({"p", "A hand", "seen"}, "\xff\xd8\xff");
  const std::string html = page.html();
  EXPECT_NE(html.find("data:image/jpeg;base64,/9j/"), std::string::npos);
  EXPECT_NE(html.find("alt=\"A hand\""), std::string::npos);
  for (const char* part : {"<script", "http:", "https:", "url(", "@import", "href="})
    EXPECT_EQ(html.find(part), std::string::npos) << part;
}

TEST(Page, ChartsAndDrawingsHaveNamesAndTheirTextsStayTexts) {
  const std::string bad = "</script><bad>";
  Page page("T");
  page.chart(
      {{"first", "One & only", "what it <shows>"}, bad, {{bad, {{bad, "#0072B2", {0, 1}, {2, NAN}}}}}});
  Drawing drawing;
  drawing.text(0, 0, bad);
  const Figure figure{"second", "Two", "more"};
  page.drawing(figure, drawing.svg(figure, 10, 10));
  const std::string html = page.html();
  EXPECT_EQ(count(html, "class=\"figures\""), 1U);
  EXPECT_EQ(count(html, "<bad>"), 0U);
  EXPECT_EQ(count(html, "<script"), 2U) << "the chart's data, and what draws them";
  EXPECT_NE(html.find("id=\"first\" role=\"group\" aria-label=\"One &amp; only\""), std::string::npos);
  EXPECT_NE(html.find("role=\"img\" aria-labelledby=\"second_title\""), std::string::npos);
  EXPECT_NE(html.find("\\u003c/script>"), std::string::npos);
}

}  // namespace
}  // namespace flexor::report
