#include "host/report/page.hpp"

#include <gtest/gtest.h>

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
  page.code(bad);
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

TEST(Page, NeedsNothingElseAndRunsNothing) {
  Page page("T");
  page.picture({"p", "A hand", "seen"}, "\xff\xd8\xff");
  const std::string html = page.html();
  EXPECT_NE(html.find("data:image/jpeg;base64,/9j/"), std::string::npos);
  EXPECT_NE(html.find("alt=\"A hand\""), std::string::npos);
  for (const char* part : {"<script", "http:", "https:", "url(", "@import", "href="}) {
    EXPECT_EQ(html.find(part), std::string::npos) << part;
  }
}

TEST(Page, FiguresHaveNamesOfTheirOwnAndThePagesColours) {
  Gnuplot g;
  for (const char* name : {"first", "second"}) {
    g.begin(name, 200);
    g.add("plot x with points pt 7 lc rgb '#0072B2'");
  }
  g.run();
  Page page("T");
  page.figure({"first", "One & only", "what it <shows>"}, g.svg("first"));
  page.figure({"second", "Two", "more"}, g.svg("second"));
  const std::string html = page.html();
  EXPECT_EQ(count(html, "class=\"figures\""), 1U);
  EXPECT_NE(html.find("role=\"img\" aria-labelledby=\"first_title\" aria-describedby=\"first_desc\""),
            std::string::npos);
  EXPECT_NE(
      html.find(
          "<title id=\"first_title\">One &amp; only</title><desc id=\"first_desc\">what it &lt;shows&gt;"),
      std::string::npos);
  for (const char* id : {"id='gp", "#gpP", "id='textbox", "id=\"gnuplot_canvas\""})
    EXPECT_EQ(count(html, id), 0U) << id;
  EXPECT_NE(html.find("var(--c0072b2, #0072b2)"), std::string::npos);
  EXPECT_EQ(html.find("#0072B2"), std::string::npos);
  EXPECT_EQ(html.find("rgb( "), std::string::npos);
}

}  // namespace
}  // namespace flexor::report
