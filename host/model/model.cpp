#include "host/model/model.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/model/channel.hpp"

namespace flexor::model {
namespace {

using io::InputError;
using Reader = io::JsonReader;

constexpr const char* kSchema = "flexor-model";

std::string place_of(const Block& block) { return fmt::format("{}: {}", block.to, type_of(block.kind)); }

void check_name(const std::string& name, const std::string& what) {
  if (!is_name(name)) {
    throw InputError("{} {} needs a name of 1 to {} characters without line breaks", what,
                     Json(io::to_utf8(name)).dump(), kMaxName);
  }
}

void check_poses(const Place& place, const Input& input, const std::optional<Poses>& poses,
                 const char* name) {
  if (!poses) return;
  const auto& [open, fist] = *poses;
  const double low = std::min(open, fist);
  const double high = std::max(open, fist);
  place.require(low < high && low >= input.valid_min && high <= input.valid_max,
                fmt::format("{}: \"open\" and \"fist\" must be two readings within the valid range", name));
}

void check_readings(const Place& place, const Spread& spread) {
  const auto& [share, reading] = spread;
  place.require(share.size() >= 2 && share.size() == reading.size() && share.size() <= kMaxKnots,
                fmt::format("readings: 2 to {} shares, and as many readings", kMaxKnots));
  place.readings(reading);
  const bool rising = std::ranges::is_sorted(reading) && reading.back() > reading.front();
  const bool shares =
      share.front() > 0 && share.back() < 1 && std::ranges::is_sorted(share, std::ranges::less_equal());
  place.require(rising && shares, "readings: \"share\" must increase between 0 and 1, \"reading\" with it");
}

void check_input(const Input& input) {
  check_name(input.name, "input");
  const Place place{fmt::format("{}: input", input.name), 0};
  place.readings({{input.valid_min, input.valid_max}});
  if (!input.strip.empty()) {
    place.require(std::ranges::find(finger_names(), input.strip) != finger_names().end(),
                  fmt::format("unknown strip \"{}\"; known: {}", io::to_utf8(input.strip),
                              fmt::join(finger_names(), ", ")));
  }
  place.require(input.valid_min < input.valid_max, "valid_min must be below valid_max");
  const double least =
      std::max(kMinRange, kMinRelativeRange * std::max(std::abs(input.valid_min), std::abs(input.valid_max)));
  place.require(input.valid_max - input.valid_min >= least,
                fmt::format("valid_min and valid_max must be at least {:.3g} apart", least));
  check_poses(place, input, input.poses, "poses");
  check_poses(place, input, input.turns, "turns");
  if (input.readings) check_readings(place, *input.readings);
}

void check_accuracy(const Place& place, const Accuracy& accuracy) {
  const auto& [angle, error] = accuracy;
  place.require(!angle.empty() && angle.size() == error.size() && angle.size() <= kMaxKnots,
                fmt::format("accuracy: 1 to {} angles, and as many standard errors", kMaxKnots));
  for (std::size_t i = 0; i < angle.size(); ++i) {
    place.require(std::abs(angle[i]) <= kMaxAngle_deg && (i == 0 || angle[i] > angle[i - 1]),
                  "accuracy: angle_deg must be increasing angles");
    place.require(error[i] > 0 && error[i] <= kMaxAngle_deg,
                  "accuracy: standard_error_deg must be above zero degrees");
  }
}

void check_joints(const Model& model) {
  std::set<std::string> names;
  for (const Joint& joint : model.joints) {
    const Place place{fmt::format("{}: joint", joint.name), 0};
    place.require(joint_name(joint.name) == joint.name,
                  "its name has another form: " + joint_name(joint.name));
    place.require(names.insert(joint.name).second, "occurs twice");
    place.require(std::abs(joint.rest_deg) <= kMaxAngle_deg,
                  fmt::format("rest_deg must lie within {:g} degrees either way", kMaxAngle_deg));
    if (joint.accuracy) check_accuracy(place, *joint.accuracy);
    if (!joint.ends) continue;
    place.require(std::max(std::abs(joint.ends->open_deg), std::abs(joint.ends->fist_deg)) <= kMaxAngle_deg &&
                      std::abs(joint.ends->fist_deg - joint.ends->open_deg) >= kLeastEnds_deg,
                  fmt::format("its ends, open_deg and fist_deg, must lie {:g} degree or more apart, within "
                              "{:g} degrees either way",
                              kLeastEnds_deg, kMaxAngle_deg));
  }
}

void check_period(const Model& model) {
  if (!(model.sample_period_s >= kMinPeriod_s && model.sample_period_s <= kMaxPeriod_s)) {
    throw InputError("sample_period_s ({:g}) must be positive, between {:g} and {:g} s",
                     model.sample_period_s, kMinPeriod_s, kMaxPeriod_s);
  }
  if (!(model.max_gap_s >= 0) || !std::isfinite(model.max_gap_s)) {
    throw InputError("max_gap_s must be a number of seconds, not negative");
  }
}

// What the blocks make of all valid readings.
void check_signals(const Model& model, const Graph& graph) {
  for (std::size_t b = 0; b < model.blocks.size(); ++b) {
    const Block& block = model.blocks[b];
    const Place place{place_of(block), model.sample_period_s};
    const Interval& values = graph.values[model.inputs.size() + b];
    // A saturation hides what comes in: the number of its input is named instead.
    if (!std::holds_alternative<Saturation>(block.kind)) {
      place.require(values.magnitude() <= kMaxSignal,
                    fmt::format("takes valid readings to {:.3g}; at most {:g} can be meant",
                                values.magnitude(), kMaxSignal));
      continue;
    }
    const double in = graph.values[graph.from[b].front()].magnitude();
    place.require(
        in <= kMaxUnlimited_deg,
        fmt::format("the signal before it takes valid readings to {:.3g} degrees; at most {:g} can be meant",
                    in, kMaxUnlimited_deg));
  }
}

// What commands read of these two; the rest is for people.
void check_provenance(const Model& model, const std::string& source) {
  Reader training(model.training, source + ": training");
  (void)training.text_or_empty("output_column");
  Reader fit(model.fit, source + ": fit");
  const auto check_error = [&](const Json& one, const std::string& place) {
    const Json figures = Reader(one, place).object_or_empty("holdout");
    Reader holdout(figures, place + ": holdout");
    if (holdout.has("rmse_deg") && !figures.at("rmse_deg").is_null())
      (void)holdout.number_within("rmse_deg", 0, kMaxUnlimited_deg);
  };
  check_error(model.fit, source + ": fit");
  const Json joints = fit.object_or_empty("joints");
  for (const auto& [name, one] : joints.items())
    check_error(one, fmt::format("{}: fit: joints: {}", source, name));
}

// The blocks before a joint as a tree, the joint at its root: what each takes stands indented below it. A signal
// that was shown before is only named.
class Diagram {
 public:
  explicit Diagram(const Model& m) : model_(m), graph_(m), shown_(graph_.values.size(), false) {}

