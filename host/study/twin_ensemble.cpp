#include "host/study/twin_ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/twin/random.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "flexor-ensemble";

// The chains walk in x of twin_prior.hpp.
Point values_at(std::span<const double> x) {
  Point out;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const FreeParameter& p = free_parameters()[i];
    const bool inside = x[i] >= p.coordinate(p.min) && x[i] <= p.coordinate(p.max);
    out.push_back(inside ? p.value(x[i]) : std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

std::vector<Point> draws_of_prior(int count, std::uint64_t seed) {
  std::vector<Point> out;
  for (int c = 0; c < count; ++c) {
    twin::Random random(twin::seed_of(seed, 0x5743, c));
    Point x;
    do {
      x.clear();
      for (const FreeParameter& p : free_parameters()) {
        x.push_back(p.deviation ? p.coordinate(p.median) + *p.deviation * random.normal()
                                : p.coordinate(p.quantile(random.uniform())));
      }
    } while (!std::isfinite(log_prior(values_at(x))));
    out.push_back(std::move(x));
  }
  return out;
}

Point scales() {
  Point out;
  for (const FreeParameter& p : free_parameters()) {
    out.push_back(0.8 * p.deviation.value_or((p.coordinate(p.max) - p.coordinate(p.min)) / 3.5));
  }
  return out;
}

std::vector<Posterior> posteriors(const Chains& chains) {
  std::vector<Posterior> out;
  for (std::size_t i = 0; i < free_parameters().size(); ++i) {
    const FreeParameter& p = free_parameters()[i];
    std::vector<double> all;
    for (const auto& chain : chains.kept) {
      for (const Point& x : chain) all.push_back(p.value(x[i]));
    }
    const Interval v = interval90(std::move(all));
    out.push_back({p.name, v.median, v.low, v.high, chains.r_hat[i], chains.effective[i]});
  }
  return out;
}

}  // namespace

Interval interval90(std::vector<double> values) {
  std::ranges::sort(values);
  const auto quantile = [&](double share) {
    const double at = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const auto above = std::min(below + 1, values.size() - 1);
    return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {quantile(0.05), quantile(0.5), quantile(0.95)};
}

double Ensemble::worst_r_hat() const {
  return std::ranges::max_element(posterior, {}, &Posterior::r_hat)->r_hat;
}

std::string Ensemble::doubt() const {
  constexpr double kAgreement = 1.1;  // Gelman and Rubin, Statistical Science 7 (1992) 457, as it is used
  if (worst_r_hat() <= kAgreement) return "";
  return fmt::format(
      "the Markov chains disagree, largest R-hat {:.2f} where at most {:g} is wanted: these laboratories are "
      "no "
      "sample of the plausible ones yet; calibrate-twin --ensemble with more --evaluations draws better ones",
      worst_r_hat(), kAgreement);
}

double Ensemble::least_effective() const {
  return std::ranges::min_element(posterior, {}, &Posterior::effective)->effective;
}

Ensemble draw_ensemble(const EnsembleRequest& r, const ChainProgress& progress) {
  if (r.laboratories < 1 || r.trials < 1) {
    throw io::InputError("an ensemble needs at least one laboratory, and one trial of each cell");
  }
  const int steps = r.evaluations / std::max(r.chains, 1);
  const ChainPlan plan{steps / 3, steps - steps / 3, r.seed, r.threads, r.stop};
  const auto draws = static_cast<std::int64_t>(plan.kept) * r.chains;
  if (r.laboratories > draws) {
    throw io::InputError(fmt::format("{} evaluations leave {} draws for {} laboratories: ask for more",
                                     r.evaluations, draws, r.laboratories));
  }
  const TwinTable table(1, static_cast<int>(r.table.size()), r.trials, r.seed);
  const auto log_density = [&](std::span<const double> x, double floor) {
    const Point values = values_at(x);
    const double prior = log_prior(values);
    if (!std::isfinite(prior)) return -std::numeric_limits<double>::infinity();
    return prior + table.log_likelihood(with_values(r.base, values), r.table, floor - prior);
  };
  const Chains chains = run_chains(draws_of_prior(r.chains, r.seed), scales(), log_density, plan, progress);
  Ensemble out{r.base, {}, r.seed, r.chains, plan.warm_up, plan.kept, r.trials, chains.acceptance, {}};
  out.posterior = posteriors(chains);
  // Evenly over all chains, one after the other.
  for (int k = 0; k < r.laboratories; ++k) {
    const auto at = static_cast<std::size_t>((2 * k + 1) * draws / (2 * r.laboratories));
    const auto kept = static_cast<std::size_t>(plan.kept);
    const Point values = values_at(chains.kept[at / kept][at % kept]);
    out.values.push_back(values_of(with_values(r.base, values)));
  }
  return out;
}

std::string to_json(const Ensemble& e) {
  Json parameters = Json::array();
  for (std::size_t i = 0; i < free_parameters().size(); ++i) {
    const FreeParameter& p = free_parameters()[i];
    const Posterior& q = e.posterior[i];
    parameters.push_back({{"name", p.name},
                          {"prior",
                           {{"median", p.median},
                            {"deviation", p.deviation ? Json(*p.deviation) : Json(nullptr)},
                            {"of", p.is_log ? "logarithm" : "value"},
                            {"min", p.min},
                            {"max", p.max},
                            {"reason", p.reason}}},
                          {"posterior", {{"median", q.median}, {"low", q.low}, {"high", q.high}}},
                          {"r_hat", q.r_hat},
                          {"effective", q.effective}});
  }
  const Json json = {{"schema", kSchema},
                     {"schema_version", 1},
                     {"written_by", "flexor " FLEXOR_VERSION},
                     {"seed", e.seed},
                     {"chains", e.chains},
                     {"warm_up", e.warm_up},
                     {"kept", e.kept},
                     {"trials", e.trials},
                     {"acceptance", e.acceptance},
                     {"parameters", std::move(parameters)},
                     {"base", Json::parse(twin::to_json(e.base))},
                     {"laboratories", e.values}};
  return io::dump(json);
}

Ensemble ensemble_from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema(kSchema, 1);
  Ensemble out;
  out.base = twin::from_json(reader.member("base").dump(), source + ": base");
  if (!reader.member("seed").is_number_unsigned()) reader.fail("\"seed\" must be a whole number");
  out.seed = reader.member("seed").get<std::uint64_t>();
  constexpr int kMany = 1'000'000'000;
  out.chains = reader.whole_within("chains", 2, kMany);
  out.warm_up = reader.whole_within("warm_up", 0, kMany);
  out.kept = reader.whole_within("kept", 0, kMany);
  out.trials = reader.whole_within("trials", 1, kMany);
  out.acceptance = reader.number_within("acceptance", 0, 1);
  const Json& parameters = reader.member("parameters");
  if (!parameters.is_array() || parameters.size() != free_parameters().size()) {
    reader.fail(fmt::format("\"parameters\" must be the {} free ones", free_parameters().size()));
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    io::JsonReader one(parameters[i], source + ": parameters");
    if (one.text("name") != free_parameters()[i].name) {
      one.fail(fmt::format("\"{}\" is not the free parameter of this place, {}", one.text("name"),
                           free_parameters()[i].name));
    }
    io::JsonReader q(one.member("posterior"), source + ": posterior");
    out.posterior.push_back({one.text("name"), q.number("median"), q.number("low"), q.number("high"),
                             one.number("r_hat"), one.number("effective")});
  }
  const Json& laboratories = reader.member("laboratories");
  if (!laboratories.is_array() || laboratories.empty()) reader.fail("\"laboratories\" must be a list");
  for (const Json& row : laboratories) {
    const bool numbers = row.is_array() && row.size() == parameters.size() &&
                         std::ranges::all_of(row, [](const Json& value) { return value.is_number(); });
    if (!numbers) reader.fail("a laboratory must be one number for each parameter");
    out.values.push_back(row.get<Point>());
    twin::check(with_values(out.base, out.values.back()));
  }
  return out;
}

}  // namespace flexor::study
