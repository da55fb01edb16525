// The report of a hand: an overview of its joints, and a page for each of them.
#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"
#include "host/report/page.hpp"
#include "host/report/render.hpp"
#include "host/report/sample_figures.hpp"

namespace flexor::report {
namespace {

// What stands beside the compensator, by the same estimator from the same samples.
struct Peer {
  const char* key;
  const char* name;
};
constexpr Peer kPeers[] = {{"line", "straight line"},
                           {"limited_line", "line between limits"},
                           {"line_lead", "line with lead"},
                           {"static_curve", "static curve"},
                           {"published_form", "published form"}};

double number(const Json& scores, const char* key) {
  return scores.is_object() ? number_or_nan(scores.value(key, Json(nullptr))) : NAN;
}

// NaN where that peer could not be fitted.
double peer_rmse_deg(const Json& joint, const Peer& peer) {
  return number(joint.at("baselines").value(peer.key, Json(nullptr)), "rmse_deg");
}

std::string degrees(double value) { return std::isnan(value) ? "-" : fmt::format("{:.2f}°", value); }

std::string sensors_of(const Json& joint) {
  std::string out;
  for (const Json& sensor : joint.at("sensors"))
    out += (out.empty() ? "" : " + ") + sensor.at("column").get<std::string>();
  return out;
}

std::string page_of(std::size_t joint) { return fmt::format("joint-{}.html", joint + 1); }

// Root mean square over the joints; NaN where a joint has no such figure.
double over_joints(const Json& joints, const std::function<double(const Json&)>& of) {
  double squares = 0;
  for (const auto& joint : joints.items()) squares += of(joint.value()) * of(joint.value());
  return std::sqrt(squares / static_cast<double>(joints.size()));
}

double compensator_rmse_deg(const Json& joint) { return joint.at("holdout").at("rmse_deg").get<double>(); }

// Of all joints together.
std::vector<Card> error_cards(const Json& joints) {
  std::vector<Card> cards = {
      {degrees(over_joints(joints, compensator_rmse_deg)),
       joints.size() > 1
           ? fmt::format("typical error of the compensator (RMSE of all {} joints, unseen data)",
                         joints.size())
           : "typical error of the compensator (RMSE, unseen data)"}};
  for (const Peer& peer : kPeers) {
    const double rmse_deg =
        over_joints(joints, [&](const Json& joint) { return peer_rmse_deg(joint, peer); });
    if (!std::isnan(rmse_deg))
      cards.push_back({degrees(rmse_deg), fmt::format("the same with the {}", peer.name), true});
  }
  return cards;
}

// Results of before it was measured have none.
std::string lead_cost(const Json& joints) {
  if (!joints.front().contains("lead_off_rmse_deg")) return "";
  const auto off = [&](std::size_t which) {
    return over_joints(
        joints, [&](const Json& joint) { return number_or_nan(joint.at("lead_off_rmse_deg").at(which)); });
  };
  return fmt::format("; where what follows takes 0.05 s less or more than that, they err by {} or {}",
                     degrees(off(0)), degrees(off(1)));
}

std::string way(const Json& r) {
  std::string out = fmt::format(
      "The first {:.0f} % of what both logs of a pair saw taught the compensator; every figure is from the "
      "rest. The peers were fitted to the same part: a straight line through the readings, the same "
      "between limits, with the readings' motion as well (its lead), a curve through the readings, and the "
      "published form, a dead zone, a linear filter and a limit, "
      "with "
      "its parameters fitted.",
      100 * r.at("split").get<double>());
  if (const double lead_s = r.at("lead_s").get<double>(); lead_s > 0)
    out +=
        fmt::format(" All of them estimate the angle {:.3g} s ahead{}.", lead_s, lead_cost(r.at("joints")));
  if (r.at("fit_all").get<bool>()) {
    out +=
        " The model that was saved was then fitted in the same way to all of the recordings; the figures "
        "stay "
        "those of the part.";
  }
  return out;
}

void joints_table(Page& page, const Json& joints) {
  TableBlock t{"Typical error (RMSE) on data that no fit saw", {"joint", "compensator"}, {}, {}};
  for (const Peer& peer : kPeers) t.columns.emplace_back(peer.name);
  for (const char* column : {"fit", "drift of a hold", "sensors", "structure"})
    t.columns.emplace_back(column);
  std::vector<Link> links;
  for (const auto& [name, joint] : joints.items()) {
    std::vector<std::string> row = {name, degrees(compensator_rmse_deg(joint))};
    for (const Peer& peer : kPeers) row.push_back(degrees(peer_rmse_deg(joint, peer)));
    const double fit_percent = number(joint.at("holdout"), "fit_percent");
    row.push_back(std::isnan(fit_percent) ? "-" : fmt::format("{:.1f} %", fit_percent));
    row.push_back(degrees(joint.at("hold_drift_deg").get<double>()));
    row.push_back(sensors_of(joint));
    row.push_back(joint.at("structure").get<std::string>());
    t.rows.push_back(std::move(row));
    links.push_back({page_of(links.size()), fmt::format("{}: response, curve, structures", name)});
  }
  page.heading("Joints");
  page.table(t);
  page.links("Joints", links);
  for (const auto& [name, joint] : joints.items())
    page.paragraph(fmt::format("{}: {}.", name, joint.at("verdict").at("words").get<std::string>()));
  page.paragraph(
      "Fit: 100 % is perfect, 0 % is guessing the mean. Drift of a hold: how far the angle goes within a "
      "minute while the finger keeps still.");
}

void clocks_table(Page& page, const Json& r) {
  TableBlock t{"Camera clock minus glove clock",
               {"pair", "glove", "camera", "shared", "clock offset", "standard error", "confidence"},
               {},
               {}};
  for (const Json& pair : r.at("pairs")) {
    t.rows.push_back({fmt::format("{}", t.rows.size() + 1), pair.at("sensor").get<std::string>(),
                      pair.at("reference").get<std::string>(),
                      fmt::format("{:.0f} s", pair.at("shared_s").get<double>()),
                      fmt::format("{:+.3f} s", pair.at("clock_offset_s").get<double>()),
                      fmt::format("{:.3f} s", pair.at("clock_offset_se_s").get<double>()),
                      fmt::format("{:.2f}", pair.at("confidence").get<double>())});
  }
  page.heading("Clocks");
  page.table(t);
  page.paragraph(
      fmt::format("{}Confidence: the probability that the offset is right to 0.15 s. All joints of a pair "
                  "share its offset, which holds the sensors' own lag too.",
                  r.at("clock_offset_given").get<bool>() ? "The offset was given by the user. " : ""));
}

void origins(Page& page, const Json& r) {
  TableBlock t{"Recordings", {"pair", "glove", "camera"}, {}, {}};
  for (const Json& pair : r.at("pairs"))
    t.rows.push_back({fmt::format("{}", t.rows.size() + 1), pair.at("sensor_digest").get<std::string>(),
                      pair.at("reference_digest").get<std::string>()});
  page.begin_details("Digests of the recordings");
  page.table(t);
  page.end_details();
  page.paragraph(fmt::format("{:g} Hz; structure asked for: {}.", r.at("rate_hz").get<double>(),
                             r.at("structure_asked_for").get<std::string>()));
}

void overview(const Saved& saved) {
  const Json& r = saved.results();
  const Json& joints = r.at("joints");
  Page page(joints.size() == 1 ? "A joint of a hand, from readings to an angle"
                               : fmt::format("{} joints of a hand, from readings to angles", joints.size()));
  page.cards(error_cards(joints));
  page.paragraph(way(r));
  const auto warnings = r.at("warnings").get<std::vector<std::string>>();
  warnings.empty() ? page.good("No warnings.") : page.warnings(warnings);
  joints_table(page, joints);
  clocks_table(page, r);
  origins(page, r);
  page.write(saved);
}

void joint_cards(Page& page, const Json& joint) {
  const Json& held = joint.at("holdout");
  std::vector<Card> cards = error_cards(Json::array({joint}));
  cards.push_back({fmt::format("{:.1f}°", held.at("p95_abs_deg").get<double>()),
                   fmt::format("95 % of the errors are smaller; the largest is {:.1f}°",
                               held.at("max_abs_deg").get<double>())});
  page.cards(cards);
}

void tried_structures(Page& page, const Json& joint) {
  TableBlock t{"Structures tried, in order of preference",
               {"structure", "parameters", "error, fitted part", "cross-validated", "loss over the folds",
                "drift of a hold"},
               {},
               {}};
  for (const Json& row : joint.at("structures")) {
    if (row.at("chosen").get<bool>()) t.marked.push_back(t.rows.size());
    const auto refusal = row.value("refusal", std::string());
    t.rows.push_back({row.at("structure").get<std::string>() + (refusal.empty() ? "" : ", not: " + refusal),
                      fmt::format("{:.1f}", row.at("effective_parameters").get<double>()),
                      degrees(number_or_nan(row.at("fitted_rmse_deg"))),
                      degrees(number_or_nan(row.at("cross_validated_rmse_deg"))),
                      row.value("fold_loss", Json()).is_null()  // of results of before it was kept, too
                          ? "-"
                          : fmt::format("{:.3g} ± {:.2g}", row.at("fold_loss").get<double>(),
                                        row.at("fold_loss_se").get<double>()),
                      degrees(number_or_nan(row.at("hold_drift_deg")))});
  }
  page.heading("Structures tried");
  if (t.rows.empty())
    return page.paragraph(fmt::format("One alone: {}.", joint.at("structure").get<std::string>()));
  page.table(t);
  page.paragraph(
      "Marked: the smallest of the sums whose loss over the folds is at most 6.1 % and cross-validated RMSE "
      "at most 3 % above the best of all, or a smaller chain within a standard error of it, that holds still "
      "when the finger does and "
      "fits the glove's integers; or one that undoes a "
      "sensor's creep "
      "where that pays. Drift: of readings that are held for a minute. Parameters: how many the data "
      "determine. No drift: a better "
      "one was found before.");
}

// All scores on the held-out part: the compensator's, then its peers'.
TableBlock scores_table(const Json& joint) {
  struct Row {
    const char* name;
    const char* key;
    const char* unit;
  };
  constexpr Row kRows[] = {{"RMSE", "rmse_deg", "°"},
                           {"95th percentile of the error", "p95_abs_deg", "°"},
                           {"largest error", "max_abs_deg", "°"},
                           {"fit (NRMSE)", "fit_percent", " %"},
                           {"R²", "r2", ""},
                           {"integral of absolute error", "iae_deg_s", "°s"},
                           {"best constant lag (positive: late)", "best_lag_s", " s"},
                           {"RMSE with that lag removed", "lag_removed_rmse_deg", "°"},
                           {"integral with that lag removed", "lag_removed_iae_deg_s", "°s"}};
  TableBlock t{"Scores on the held-out part", {"score"}, {}, {}};
  std::vector<Json> columns = {joint.at("holdout")};
  t.columns.emplace_back("compensator");
  for (const Peer& peer : kPeers) {
    t.columns.emplace_back(peer.name);
    columns.push_back(joint.at("baselines").value(peer.key, Json(nullptr)));
  }
  for (const Row& row : kRows) {
    t.rows.push_back({row.name});
    for (const Json& scores : columns) {
      const double value = number(scores, row.key);
      t.rows.back().push_back(std::isnan(value) ? "-" : fmt::format("{:.3f}{}", value, row.unit));
    }
  }
  return t;
}

void joint_scores(Page& page, const Json& joint) {
  page.heading("Scores beside the peers");
  page.table(scores_table(joint));
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
  page.paragraph(fmt::format(
      "Of the linear block, apart from the chain's gain or curves: G(s) = ({:.4g} s² {:+.4g} s {:+.4g}) / "
      "(s² {:+.4g} s {:+.4g}), and with each input held over the {:g} s that end at its sample G(z) = "
      "({:.5f} {:+.5f} / z {:+.5f} / z²) "
      "/ "
      "(1 {:+.5f} / z {:+.5f} / z²).",
      c0, 2 * zeta * w * c0 + c1 * w, w * w, 2 * zeta * w, w * w, period_s, 1 - g, g + h - trace,
      decay * decay - h, -trace, decay * decay));
}

// A chain's blocks, each beside the value that the best of its starts had.
void chain_parameters(Page& page, const Json& joint) {
  if (!joint.contains("iterations") || joint.at("iterations").is_null()) return;
  TableBlock t{"", {"parameter", "value", "standard error", "initial value"}, {}, {}};
  for (const Json& p : joint.at("parameters")) {
    const double error = number(p, "standard_error");
    t.rows.push_back({p.at("name").get<std::string>(), fmt::format("{:.5g}", p.at("value").get<double>()),
                      std::isnan(error) ? "not determined" : fmt::format("{:.2g}", error),
                      fmt::format("{:.5g}", number(p, "initial"))});
  }
  page.heading("Parameters");
  page.table(t);
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
                        ? "not told"
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
                  "with each input held over the {:g} s that end at its sample "
                  "G(z) = Σ g (1 - p) / (1 - p / z), g the gain, -a the pole, p its place in the z-plane. In "
                  "brackets: standard error.",
                  period_s));
}

