#include "host/report/report.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::report {
namespace {
namespace fs = std::filesystem;

class Report : public testing::Test {
 protected:
  Report() : folder_(fs::path(testing::TempDir()) / ("flexor_report_test_" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    EXPECT_EQ(std::system(("'" FLEXOR_SIMULATE "' '" + folder_.string() + "'").c_str()), 0);
    FileRequest r;
    r.files = {folder_ / "simulated_glove.csv", folder_ / "simulated_camera.csv", "", ""};
    r.structure = "hw";
    result_ = identify_files(r, {});
  }
  ~Report() override { fs::remove_all(folder_); }

  fs::path folder_;
  Identification result_;
};

TEST_F(Report, IsWholeAndNeedsNothingElse) {
  write_report(result_, folder_ / "report");
  const std::string html = io::read_file(folder_ / "report" / "report.html");
  for (const char* name : {"alignment", "curve", "dynamics", "holdout", "residuals"}) {
    const std::string svg = io::read_file(folder_ / "report" / (std::string(name) + ".svg"));
    EXPECT_TRUE(svg.starts_with("<svg")) << name;
    EXPECT_NE(svg.find("</svg>"), std::string::npos) << name;
    EXPECT_NE(html.find(svg), std::string::npos) << name << " is not in the page";
  }
  for (const char* part :
       {"On data it never saw", "All structures side by side", "standard error", "Residual checks"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("href=\"http"), std::string::npos);
}

TEST_F(Report, RefusalsAreWarnedOfInPlainWords) {
  ASSERT_FALSE(result_.fit.refusals.empty());
  EXPECT_NE(report_html(result_, {}).find("the finger never reached an end stop there"), std::string::npos);
}

TEST_F(Report, HoldoutCsvIsTheScoredPart) {
  write_report(result_, folder_ / "report");
  const auto r = recording::read_csv(folder_ / "report" / "holdout.csv", {});
  EXPECT_EQ(r.t_s.size(), result_.holdout.samples);
  const auto s = score::score(r.t_s, r.column("measured_deg").value, r.column("estimated_deg").value);
  EXPECT_NEAR(s.rmse_deg, result_.holdout.rmse_deg, 1e-9);
}

TEST_F(Report, NamesWithMarkupAreShownNotObeyed) {
  result_.pair.input = "<b>&\"";
  const std::string html = report_html(result_, {});
  EXPECT_EQ(html.find("<b>&\""), std::string::npos);
  EXPECT_NE(html.find("&lt;b&gt;&amp;&quot;"), std::string::npos);
}

TEST_F(Report, AnUnwritableFolderIsAnInputError) {
  io::write_file(folder_ / "file", "x");
  EXPECT_THROW(write_report(result_, folder_ / "file"), io::InputError);
}

}  // namespace
}  // namespace flexor::report