  std::string text() {
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      out_ += fmt::format("\n{}, rests at {:.1f} deg\n", model_.joints[j].name, model_.joints[j].rest_deg);
      branch(graph_.joint[j], "", true);
    }
    return std::move(out_);
  }

 private:
  void branch(std::size_t signal, const std::string& indent, bool last) {
    const std::string stem = indent + (last ? "└─ " : "├─ ");
    if (signal < model_.inputs.size()) return leaf(stem, model_.inputs[signal]);
    const std::size_t b = signal - model_.inputs.size();
    const Block& block = model_.blocks[b];
    out_ += shown_[signal] ? fmt::format("{}{} (above)\n", stem, block.to)
                           : fmt::format("{}{}: {}\n", stem, type_of(block.kind), text_of(block.kind));
    if (shown_[signal]) return;
    shown_[signal] = true;
    for (const std::size_t from : graph_.from[b])
      branch(from, indent + (last ? "   " : "│  "), from == graph_.from[b].back());
  }

  void leaf(const std::string& stem, const Input& input) {
    out_ += fmt::format(
        "{}{}{}, valid {:g} to {:g}\n", stem, input.column.empty() ? input.name : input.column,
        input.unit.empty() ? "" : fmt::format(" ({})", input.unit), input.valid_min, input.valid_max);
  }

  const Model& model_;
  Graph graph_;
  std::vector<bool> shown_;
  std::string out_;
};

}  // namespace

