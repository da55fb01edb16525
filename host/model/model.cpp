#include "host/model/model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "runtime/compensator/lti.hpp"

namespace flexor::model {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;
using Reader = io::JsonReader;

constexpr const char* kSchema = "flexor-model";
constexpr double kMaxHysteresisWeight = 8;

Curve read_curve(Reader& block) { return {block.numbers("x"), block.numbers("y")}; }

Lti read_lti(Reader& block) {
  return {block.number_or("gain", 1), block.number_or("offset", 0), block.numbers("poles_rad_s"),
          block.numbers_or_empty("taps")};
}

// Blocks come in the order of the signal; each may come once, the curve once on either side of the lti.
void read_blocks(const Json& blocks, const std::string& place, Channel& channel) {
  const std::vector<std::string> order = {"dead_zone", "hysteresis", "curve", "lti", "curve", "saturation"};
  std::size_t next = 0;
  bool lti_seen = false;
  bool saturation_seen = false;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Reader block(blocks[i], fmt::format("{}: blocks[{}]", place, i));
    const std::string type = block.text("type");
    const auto at = std::find(order.begin() + static_cast<std::ptrdiff_t>(next), order.end(), type);
    if (at == order.end()) {
      block.fail(fmt::format("\"{}\" cannot stand here; the order is {}", type, fmt::join(order, ", ")));
    }
    next = static_cast<std::size_t>(at - order.begin()) + 1;
    if (type == "dead_zone") channel.dead_zone = DeadZone{block.number("lower"), block.number("upper")};
    if (type == "hysteresis")
      channel.hysteresis = Hysteresis{block.numbers("radii"), block.numbers("weights")};
    if (type == "curve") (lti_seen ? channel.output_curve : channel.input_curve) = read_curve(block);
    if (type == "lti") {
      channel.lti = read_lti(block);
      lti_seen = true;
    }
    if (type == "saturation") {
      channel.saturation = Saturation{block.number("lower_deg"), block.number("upper_deg")};
      saturation_seen = true;
    }
    if (type == "curve" && !lti_seen) next = 3;
    block.done();
  }
  if (!saturation_seen) {
    throw InputError(fmt::format("{}: blocks must end with a saturation; an output needs limits", place));
  }
}

Channel read_channel(const Json& json, const std::string& place) {
  Reader reader(json, place);
  Channel channel;
  channel.name = finger(reader.text("name"));
  Reader input(reader.member("input"), fmt::format("{}: input", place));
  channel.input_column = input.text_or_empty("column");
  channel.input_unit = input.text_or_empty("unit");
  channel.valid_min = input.number("valid_min");
  channel.valid_max = input.number("valid_max");
  input.done();
  channel.rest_deg = reader.number("rest_deg");
  read_blocks(reader.list("blocks"), place, channel);
  reader.done();
  return channel;
}

Json curve_json(const Curve& curve) { return {{"type", "curve"}, {"x", curve.x}, {"y", curve.y}}; }

Json channel_json(const Channel& channel) {
  Json blocks = Json::array();
  if (channel.dead_zone) {
    blocks.push_back(
        {{"type", "dead_zone"}, {"lower", channel.dead_zone->lower}, {"upper", channel.dead_zone->upper}});
  }
  if (channel.hysteresis) {
    blocks.push_back({{"type", "hysteresis"},
                      {"radii", channel.hysteresis->radii},
                      {"weights", channel.hysteresis->weights}});
  }
  if (channel.input_curve) blocks.push_back(curve_json(*channel.input_curve));
  const Lti& lti = channel.lti;
  blocks.push_back({{"type", "lti"},
                    {"gain", lti.gain},
                    {"offset", lti.offset},
                    {"poles_rad_s", lti.poles_rad_s},
                    {"taps", lti.taps}});
  if (channel.output_curve) blocks.push_back(curve_json(*channel.output_curve));
  blocks.push_back({{"type", "saturation"},
                    {"lower_deg", channel.saturation.lower_deg},
                    {"upper_deg", channel.saturation.upper_deg}});
  return {{"name", channel.name},
          {"input",
           {{"column", channel.input_column},
            {"unit", channel.input_unit},
            {"valid_min", channel.valid_min},
            {"valid_max", channel.valid_max}}},
          {"rest_deg", channel.rest_deg},
          {"blocks", std::move(blocks)}};
}

class Checker {
 public:
  explicit Checker(const std::string& channel) : channel_(channel) {}

  void require(bool good, const char* block, const char* rule) const {
    if (!good) throw InputError(fmt::format("channel {}: {}: {}", channel_, block, rule));
  }

  void finite(const std::vector<double>& values, const char* block) const {
    require(std::ranges::all_of(values, [](double v) { return std::isfinite(v); }), block,
            "every number must be finite");
  }

  void curve(const Curve& curve, const char* block) const {
    finite(curve.x, block);
    finite(curve.y, block);
    require(curve.x.size() == curve.y.size(), block, "x and y must have as many elements");
    require(curve.x.size() >= 2 && curve.x.size() <= kMaxKnots, block, "must have 2 to 16 knots");
    const bool increasing = std::ranges::adjacent_find(curve.x, std::greater_equal<>()) == curve.x.end();
    require(increasing, block, "x must be strictly increasing");
  }

