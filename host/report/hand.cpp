// The report of a hand: an overview of its joints, and a page for each of them.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/io/io.hpp"
#include "host/report/kinds.hpp"
#include "host/report/sample_figures.hpp"
#include "host/score/judge.hpp"

namespace flexor::report {
namespace {

// What stands beside the compensator, by the same estimator from the same samples, without its article.
std::string words_of(const score::Baseline& peer) { return std::strchr(peer.words, ' ') + 1; }

// A column for the compensator at `own`, and one for each peer at `of`, by its key, and `behind` that.
std::vector<Column> beside_peers(const std::string& own, const std::string& of,
                                 const std::string& behind = "") {
  std::vector<Column> out = {{"compensator", own, "{:.2f}°"}};
  for (const score::Baseline& peer : score::kBaselines)
    out.emplace_back(words_of(peer), fmt::format("{}/{}{}", of, peer.name, behind), "{:.2f}°");
  return out;
}

std::string degrees(double value) { return std::isnan(value) ? "-" : fmt::format("{:.2f}°", value); }

std::string sensors_of(const Json& joint) {
  std::string out;
  for (const Json& sensor : joint.at("sensors"))
    out += (out.empty() ? "" : " + ") + sensor.at("column").get<std::string>();
  return out;
}

// Of a file, wherever it lies.
std::string name_of(const Json& pair, const char* which) {
  const std::filesystem::path path(pair.at(which).get<std::string>());
  return (path.parent_path().filename() / path.filename()).string();
}

std::string page_of(std::size_t joint) { return fmt::format("joint-{}.html", joint + 1); }

// Root mean square over the joints.
Card error_card(const Json& joints) {
  double squares = 0;
  for (const Json& joint : joints) squares += std::pow(joint.at("holdout").at("rmse_deg").get<double>(), 2);
  return {degrees(std::sqrt(squares / static_cast<double>(joints.size()))),
          joints.size() > 1
              ? fmt::format("typical error of the compensator (RMSE of all {} joints, unseen data)",
                            joints.size())
              : "typical error of the compensator (RMSE, unseen data)"};
}

std::string way(const Json& r) {
  std::string out = fmt::format(
      "The first {:.0f} % of what both logs of a pair saw taught the compensator; every figure is from the "
      "rest. The peers were fitted to the same part: a straight line through the readings, the same between "
      "limits, with the readings' motion as well (its lead), a curve through the readings, and the published "
      "form, a dead zone, a linear filter and a limit, with its parameters fitted.",
      100 * r.at("split").get<double>());
  if (const double lead_s = r.at("lead_s").get<double>(); lead_s > 0)
    out += fmt::format(" All of them estimate the angle {:.3g} s ahead.", lead_s);
  if (r.at("fit_all").get<bool>()) {
    out +=
        " The model that was saved was then fitted in the same way to all of the recordings; the figures "
        "stay those of the part.";
  }
  return out;
}

void joints_table(Page& page, const Json& joints) {
  std::vector<Column> columns = beside_peers("/holdout/rmse_deg", "/baselines", "/rmse_deg");
  const auto off = [](std::size_t which) {  // 0 without a lead
    return [which](const Json& joint) {
      const Json rmse_deg = joint.value("lead_off_rmse_deg", Json::array({0, 0}));
      return degrees(rmse_deg.at(which) == 0 ? NAN : number_or_nan(rmse_deg.at(which)));
    };
  };
  columns.insert(columns.end(), {{"0.05 s sooner", off(0)},
                                 {"0.05 s later", off(1)},
                                 {"fit", "/holdout/fit_percent", "{:.1f} %"},
                                 {"drift of a hold", "/hold_drift_deg", "{:.2f}°"},
                                 {"open hand", "/ends/open_deg", "{:.1f}°"},
                                 {"fist", "/ends/fist_deg", "{:.1f}°"}});
  page.heading("Joints");
  page.table(table_of("Typical error (RMSE) on data that no fit saw", joints, columns, "joint"));
  for (const auto& [name, joint] : joints.items()) {
    page.paragraph(fmt::format("{}: {}.", name, joint.at("verdict").at("words").get<std::string>()));
    page.paragraph(fmt::format("Its structure: {}.", joint.at("structure").get<std::string>()));
  }
  page.paragraph(
      "Sooner, later: where what follows takes so much less or more than the lead. Fit: 100 % is perfect, 0 "
      "% is guessing the mean. Drift of a hold: how far the angle goes within a minute while the finger "
      "keeps still. Open hand, fist: by the angles, where --pose-angles states no others.");
}

void clocks_table(Page& page, const Json& r) {
  page.heading("Clocks");
  page.table(table_of("Camera clock minus glove clock", r.at("pairs"),
                      {{"glove", [](const Json& p) { return name_of(p, "sensor"); }},
                       {"camera", [](const Json& p) { return name_of(p, "reference"); }},
                       {"shared", "/shared_s", "{:.0f} s"},
                       {"clock offset", "/clock_offset_s", "{:+.3f} s"},
                       {"standard error", "/clock_offset_se_s", "{:.3f} s"},
                       {"confidence", "/confidence", "{:.2f}"},
                       {"camera fast by", "/drift_ppm", "{:+.0f} ppm"}}));
  page.paragraph(
      fmt::format("{}Confidence: the probability that the offset is right to 0.15 s. All joints of a pair "
                  "share its offset, which holds the sensors' own lag too.",
                  r.value("clock_offset_given", false) ? "The offset was given by the user. " : ""));
}

void origins(Page& page, const Json& r) {
  page.begin_details("Digests of the recordings");
  page.table(
      table_of("Recordings", r.at("pairs"), {{"glove", "/sensor_digest"}, {"camera", "/reference_digest"}}));
  page.end_details();
  page.paragraph(fmt::format("{:g} Hz; structure asked for: {}.", r.at("rate_hz").get<double>(),
                             r.at("structure_asked_for").get<std::string>()));
}

void tried_structures(Page& page, const Json& joint) {
  page.heading("Structures tried");
  if (joint.at("structures").empty())
    return page.paragraph(fmt::format("One alone: {}.", joint.at("structure").get<std::string>()));
  const auto structure = [](const Json& row) {
    const auto refusal = row.value("refusal", std::string());
    return row.at("structure").get<std::string>() + (refusal.empty() ? "" : ", not: " + refusal);
  };
  const auto loss = [](const Json& row) {  // none in results of before it was kept
    if (row.value("fold_loss", Json()).is_null()) return std::string("-");
    return fmt::format("{:.3g} ± {:.2g}", row.at("fold_loss").get<double>(),
                       row.at("fold_loss_se").get<double>());
  };
  page.table(table_of("By loss over the folds, the chosen one first", joint.at("structures"),
                      {{"structure", structure},
                       {"parameters", "/effective_parameters", "{:.1f}"},
                       {"error, fitted part", "/fitted_rmse_deg", "{:.2f}°"},
                       {"cross-validated", "/cross_validated_rmse_deg", "{:.2f}°"},
                       {"loss over the folds", loss},
                       {"drift of a hold", "/hold_drift_deg", "{:.2f}°"},
                       {"chosen", [](const Json& row) { return row.at("chosen").get<bool>() ? "*" : ""; }}}));
  page.paragraph(
      "Chosen: the smallest of the sums whose loss over the folds is at most 6.1 % and cross-validated RMSE "
      "at most 3 % above the best of all, or a smaller chain within a standard error of it or one better by "
      "more, that holds still when the finger does and fits the glove's integers; or one that undoes a "
      "sensor's creep where that pays. Drift: of readings that are held for a minute. No drift: a better one "
      "was found before. Parameters: how many the data determine.");
}

// A row for each pair, or for each part that was left out.
void rows_table(Page& page, const std::string& title, const Json& rows) {
  std::vector<Column> columns = beside_peers("/rmse_deg", "/baselines");
  columns.insert(columns.begin(), {"", "/name"});
  page.table(table_of(title, rows, columns));
}

void parts_of(Page& page, const Json& joint) {
  if (const Json& pairs = joint.at("pairs"); pairs.size() > 1)
    rows_table(page, "Typical error (RMSE) on the part of each pair that was held out", pairs);
  if (!joint.contains("left_out")) return;
  rows_table(page, "Typical error (RMSE) of fits to all but one", joint.at("left_out").at("rows"));
  if (const Json& verdict = joint.at("left_out").at("verdict"); verdict.is_object())
    page.paragraph(fmt::format("Left out: {}.", verdict.at("words").get<std::string>()));
}

void overview(const Saved& saved) {
  const Json& r = saved.results();
  const Json& joints = r.at("joints");
  Page page(joints.size() == 1 ? "A joint of a hand, from readings to an angle"
                               : fmt::format("{} joints of a hand, from readings to angles", joints.size()));
  page.cards({error_card(joints)});
  const auto warnings = r.at("warnings").get<std::vector<std::string>>();
  warnings.empty() ? page.good("No warnings.") : page.warnings(warnings);
  page.paragraph(way(r));
  joints_table(page, r.at("joints"));
  clocks_table(page, r);
  std::vector<Link> links;
  for (const auto& [name, joint] : joints.items())
    links.push_back({page_of(links.size()),
                     fmt::format("{}, from {}: response, curve, structures", name, sensors_of(joint))});
  page.links("Joints", links);
  origins(page, r);
  page.write(saved);
}

void joint_scores(Page& page, const Json& joint) {
  page.heading("Scores beside the peers");
  std::vector<std::pair<std::string, Json>> scores = {{"compensator", joint.at("holdout")}};
  for (const score::Baseline& peer : score::kBaselines)
    scores.emplace_back(words_of(peer), joint.at("baselines").value(peer.name, Json()));
  page.table(scores_table("Scores on the held-out part", scores));
  for (const Json& refusal : joint.at("baseline_refusals"))
    page.paragraph("Could not be fitted: " + refusal.get<std::string>() + ".");
}

double parameter(const Json& joint, const std::string& name) {
  for (const Json& p : joint.at("parameters"))
    if (p.at("name") == name) return p.at("value").get<double>();
  return NAN;
}

// A pair of complex poles, with its input held over a period, as host/model/kinds.hpp.
void pair_transfer_function(Page& page, const Json& joint, double period_s) {
  const double w = parameter(joint, "frequency (rad/s)");
  if (std::isnan(w)) return;
  const double zeta = parameter(joint, "damping");
  const double c0 = parameter(joint, "tap 1");
  const double c1 = parameter(joint, "tap 2");
  const double turn = w * period_s * std::sqrt(1 - zeta * zeta);
  const double decay = std::exp(-zeta * w * period_s);
  const double side = -decay * std::sin(turn) / std::sqrt(1 - zeta * zeta);
  const double trace = 2 * decay * std::cos(turn);
  const double g = (1 - c0) * (trace / 2 - zeta * side) + c1 * side;
  const double h = (1 - c0) * decay * decay;
  page.heading("Transfer function");
  page.paragraph(
      fmt::format("Of the linear block, apart from the chain's gain or curves: G(s) = ({:.4g} s² {:+.4g} s "
                  "{:+.4g}) / (s² {:+.4g} s {:+.4g}), and with each input held over the {:g} s that end at "
                  "its sample G(z) = ({:.5f} {:+.5f} / z {:+.5f} / z²) / (1 {:+.5f} / z {:+.5f} / z²).",
                  c0, 2 * zeta * w * c0 + c1 * w, w * w, 2 * zeta * w, w * w, period_s, 1 - g, g + h - trace,
                  decay * decay - h, -trace, decay * decay));
}

// A chain's blocks, each beside the value that the best of its starts had.
void chain_parameters(Page& page, const Json& joint) {
  if (!joint.contains("iterations") || joint.at("iterations").is_null()) return;
  const auto error = [](const Json& p) {
    if (p.at("name").get<std::string>().starts_with("weight of "))
      return std::string("fitted first, on its own");
    return p.at("standard_error").is_null() ? std::string("not determined")
                                            : fmt::format("{:.2g}", p.at("standard_error").get<double>());
  };
  page.heading("Parameters");
  page.table(table_of("", joint.at("parameters"),
                      {{"parameter", "/name"},
                       {"value", "/value", "{:.5g}"},
                       {"standard error", error},
                       {"initial value", "/initial", "{:.5g}"}}));
  page.paragraph(fmt::format("Initial values: start {}, the best. From there on: {} iterations.",
                             joint.value("start", 1), joint.at("iterations").get<int>()));
}

// The chain's linear block as a sum of first-order terms,
//   G(s) = sum g_i / (1 + s / a_i),   G(z) = sum g_i (1 - p_i) / (1 - p_i / z),   p_i = exp(-a_i T),
// of what host/model/lti.hpp has in a row; no table for poles that lie too near to each other for that.
void transfer_function(Page& page, const Json& joint, double period_s) {
  std::vector<double> pole;
  std::vector<double> tap;  // behind one lag, behind two ...
  TableBlock t{"", {"term", "gain", "pole, rad/s", "time constant", "z-plane"}, {}, {}};
  std::vector<std::string> error;
  for (const Json& p : joint.at("parameters")) {
    const auto name = p.at("name").get<std::string>();
    if (name.starts_with("tap")) tap.push_back(p.at("value").get<double>());
    if (!name.starts_with("pole")) continue;
    pole.push_back(-p.at("value").get<double>());
    error.push_back(p.at("standard_error").is_null()
                        ? "not known"
                        : fmt::format("± {:.2g}", p.at("standard_error").get<double>()));
  }
  std::vector<double> gain(pole.size(), 0);
  double left = 1;
  for (std::size_t n = 0; n < pole.size(); ++n) {  // behind n + 1 lags
    const double c = n < tap.size() ? tap[n] : left;
    left -= c;
    for (std::size_t i = 0; i <= n; ++i) {
      double share = c;
      for (std::size_t j = 0; j <= n; ++j) share *= j == i ? 1 : pole[j] / (pole[j] - pole[i]);
      gain[i] += share;
    }
  }
  if (pole.empty() || !std::ranges::all_of(gain, [](double g) { return std::abs(g) < 1e3; })) return;
  for (std::size_t i = 0; i < pole.size(); ++i)
    t.rows.push_back({fmt::format("{}", i + 1), fmt::format("{:.4g}", gain[i]),
                      fmt::format("-{:.4g} ({})", pole[i], error[i]), fmt::format("{:.3g} s", 1 / pole[i]),
                      fmt::format("{:.5f}", std::exp(-pole[i] * period_s))});
  page.heading("Transfer function");
  page.table(t);
  page.paragraph(
      fmt::format("Of the linear block, apart from the chain's gain or curves: G(s) = Σ g / (1 + s / a), and "
                  "with each input held over the {:g} s that end at its sample G(z) = Σ g (1 - p) / (1 - p / "
                  "z), g the gain, -a the pole, p its place in the z-plane. In brackets: standard error.",
                  period_s));
}

void joint_page(const Saved& saved, const std::string& name, const Json& joint, std::size_t number) {
  Page page(fmt::format("{}: from {} to an angle", name, sensors_of(joint)));
  const std::vector<Link> back = {{"report.html", "All joints"}};
  page.links("Report", back);
  page.paragraph(joint.at("verdict").at("words").get<std::string>() + ".");
  const Json& held = joint.at("holdout");
  page.cards({error_card(Json::array({joint})),
              {fmt::format("{:.1f}°", held.at("p95_abs_deg").get<double>()),
               fmt::format("95 % of the errors are smaller; the largest is {:.1f}°",
                           held.at("max_abs_deg").get<double>())}});
  joint_figures(page, saved, joint, number);
  tried_structures(page, joint);
  const double period_s = 1 / saved.results().at("rate_hz").get<double>();
  transfer_function(page, joint, period_s);
  pair_transfer_function(page, joint, period_s);
  chain_parameters(page, joint);
  joint_scores(page, joint);
  parts_of(page, joint);
  page.paragraph(fmt::format("Measured angle: {}. Structure of the saved model: {}.",
                             joint.at("reference").get<std::string>(),
                             joint.at("structure").get<std::string>()));
  page.write(saved, page_of(number - 1));
}

}  // namespace

void summarize_hand(Page& page, const Json& r) {
  const Json& joints = r.at("joints");
  joints_table(page, joints);
  clocks_table(page, r);
  if (joints.size() == 1) tried_structures(page, joints.front());
  for (const auto& [name, joint] : joints.items()) {
    if (joint.at("pairs").size() > 1 || joint.contains("left_out")) page.heading(name);
    parts_of(page, joint);
  }
}

// The overview last: where it is, all pages that it links to are.
void render_hand(const Saved& saved) {
  const Json& joints = saved.results().at("joints");
  if (!joints.is_object() || joints.empty()) throw std::domain_error("no joint");
  std::size_t number = 0;
  for (const auto& [name, joint] : joints.items()) {
    joint_page(saved, name, joint, ++number);
  }
  overview(saved);
}

}  // namespace flexor::report
