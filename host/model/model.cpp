#include "host/model/model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/coefficients.hpp"
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

// The blocks of one channel, in the order of the signal; each may come once, the curve once on either side of
// the lti.
class BlockReader {
 public:
  explicit BlockReader(Channel& channel) : channel_(channel) { seen_.fill(kNever); }

  void read(Reader& block, std::size_t index) {
    const std::string type = block.text("type");
    const std::size_t place = place_of(type);
    require_place(block, type, place);
    seen_[place] = index;
    switch (place) {
      case kDeadZone:
        channel_.dead_zone = DeadZone{block.number("lower"), block.number("upper")};
        break;
      case kHysteresis:
        channel_.hysteresis = Hysteresis{block.numbers("radii"), block.numbers("weights")};
        break;
      case kInputCurve:
        channel_.input_curve = read_curve(block);
        break;
      case kLti:
        channel_.lti = read_lti(block);
        break;
      case kOutputCurve:
        channel_.output_curve = read_curve(block);
        break;
      default:
        channel_.saturation = Saturation{block.number("lower_deg"), block.number("upper_deg")};
    }
    block.done();
  }

  bool complete() const { return seen_[kSaturation] != kNever; }

 private:
  enum Place : std::size_t { kDeadZone, kHysteresis, kInputCurve, kLti, kOutputCurve, kSaturation, kPlaces };
  static constexpr std::array<const char*, kPlaces> kOrder = {"dead_zone", "hysteresis", "curve",
                                                              "lti",       "curve",      "saturation"};
  static constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

  // kPlaces when there is no such block.
  std::size_t place_of(const std::string& type) const {
    if (type == "curve") return seen_[kLti] == kNever ? kInputCurve : kOutputCurve;
    return static_cast<std::size_t>(std::ranges::find(kOrder, type) - kOrder.begin());
  }

  void require_place(const Reader& block, const std::string& type, std::size_t place) const {
    if (place == kPlaces) {
      block.fail(fmt::format("unknown block \"{}\"; known: {}", type, fmt::join(kOrder, ", ")));
    }
    if (seen_[place] != kNever) {
      const char* where = place == kInputCurve    ? " before the \"lti\""
                          : place == kOutputCurve ? " after the \"lti\""
                                                  : "";
      block.fail(fmt::format("a second \"{}\"{}: the first is blocks[{}]; leave one out", type, where,
                             seen_[place]));
    }
    const auto later = seen_.begin() + static_cast<std::ptrdiff_t>(place) + 1;
    if (std::any_of(later, seen_.end(), [](std::size_t i) { return i != kNever; })) {
      block.fail(fmt::format("\"{}\" cannot stand here; the order is {}", type, fmt::join(kOrder, ", ")));
    }
  }

  Channel& channel_;
  std::array<std::size_t, kPlaces> seen_;  // where in the document each block stands
};