  void hysteresis(const Hysteresis& h) const {
    finite(h.radii, "hysteresis");
    finite(h.weights, "hysteresis");
    require(h.radii.size() == h.weights.size(), "hysteresis", "radii and weights must have as many elements");
    require(h.radii.size() >= 1 && h.radii.size() <= kMaxPlays, "hysteresis", "must have 1 to 4 plays");
    require(std::ranges::all_of(h.radii, [](double r) { return r >= 0; }), "hysteresis",
            "radii must not be negative");
    require(std::ranges::all_of(h.weights, [](double w) { return std::abs(w) < kMaxHysteresisWeight; }),
            "hysteresis", "weights must lie between -8 and 8");
  }

  void lti(const Lti& lti) const {
    finite({lti.gain, lti.offset}, "lti");
    finite(lti.poles_rad_s, "lti");
    finite(lti.taps, "lti");
    require(lti.poles_rad_s.size() <= compensator::kMaxOrder, "lti", "at most three poles");
    require(std::ranges::all_of(lti.poles_rad_s, [](double p) { return p < 0; }), "lti",
            "poles must be negative (stable)");
    require(lti.taps.empty() || lti.taps.size() == lti.poles_rad_s.size(), "lti",
            "taps must be empty or one for each pole");
  }

 private:
  const std::string& channel_;
};

}  // namespace

const std::vector<std::string>& finger_names() {
  static const std::vector<std::string> names = {"thumb", "index", "middle", "ring", "pinky"};
  return names;
}

std::string finger(std::string_view name) {
  if (name == "pointer") return "index";
  if (name == "little") return "pinky";
  const auto& names = finger_names();
  if (std::ranges::find(names, name) != names.end()) return std::string(name);
  throw InputError(fmt::format("unknown finger \"{}\"; known: {}", name, fmt::join(names, ", ")));
}

void check(const Model& model) {
  if (!(model.sample_period_s > 0) || !std::isfinite(model.sample_period_s)) {
    throw InputError("sample_period_s must be positive");
  }
  if (model.channels.empty()) throw InputError("a model needs at least one channel");
  std::set<std::string> names;
  for (const Channel& c : model.channels) {
    const Checker checker(c.name);
    checker.require(names.insert(finger(c.name)).second, "name", "occurs twice");
    checker.finite({c.valid_min, c.valid_max, c.rest_deg}, "input");
    checker.require(c.valid_min < c.valid_max, "input", "valid_min must be below valid_max");
    if (c.dead_zone) {
      checker.finite({c.dead_zone->lower, c.dead_zone->upper}, "dead_zone");
      checker.require(c.dead_zone->lower <= c.dead_zone->upper, "dead_zone", "lower must not exceed upper");
    }
    if (c.hysteresis) checker.hysteresis(*c.hysteresis);
    if (c.input_curve) checker.curve(*c.input_curve, "curve");
    checker.lti(c.lti);
    if (c.output_curve) checker.curve(*c.output_curve, "output curve");
    checker.finite({c.saturation.lower_deg, c.saturation.upper_deg}, "saturation");
    checker.require(c.saturation.lower_deg < c.saturation.upper_deg, "saturation",
                    "lower_deg must be below upper_deg");
  }
}

std::string to_json(const Model& model) {
  Json channels = Json::array();
  for (const Channel& channel : model.channels) channels.push_back(channel_json(channel));
  const Json json = {{"schema", kSchema},
                     {"schema_version", kSchemaVersion},
                     {"written_by", model.written_by},
                     {"name", model.name},
                     {"description", model.description},
                     {"sample_period_s", model.sample_period_s},
                     {"channels", std::move(channels)},
                     {"training", model.training},
                     {"fit", model.fit}};
  return io::dump(json);
}

Model from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  Reader reader(json, source);
  if (!reader.has("schema") || reader.text("schema") != kSchema) {
    reader.fail(fmt::format("not a model: \"schema\" must be \"{}\"", kSchema));
  }
  const double version = reader.number("schema_version");
  if (version > kSchemaVersion) {
    reader.fail(fmt::format("has schema version {}, this program reads up to {}; update Flexor", version,
                            kSchemaVersion));
  }
  if (version != kSchemaVersion) reader.fail(fmt::format("has no known schema version ({})", version));
  Model model;
  model.written_by = reader.text_or_empty("written_by");
  model.name = reader.text_or_empty("name");
  model.description = reader.text_or_empty("description");
  model.sample_period_s = reader.number("sample_period_s");
  const Json& channels = reader.list("channels");
  for (std::size_t i = 0; i < channels.size(); ++i) {
    model.channels.push_back(read_channel(channels[i], fmt::format("{}: channels[{}]", source, i)));
  }
  model.training = reader.object_or_empty("training");
  model.fit = reader.object_or_empty("fit");
  reader.done();
  try {
    check(model);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", source, error.what()));
  }
  return model;
}

Model load(const std::filesystem::path& path) { return from_json(io::read_file(path), path.string()); }

void save(const Model& model, const std::filesystem::path& path) {
  check(model);
  io::write_file(path, to_json(model));
}

}  // namespace flexor::model