double Accuracy::at(double angle) const { return io::interpolate(angle_deg, standard_error_deg, angle); }

double Accuracy::root_mean_square() const {
  double square = 0;
  for (const double e : standard_error_deg) square += e * e / static_cast<double>(standard_error_deg.size());
  return std::sqrt(square);
}

const std::vector<std::string>& finger_names() {
  static const std::vector<std::string> names = {"thumb", "index", "middle", "ring", "pinky"};
  return names;
}

std::string finger(std::string_view name) {
  if (name == "pointer") return "index";
  if (name == "little") return "pinky";
  const auto& names = finger_names();
  if (std::ranges::find(names, name) != names.end()) return std::string(name);
  throw InputError("unknown finger \"{}\"; known: {}", name, fmt::join(names, ", "));
}

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxName &&
         std::ranges::all_of(name, [](char c) { return static_cast<unsigned char>(c) >= ' ' && c != 127; });
}

std::string joint_name(std::string_view name) {
  const bool good = !name.empty() && name.size() <= kMaxName && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
  if (!good) {
    throw InputError(
        "a joint cannot be called \"{}\": letters, digits and underscores, as index or index_mcp",
        io::to_utf8(name));
  }
  const auto end = name.find('_');
  const std::string_view first = name.substr(0, end);
  const std::string rest(end == std::string_view::npos ? "" : name.substr(end));
  if (first == "pointer") return "index" + rest;
  if (first == "little") return "pinky" + rest;
  return std::string(name);
}

std::vector<std::string> columns_of(const Model& model, const std::vector<std::string>& given) {
  if (!given.empty() && given.size() != model.inputs.size()) {
    throw InputError("the model has {} input(s), {} --input given; name one for each, in order",
                     model.inputs.size(), given.size());
  }
  if (!given.empty()) return given;
  std::vector<std::string> out;
  for (const Input& input : model.inputs) out.push_back(input.column.empty() ? input.name : input.column);
  return out;
}

Graph::Graph(const Model& model) {
  std::map<std::string, std::size_t> signals;
  const auto name = [&](const std::string& signal, const std::string& what) {
    check_name(signal, what);
    if (!signals.emplace(signal, signals.size()).second) {
      throw InputError("{}: two signals have this name; rename one", signal);
    }
  };
  const auto find = [&](const std::string& signal, const std::string& where) {
    const auto it = signals.find(signal);
    if (it != signals.end()) return it->second;
    throw InputError("{}: no signal \"{}\" comes before it", where, signal);
  };
  for (const Input& input : model.inputs) {
    name(input.name, "input");
    inputs.push_back({inputs.size()});
    values.push_back({input.valid_min, input.valid_max});
  }
  for (const Block& block : model.blocks) {
    const std::size_t wanted = inputs_of(block.kind);
    if (block.from.size() != wanted || wanted == 0 || wanted > kMaxTerms) {
      throw InputError("{}: takes 1 to {} signals, a weight for each; \"from\" has {}", place_of(block),
                       std::holds_alternative<Sum>(block.kind) ? kMaxTerms : 1, block.from.size());
    }
    std::vector<std::size_t> taken;
    std::set<std::size_t> sensors;
    std::vector<Interval> in;
    for (const std::string& signal : block.from) {
      taken.push_back(find(signal, place_of(block)));
      sensors.insert(inputs[taken.back()].begin(), inputs[taken.back()].end());
      in.push_back(values[taken.back()]);
    }
    from.push_back(std::move(taken));
    inputs.emplace_back(sensors.begin(), sensors.end());
    std::visit([&](const auto& kind) { kind.check({place_of(block), model.sample_period_s}); }, block.kind);
    values.push_back(
        std::visit([&](const auto& kind) { return kind.values(in, model.sample_period_s); }, block.kind));
    name(block.to, "block");
  }
  for (const Joint& one : model.joints) {
    const std::size_t at = find(one.from, fmt::format("{}: joint", one.name));
    if (at < model.inputs.size() ||
        !std::holds_alternative<Saturation>(model.blocks[at - model.inputs.size()].kind)) {
      throw InputError("{}: joint: must come from a saturation; an angle needs limits", one.name);
    }
    joint.push_back(at);
  }
}