void read_blocks(const Json& blocks, const std::string& place, Channel& channel) {
  BlockReader reader(channel);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Reader block(blocks[i], fmt::format("{}: blocks[{}]", place, i));
    reader.read(block, i);
  }
  if (!reader.complete()) {
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

bool within(double value, double limit) { return std::abs(value) <= limit; }  // false for NaN

// Throws for the first rule of the header that a channel breaks.
class Checker {
 public:
  explicit Checker(const Channel& channel) : channel_(channel) {}

  void run(double period_s) const {
    input();
    angles();
    if (channel_.dead_zone) dead_zone(*channel_.dead_zone);
    if (channel_.hysteresis) hysteresis(*channel_.hysteresis);
    if (channel_.input_curve) curve(*channel_.input_curve, "curve");
    lti(channel_.lti, period_s);
    if (channel_.output_curve) curve(*channel_.output_curve, "output curve");
    signals();
  }

  void require(bool good, const char* block, const std::string& rule) const {
    if (!good) throw InputError(fmt::format("channel {}: {}: {}", channel_.name, block, rule));
  }

 private:
  void readings(const std::vector<double>& values, const char* block) const {
    const bool good = std::ranges::all_of(values, [](double v) { return within(v, kMaxReading); });
    require(good, block, fmt::format("every number must be finite, at most {:g} either way", kMaxReading));
  }

  void input() const {
    const double low = channel_.valid_min;
    const double high = channel_.valid_max;
    readings({low, high}, "input");
    require(low < high, "input", "valid_min must be below valid_max");
    const double least =
        std::max(kMinReadingRange, kMinRelativeRange * std::max(std::abs(low), std::abs(high)));
    require(high - low >= least, "input",
            fmt::format("valid_min and valid_max must be at least {:.3g} apart", least));
  }

  void angles() const {
    const auto [lower, upper] = channel_.saturation;
    const std::string rule = fmt::format("must lie within {:g} degrees either way", kMaxAngle_deg);
    require(within(channel_.rest_deg, kMaxAngle_deg), "rest_deg", rule);
    require(within(lower, kMaxAngle_deg) && within(upper, kMaxAngle_deg), "saturation", rule);
    require(lower < upper, "saturation", "lower_deg must be below upper_deg");
  }

  void dead_zone(const DeadZone& zone) const {
    readings({zone.lower, zone.upper}, "dead_zone");
    require(zone.lower <= zone.upper, "dead_zone", "lower must not exceed upper");
  }

  void hysteresis(const Hysteresis& h) const {
    readings(h.radii, "hysteresis");
    require(h.radii.size() == h.weights.size(), "hysteresis", "radii and weights must have as many elements");
    require(h.radii.size() >= 1 && h.radii.size() <= kMaxPlays, "hysteresis", "must have 1 to 4 plays");
    require(std::ranges::all_of(h.radii, [](double r) { return r >= 0; }), "hysteresis",
            "radii must not be negative");
    require(std::ranges::all_of(h.weights, [](double w) { return std::abs(w) < kMaxHysteresisWeight; }),
            "hysteresis", "weights must lie between -8 and 8");
  }

  void curve(const Curve& curve, const char* block) const {
    readings(curve.x, block);
    readings(curve.y, block);
    require(curve.x.size() == curve.y.size(), block, "x and y must have as many elements");
    require(curve.x.size() >= 2 && curve.x.size() <= kMaxKnots, block, "must have 2 to 16 knots");
    const bool increasing = std::ranges::adjacent_find(curve.x, std::greater_equal<>()) == curve.x.end();
    require(increasing, block, "x must be strictly increasing");
    require(curve.x.back() - curve.x.front() >= kMinReadingRange, block,
            fmt::format("x must range over {:g} at least", kMinReadingRange));
    const double least = kMinKnotSpacing * std::max(std::abs(curve.x.front()), std::abs(curve.x.back()));
    for (std::size_t i = 1; i < curve.x.size(); ++i) {
      require(curve.x[i] - curve.x[i - 1] >= least, block,
              fmt::format("the knots at {:.9g} and {:.9g} must be at least {:.3g} apart", curve.x[i - 1],
                          curve.x[i], least));
    }
  }

  void lti(const Lti& lti, double period_s) const {
    require(std::isfinite(lti.gain) && std::isfinite(lti.offset), "lti", "every number must be finite");
    require(lti.poles_rad_s.size() <= compensator::kMaxOrder, "lti", "at most three poles");
    for (const double pole : lti.poles_rad_s) {
      require(pole < 0, "lti", "poles must be negative (stable)");
      const double speed = -pole * period_s;
      require(speed >= kMinPoleTimesPeriod && speed <= kMaxPoleTimesPeriod, "lti",
              fmt::format("the pole at {:.6g} rad/s must lie between {:.3g} and {:.3g} at this sample period",
                          pole, -kMinPoleTimesPeriod / period_s, -kMaxPoleTimesPeriod / period_s));
    }
    require(lti.taps.empty() || lti.taps.size() == lti.poles_rad_s.size(), "lti",
            "taps must be empty or one for each pole");
    require(std::ranges::all_of(lti.taps, [](double tap) { return within(tap, kMaxTap); }), "lti",
            fmt::format("taps must lie between -{0:g} and {0:g}", kMaxTap));
  }

  // What the blocks make of the readings, in degrees where the unit is known.
  void signals() const {
    const detail::Interval scaled = detail::after_gain(channel_);
    const double reach = scaled.magnitude();
    if (channel_.output_curve) {
      const auto [low, high] = std::ranges::minmax(channel_.output_curve->y);
      require(within(low, kMaxAngle_deg) && within(high, kMaxAngle_deg), "output curve",
              fmt::format("y must lie within {:g} degrees either way", kMaxAngle_deg));
      require(within(reach, kMaxReading) && within(channel_.lti.offset, kMaxReading), "lti",
              fmt::format("gain and offset take its signal to {:.3g}; at most {:g} can be meant", reach,
                          kMaxReading));
      return;
    }
    if (channel_.input_curve) {
      require(
          within(reach, kMaxAngle_deg), "curve",
          fmt::format("with gain and offset its values mean {:.6g} to {:.6g} degrees; at most {:g} either "
                      "way can be meant",
                      scaled.min, scaled.max, kMaxAngle_deg));
    }
    require(within(reach, kMaxLinear_deg) && within(channel_.lti.offset, kMaxLinear_deg), "lti",
            fmt::format("gain and offset take valid readings to {:.3g} degrees; at most {:g} can be meant",
                        reach, kMaxLinear_deg));
  }

  const Channel& channel_;
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
  if (!(model.sample_period_s >= kMinPeriod_s && model.sample_period_s <= kMaxPeriod_s)) {
    throw InputError(fmt::format("sample_period_s ({:g}) must be positive, between {:g} and {:g} s",
                                 model.sample_period_s, kMinPeriod_s, kMaxPeriod_s));
  }
  if (!(model.max_gap_s >= 0) || !std::isfinite(model.max_gap_s)) {
    throw InputError("max_gap_s must be a number of seconds, not negative");
  }
  if (model.channels.empty()) throw InputError("a model needs at least one channel");
  std::set<std::string> names;
  for (const Channel& channel : model.channels) {
    const Checker checker(channel);
    checker.require(names.insert(finger(channel.name)).second, "name", "occurs twice");
    checker.run(model.sample_period_s);
  }
}

std::string to_json(const Model& model) {
  Json channels = Json::array();
  for (const Channel& channel : model.channels) channels.push_back(channel_json(channel));
  Json json = {
      {"schema", kSchema},  {"schema_version", kSchemaVersion}, {"written_by", model.written_by},
      {"name", model.name}, {"description", model.description}, {"sample_period_s", model.sample_period_s}};
  if (model.max_gap_s > 0) json["max_gap_s"] = model.max_gap_s;
  json["channels"] = std::move(channels);
  json["training"] = model.training;
  json["fit"] = model.fit;
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
  model.max_gap_s = reader.number_or("max_gap_s", 0);
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
