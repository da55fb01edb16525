#include "host/study/exact_json.hpp"

#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

deploy::Sensor sensor_of(const Json& json) {
  deploy::Sensor out = {json.at("counts").get<std::vector<double>>(),
                        json.at("value").get<std::vector<double>>()};
  if (out.counts.size() < 2 || out.counts.size() != out.value.size())
    throw io::InputError("pipe: a sensor without its points");
  return out;
}

Json exact_json(const CycleStatistic& c) { return {{"count", c.count}, {"sum", c.sum}, {"worst", c.worst}}; }

CycleStatistic cycles_of(const Json& json) {
  return {json.at("count").get<std::uint64_t>(), json.at("sum").get<std::uint64_t>(),
          json.at("worst").get<std::uint64_t>()};
}

}  // namespace

Json exact_json(const deploy::Glove& g) {
  Json sensors = Json::array();
  for (const deploy::Sensor& sensor : g.sensor)
    sensors.push_back({{"counts", sensor.counts}, {"value", sensor.value}});
  return {{"model", Json::parse(model::to_json(g.model))},
          {"sensors", std::move(sensors)},
          {"output", static_cast<int>(g.output)},
          {"baud", g.baud},
          {"frame_rate_hz", g.frame_rate_hz},
          {"key", g.key ? Json(deploy::to_hex(*g.key)) : Json(nullptr)},
          {"pins", deploy::to_text(g.pins)},
          {"beta", g.encoding == deploy::Encoding::beta},
          {"right_hand", g.right_hand},
          {"track", g.track}};
}

deploy::Glove glove_of(const Json& json) {
  deploy::Glove g;
  g.model = model::from_json(json.at("model").dump(), "pipe");
  for (std::size_t i = 0; i < kFingers; ++i) g.sensor[i] = sensor_of(json.at("sensors").at(i));
  g.output = static_cast<deploy::Output>(json.at("output").get<int>());
  g.baud = json.at("baud").get<double>();
  g.frame_rate_hz = json.at("frame_rate_hz").get<double>();
  if (!json.at("key").is_null()) g.key = deploy::key_from_hex(json.at("key").get<std::string>());
  g.pins = deploy::pins_from_text(json.at("pins").get<std::string>());
  g.encoding = json.at("beta").get<bool>() ? deploy::Encoding::beta : deploy::Encoding::alpha;
  g.right_hand = json.at("right_hand").get<bool>();
  g.track = json.at("track").get<bool>();
  return g;
}

Json exact_json(const GloveFigures& f) {
  return {{"samples", f.samples},         {"frames", f.frames},          {"angles", f.angles},
          {"mismatches", f.mismatches},   {"step", exact_json(f.step)},  {"sample", exact_json(f.sample)},
          {"stack_bytes", f.stack_bytes}, {"awake_share", f.awake_share}};
}

GloveFigures glove_figures_of(const Json& json) {
  GloveFigures f;
  f.samples = json.at("samples").get<std::size_t>();
  f.frames = json.at("frames").get<std::size_t>();
  f.angles = json.at("angles").get<std::size_t>();
  f.mismatches = json.at("mismatches").get<std::size_t>();
  f.step = cycles_of(json.at("step"));
  f.sample = cycles_of(json.at("sample"));
  f.stack_bytes = json.at("stack_bytes").get<int>();
  f.awake_share = json.at("awake_share").get<double>();
  return f;
}

Json exact_json(const HandFigures& f) {
  return {{"tick", exact_json(f.tick)}, {"stack_bytes", f.stack_bytes}, {"awake_share", f.awake_share}};
}

HandFigures hand_figures_of(const Json& json) {
  return {cycles_of(json.at("tick")), json.at("stack_bytes").get<int>(),
          json.at("awake_share").get<double>()};
}

}  // namespace flexor::study