// A row for each pair, or for each part that was left out.
void rows_table(Page& page, const std::string& title, const Json& rows) {
  TableBlock t{title, {"", "compensator"}, {}, {}};
  for (const Peer& peer : kPeers) t.columns.emplace_back(peer.name);
  for (const Json& row : rows) {
    t.rows.push_back({row.at("name").get<std::string>(), degrees(number(row, "rmse_deg"))});
    for (const Peer& peer : kPeers) t.rows.back().push_back(degrees(number(row.at("baselines"), peer.key)));
  }
  page.table(t);
}

void joint_page(const Saved& saved, const std::string& name, const Json& joint, std::size_t number) {
  Page page(fmt::format("{}: from {} to an angle", name, sensors_of(joint)));
  const std::vector<Link> back = {{"report.html", "All joints"}};
  page.links("Report", back);
  page.paragraph(joint.at("verdict").at("words").get<std::string>() + ".");
  joint_cards(page, joint);
  joint_figures(page, saved, joint, number);
  tried_structures(page, joint);
  const double period_s = 1 / saved.results().at("rate_hz").get<double>();
  transfer_function(page, joint, period_s);
  pair_transfer_function(page, joint, period_s);
  chain_parameters(page, joint);
  joint_scores(page, joint);
  if (const Json pairs = joint.value("pairs", Json::array()); pairs.size() > 1)
    rows_table(page, "Typical error (RMSE) on the part of each pair that was held out", pairs);
  if (joint.contains("left_out")) {
    rows_table(page, "Typical error (RMSE) of fits to all but one", joint.at("left_out").at("rows"));
    if (const Json& verdict = joint.at("left_out").at("verdict"); verdict.is_object())
      page.paragraph(verdict.at("words").get<std::string>() + ".");
  }
  page.paragraph(fmt::format("Measured angle: {}. Structure of the saved model: {}.",
                             joint.at("reference").get<std::string>(),
                             joint.at("structure").get<std::string>()));
  page.write(saved, page_of(number - 1));
}

}  // namespace

// The overview last: where it is, all pages that it links to are.
void render_hand(const Saved& saved) {
  const Json& joints = saved.results().at("joints");
  if (!joints.is_object() || joints.empty()) throw std::domain_error("no joint");
  std::size_t number = 0;
  for (const auto& [name, joint] : joints.items()) {
    saved.go_on();
    joint_page(saved, name, joint, ++number);
  }
  overview(saved);
}

}  // namespace flexor::report
