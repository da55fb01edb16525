#include "host/posture/posture.hpp"

#include <algorithm>

#include "host/io/json.hpp"
#include "host/io/numbers.hpp"

namespace flexor::posture {
namespace {

using nlohmann::ordered_json;

constexpr double kWidest_deg = 720;

Hand read_hand(io::JsonReader& reader, const char* key, double low, double high) {
  const std::vector<double> values = reader.numbers_within(key, low, high);
  if (values.size() != kJoints) reader.fail(fmt::format("\"{}\" must hold {} numbers", key, kJoints));
  return Eigen::Map<const Hand>(values.data());
}

Codebook read_cells(io::JsonReader& reader) {
  const ordered_json& cells = reader.list("cells");
  Codebook book;
  book.centre_deg.resize(static_cast<Eigen::Index>(cells.size()), kJoints);
  book.seconds.resize(static_cast<Eigen::Index>(cells.size()));
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const ordered_json object = {{"cell", cells[c]}};
    io::JsonReader cell(object, fmt::format("{}, cell {}", reader.place(), c + 1));
    const std::vector<double> values = cell.numbers_within("cell", -kWidest_deg, 1e6);
    const bool sound = values.size() == kJoints + 1 && values[0] > 0 &&
                       *std::max_element(values.begin() + 1, values.end()) <= kWidest_deg;
    if (!sound) cell.fail(fmt::format("must be seconds above 0 and {} angles", kJoints));
    const auto row = static_cast<Eigen::Index>(c);
    book.seconds[row] = values[0];
    book.centre_deg.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data() + 1, kJoints);
  }
  book.within_deg2 = read_hand(reader, "within_deg2", 0, kWidest_deg * kWidest_deg);
  return book;
}

Person read_person(const ordered_json& json, const std::string& place) {
  io::JsonReader reader(json, place);
  Person person;
  person.source = reader.text("source");
  person.digest = reader.text("digest");
  person.rows = reader.whole_within("rows", 1, 1000000000);
  person.rest_deg = read_hand(reader, "rest_deg", -kWidest_deg, kWidest_deg);
  person.book = read_cells(reader);
  reader.done();
  return person;
}

CoupledCurve read_curve(const ordered_json& json, const std::string& place) {
  io::JsonReader reader(json, place);
  CoupledCurve curve;
  const auto joint = find_joint(reader.text("joint"));
  const auto follows = find_joint(reader.text("follows"));
  if (!joint || !follows) reader.fail("\"joint\" and \"follows\" must be joints");
  curve.coupling = {*joint, *follows};
  curve.knot_deg = reader.numbers_within("knot_deg", -kWidest_deg, kWidest_deg);
  curve.value_deg = reader.numbers_within("value_deg", -kWidest_deg, kWidest_deg);
  curve.sd_deg = reader.number_within("sd_deg", 0, kWidest_deg);
  const bool ascending =
      std::ranges::adjacent_find(curve.knot_deg, std::greater_equal()) == curve.knot_deg.end();
  if (curve.knot_deg.size() < 2 || curve.value_deg.size() != curve.knot_deg.size() || !ascending) {
    reader.fail("needs two or more ascending knots and a value for each");
  }
  reader.done();
  return curve;
}

}  // namespace

double CoupledCurve::at(double angle_deg) const { return io::interpolate(knot_deg, value_deg, angle_deg); }

Posture parse(const std::string& text, const std::string& source) {
  const ordered_json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  if (reader.text("kind") != "posture")
    reader.fail("\"kind\" must be \"posture\": make one with python -m flexor.posture_learning");
  const double schema = reader.number("schema");
  if (schema > kSchemaVersion)
    reader.fail(
        fmt::format("schema {:g} is newer than this version's {}; update flexor", schema, kSchemaVersion));
  if (schema != kSchemaVersion)
    reader.fail(fmt::format(
        "there is no schema {:g}: make the document with python -m flexor.posture_learning", schema));
  Posture posture;
  posture.written_by = reader.text("written_by");
  posture.seed = static_cast<std::uint64_t>(reader.number_within("seed", 0, 9007199254740992.0));
  if (reader.list("joints") != ordered_json(kJointNames))
    reader.fail("\"joints\" are not the 23 of this version, in their order");
  posture.limits.low_deg = read_hand(reader, "low_deg", -kWidest_deg, kWidest_deg);
  posture.limits.high_deg = read_hand(reader, "high_deg", -kWidest_deg, kWidest_deg);
  if (!(posture.limits.low_deg <= posture.limits.high_deg).all())
    reader.fail("\"low_deg\" above \"high_deg\"");
  for (const ordered_json& curve : reader.member("curves")) {
    posture.curves.push_back(
        read_curve(curve, fmt::format("{}, curve {}", source, posture.curves.size() + 1)));
  }
  for (const ordered_json& person : reader.list("people")) {
    posture.people.push_back(
        read_person(person, fmt::format("{}, person {}", source, posture.people.size() + 1)));
  }
  if (posture.people.size() < 3) reader.fail("holds fewer than three people: learn from more");
  reader.done();
  return posture;
}

Posture load(const std::filesystem::path& path) { return parse(io::read_document(path), path.string()); }

}  // namespace flexor::posture
