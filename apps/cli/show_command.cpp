#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <memory>

#include "apps/cli/commands.hpp"
#include "host/model/model.hpp"

namespace flexor::cli {
namespace {

using nlohmann::literals::operator""_json_pointer;

struct Options {
  std::string model;
  bool json = false;
};

std::string curve_text(const model::Curve& c) {
  std::string text;
  for (std::size_t i = 0; i < c.x.size(); ++i)
    text += fmt::format("{}{:.4g}->{:.4g}", i ? "  " : "", c.x[i], c.y[i]);
  return text;
}

void show_channel(const model::Channel& c) {
  print(fmt::format("\n{}  from {} ({}), valid {:g} to {:g}, rests at {:.1f} deg\n", c.name,
                    c.input_column.empty() ? "its own column" : c.input_column, c.input_unit, c.valid_min,
                    c.valid_max, c.rest_deg));
  if (c.dead_zone)
    print(fmt::format("  dead zone    {:g} to {:g}\n", c.dead_zone->lower, c.dead_zone->upper));
  if (c.hysteresis) {
    print(fmt::format("  hysteresis   radii {::.3g}, weights {::.3g}\n", c.hysteresis->radii,
                      c.hysteresis->weights));
  }
  if (c.input_curve) print(fmt::format("  curve        {}\n", curve_text(*c.input_curve)));
  const model::Lti& lti = c.lti;
  print(fmt::format("  lti          gain {:.4g}, offset {:.4g}", lti.gain, lti.offset));
  if (!lti.poles_rad_s.empty()) {
    std::vector<double> constants_ms;
    for (const double p : lti.poles_rad_s) constants_ms.push_back(-1000 / p);
    print(fmt::format(", poles {::.4g} rad/s (time constants {::.3g} ms)", lti.poles_rad_s, constants_ms));
    if (!lti.taps.empty()) print(fmt::format(", taps {::.3g}", lti.taps));
  }
  print("\n");
  if (c.output_curve) print(fmt::format("  curve        {}\n", curve_text(*c.output_curve)));
  print(fmt::format("  saturation   {:.1f} to {:.1f} deg\n", c.saturation.lower_deg, c.saturation.upper_deg));
}

void run(const Options& o) {
  const model::Model m = model::load(o.model);
  if (o.json) {
    print(model::to_json(m));
    return;
  }
  print(fmt::format("{}: {}\n{:g} ms a sample, {} channel(s), schema {}, written by {}\n", m.name,
                    m.description, 1000 * m.sample_period_s, m.channels.size(), model::kSchemaVersion,
                    m.written_by));
  for (const model::Channel& c : m.channels) show_channel(c);
  const auto error_deg = m.fit.value("/holdout/rmse_deg"_json_pointer, nlohmann::ordered_json());
  if (error_deg.is_number()) {
    print(fmt::format("\nheld-out error {:.2f} deg RMSE when it was fitted\n", error_deg.get<double>()));
  }
}

}  // namespace

void add_show(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("show", "Show a model document: blocks, poles, limits");
  command->add_option("model", o->model, "model document")->required();
  command->add_flag("--json", o->json, "the document itself, checked");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