std::vector<bool> Graph::needed_for(const std::vector<std::size_t>& signals) const {
  std::vector<bool> out(values.size());
  for (const std::size_t signal : signals) out[signal] = true;
  for (std::size_t b = from.size(); b-- > 0;) {
    if (!out[values.size() - from.size() + b]) continue;
    for (const std::size_t taken : from[b]) out[taken] = true;
  }
  return out;
}

const Saturation& limits(const Model& model, const Joint& joint) {
  return std::get<Saturation>(std::ranges::find(model.blocks, joint.from, &Block::to)->kind);
}

Ends ends(const Model& model, const Joint& joint) {
  if (joint.ends) return *joint.ends;
  const Saturation& limit = limits(model, joint);
  const double open_deg = std::clamp(0.0, limit.lower_deg, limit.upper_deg);
  const bool rises = limit.upper_deg - open_deg >= open_deg - limit.lower_deg;
  return {open_deg, rises ? limit.upper_deg : limit.lower_deg};
}

void check(const Model& model) {
  check_period(model);
  if (model.joints.empty()) throw InputError("a model needs at least one joint");
  if (model.inputs.empty()) throw InputError("a model needs at least one input");
  const auto at_most = [](std::size_t count, const char* what) {
    if (count > kMaxBlocks) {
      throw InputError("a model of {} {}: at most {} can be meant", count, what, kMaxBlocks);
    }
  };
  at_most(model.inputs.size(), "inputs");
  at_most(model.blocks.size(), "blocks");
  at_most(model.joints.size(), "joints");
  for (const Input& input : model.inputs) check_input(input);
  check_joints(model);
  check_signals(model, Graph(model));
}

std::string to_json(const Model& model) {
  Json json = {{"schema", kSchema}, {"schema_version", kSchemaVersion}};
  write_object(model, json);
  if (model.max_gap_s == 0) json.erase("max_gap_s");
  return io::dump(json);
}

std::string schema_json() {
  Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", "Model document of Flexor"}};
  out.update(
      object_schema({{"schema", {{"const", kSchema}}}, {"schema_version", {{"const", kSchemaVersion}}}}));
  add_schema_of(Model(), out);
  Json fingers = {""};
  for (const std::string& name : finger_names()) fingers.push_back(name);
  out["properties"]["inputs"]["items"]["properties"]["strip"]["enum"] = fingers;
  return io::dump(out);
}

std::string diagram(const Model& m) {
  std::string out = fmt::format(
      "{}: {}\n{:g} ms a sample, {} input(s), {} block(s), {} joint(s), schema {}, written by {}\n",
      io::one_line(m.name), io::one_line(m.description), 1000 * m.sample_period_s, m.inputs.size(),
      m.blocks.size(), m.joints.size(), kSchemaVersion, io::one_line(m.written_by));
  out += Diagram(m).text();
  const auto joints = m.fit.value("joints", Json::object());
  for (const auto& [joint, fit] : joints.items()) {
    const auto rmse_deg = fit.value(Json::json_pointer("/holdout/rmse_deg"), Json());
    if (!rmse_deg.is_number()) continue;
    out += fmt::format("\nheld-out error of {} {:.2f} deg RMSE when it was fitted{}\n", io::one_line(joint),
                       rmse_deg.get<double>(),
                       fit.contains("untried_structures") ? ", by a search that was stopped" : "");
  }
  return out;
}

Model from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  Reader reader(json, source);
  reader.schema(kSchema, kSchemaVersion);
  if (reader.number("schema_version") == 1)
    reader.fail("has schema version 1, with \"channels\", which is no longer read: identify it again");
  Model model;
  read_object(reader, model);
  reader.done();
  check_provenance(model, source);
  try {
    for (Joint& joint : model.joints) joint.name = joint_name(joint.name);
    check(model);
  } catch (const InputError& error) {
    throw InputError("{}: {}", source, error.what());
  }
  return model;
}

Model load(const std::filesystem::path& path) { return from_json(io::read_document(path), path.string()); }

void save(const Model& model, const std::filesystem::path& path) {
  check(model);
  io::write_file(path, to_json(model));
}

}  // namespace flexor::model
