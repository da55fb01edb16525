#include "apps/live/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>

#include "apps/live/words.hpp"
#include "host/identify/identify.hpp"
#include "host/io/beneath.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::live {
namespace {

constexpr double kLong_s = 90;   // of motion, is asked for
constexpr double kPoses_s = 16;  // likewise of held poses
constexpr double kShort_s = 30;  // less is refused: a fit takes 100 samples and as many to prove it
constexpr double kPosesShort_s = 8;
constexpr const char* kArticlesHand = "paper_hand";
constexpr double kSeen = 0.5;              // share of marks, below which the camera does not see the hand
constexpr std::uint64_t kLeastRows = 100;  // with every angle
constexpr double kUnseen_s = 3;            // without a row: it is reported
constexpr double kFollows_percent = 50;    // of the fit: less is no model
constexpr double kPause_s = 0.5;           // of the glove: what is longer counts for no rate
// Of markerless angles themselves, RMS with their mean, against marks on a film of one hand from the side (docs/live.md):
// hypot(6, 13) and hypot(11, 6).
constexpr double kMarkerlessKnuckle_deg = 14;
constexpr double kMarkerlessOther_deg = 13;

struct Instruction {
  double until_s;
  const char* kind;  // as SOCKET.md has it
};

constexpr std::array<Instruction, 8> kMotion = {{{5, "open"},
                                                 {15, "quick"},
                                                 {30, "fist_slowly"},
                                                 {40, "half"},
                                                 {55, "one_by_one"},
                                                 {70, "as_always"},
                                                 {80, "three_stops"},
                                                 {kLong_s, "as_you_like"}}};

constexpr std::array<Instruction, 4> kPoses = {
    {{4, "open"}, {8, "fist"}, {12, "open_again"}, {kPoses_s, "fist_again"}}};

// What is to be done now and after it; empty: all was.
std::span<const Instruction> instructions(Reference reference, double t_s) {
  std::span<const Instruction> out = kMotion;
  if (reference == Reference::poses) out = kPoses;
  while (!out.empty() && out.front().until_s <= t_s) out = out.subspan(1);
  return out;
}

// What a job writes over is our own: a link leads elsewhere, and a FIFO waits for a reader.
void require_own(const std::filesystem::path& path) {
  using namespace std::filesystem;
  std::error_code error;
  const file_status status = symlink_status(path, error);
  bool is_own = !exists(status) || is_regular_file(status) || is_directory(status);
  for (directory_iterator i(is_directory(status) ? directory_iterator(path, error) : directory_iterator());
       is_own && i != directory_iterator(); i.increment(error))
    is_own = is_regular_file(i->symlink_status(error));
  if (!is_own)
    throw io::InputError(path.string() + ": is no plain file, or no folder of plain files: remove it");
}

double markerless_error_deg(const std::string& joint) {
  return joint.ends_with("_mcp") ? kMarkerlessKnuckle_deg : kMarkerlessOther_deg;
}

}  // namespace

std::optional<Step> after(Step step, StepEvent event, Reference by) {
  using enum Step;
  const Step before_motion = by == Reference::poses ? glove : reference;
  const bool has_motion = step == identify || step == result;
  switch (event) {
    case StepEvent::next:
      if (step == motion) return identify;
      if (step == before_motion) return motion;
      return step == glove ? std::optional(reference) : std::nullopt;
    case StepEvent::back:
      if (step == motion) return before_motion;
      if (step == send) return result;
      if (step == reference) return glove;
      [[fallthrough]];
    case StepEvent::repeat:
      return has_motion ? std::optional(motion) : std::nullopt;
    case StepEvent::identified:
      return has_motion ? std::optional(result) : std::nullopt;
    case StepEvent::accepted:
      return step == result ? std::optional(send) : std::nullopt;
  }
  return std::nullopt;
}

const char* name_of(Step step) {
  constexpr std::array<const char*, 6> kNames = {"glove",    "reference", "motion",
                                                 "identify", "result",    "send"};
  return kNames.at(static_cast<std::size_t>(step));
}

const char* name_of(Reference reference) {
  constexpr std::array<const char*, 4> kNames = {"marks", "poses", "markerless", "drawn"};
  return kNames.at(static_cast<std::size_t>(reference));
}

Reference reference_of(const std::string& name) {
  for (const Reference r : {Reference::marks, Reference::poses, Reference::markerless, Reference::drawn})
    if (name == name_of(r)) return r;
  throw io::InputError("\"reference\" is \"{}\"; known: marks, poses, markerless, drawn", name);
}

Calibration::Calibration(CalibrationSetup setup, Session session, std::filesystem::path folder)
    : setup_(std::move(setup)), session_(std::move(session)), folder_(std::move(folder)) {}

Json Calibration::kept() const {
  return {{"step", name_of(step_)},
          {"reference", name_of(setup_.reference)},
          {"joints", setup_.joints},
          {"rate_hz", setup_.rate_hz},
          {"attempt", attempt_}};
}

Calibration Calibration::resumed(const Session& session, const std::filesystem::path& folder) {
  io::JsonReader reader(session.calibration, (folder / "session.json").string());
  CalibrationSetup setup;
  setup.reference = reference_of(reader.text("reference"));
  setup.joints = reader.text("joints");
  if (!setup.joints.empty()) require_carried(setup.joints);  // a path leads elsewhere
  setup.rate_hz = reader.number_within("rate_hz", 0, 1000);
  Calibration out(setup, session, folder);
  out.attempt_ = reader.whole_within("attempt", 1, 10000);
  const std::string step = reader.text("step");
  const bool is_seen = step == name_of(Step::reference) || step == name_of(Step::motion);
  if (is_seen && setup.reference != Reference::poses) out.step_ = Step::reference;
  if (step == name_of(Step::identify) || step == name_of(Step::result)) out.read_motion();
  return out;
}

// The state of a motion that was over, from its files.
void Calibration::read_motion() {
  const auto names = [this](const std::filesystem::path& path) {
    constexpr std::uint64_t kHeader = 1U << 16U;
    std::istringstream begin(
        io::FileBeneath(folder_, path.filename().string(), kMostLogBytes).read(0, kHeader));
    return recording::CsvReader(begin, path.string(), {{}, {}, recording::Holes::all}).columns();
  };
  columns_ = names(file("log.csv"));
  if (setup_.reference != Reference::poses) angles_ = names(file("camera.csv"));
  step_ = Step::identify;
}

std::filesystem::path Calibration::file(const std::string& name) const {
  if (attempt_ == 1) return folder_ / name;
  const std::filesystem::path path(name);
  return folder_ / fmt::format("{}-{}{}", path.stem().string(), attempt_, path.extension().string());
}

bool Calibration::wants_pictures() const {
  if (setup_.reference == Reference::poses) return false;
  return step_ == Step::reference || step_ == Step::motion;
}

void Calibration::add(const listen::Sample& sample, const std::vector<std::string>& columns) {
  if (step_ != Step::motion) return;
  if (!log_) {
    columns_ = columns;
    log_ = std::make_unique<listen::Log>(file("log.csv"), columns);
    std::vector<std::string> names;
    for (const std::string& column : columns) names.push_back(recording::cut_name(column).name);
    motion_.coverage.emplace(names);
    motion_.begun_s = sample.host_s;
  }
  if (motion_.lasts_s > 0 && sample.host_s - motion_.begun_s > motion_.lasts_s) return;
  if (columns != columns_) throw io::JobError("another_glove");
  motion_.worn_s += std::min(sample.host_s - motion_.begun_s - motion_.seconds, kPause_s);
  motion_.seconds = sample.host_s - motion_.begun_s;
  motion_.coverage->add(sample.host_s, sample.value);
  log_->add(sample);
}

// Rows in which what is needed was seen: a fit takes no others. The article's hand has one angle for each sensor; elsewhere every
// angle counts.
void Calibration::add(const SeenRow& seen, const std::vector<std::string>& names) {
  if (step_ != Step::motion || !log_ || seen.t_s < motion_.begun_s) return;
  motion_.is_over = motion_.lasts_s > 0 && seen.t_s - motion_.begun_s > motion_.lasts_s;
  if (motion_.is_over) return;
  if (!camera_) camera_ = std::make_unique<listen::Log>(file("camera.csv"), names);
  angles_ = names;
  if (seen.t_s <= motion_.newest_angle_s || seen.deg.size() != names.size()) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool is_needed = setup_.joints != kArticlesHand || names[i].ends_with("_mcp_deg");
    if (is_needed && !std::isfinite(seen.deg[i])) return;
  }
  motion_.newest_angle_s = seen.t_s;
  motion_.angle_came_s = motion_.seconds;
  ++motion_.angle_rows;
  camera_->add({seen.t_s, {}, seen.deg, {}});
}

void Calibration::saw(int marks_found, int marks, std::vector<std::array<double, 2>> marks_at) {
  marks_at_ = std::move(marks_at);
  ++pictures_;
  marks_found_ = marks_found;
  marks_ = marks;
  const double share = marks > 0 ? static_cast<double>(marks_found) / marks : 0;
  recent_share_ += (share - recent_share_) / std::min<double>(20, static_cast<double>(pictures_));
}

void Calibration::saw_no_camera() {
  pictures_ = 0;
  recent_share_ = 0;
}

void Calibration::begin_motion() {
  motion_ = {};
  failure_.clear();
  fingers_ = nullptr;
  plot_ = nullptr;
  const auto is_there = [this](const char* name) {
    return std::filesystem::exists(std::filesystem::symlink_status(file(name)));
  };
  while (is_there("log.csv") || is_there("camera.csv") || is_there("model.json") || is_there("report"))
    ++attempt_;
}

// Of the step that is to be left for the next one.
void Calibration::require_complete(bool glove_is_there) const {
  if (step_ == Step::glove && !glove_is_there) throw Refusal("no_glove");
  if (step_ == Step::reference && !glove_is_there) throw Refusal("glove_gone");
  if (step_ == Step::reference && recent_share_ < kSeen) throw Refusal("hand_unseen");
  if (step_ != Step::motion) return;
  const bool poses = setup_.reference == Reference::poses;
  const double least_s = poses ? kPosesShort_s : kShort_s;
  if (motion_.seconds < least_s)
    throw Refusal(poses ? "poses_too_short" : "motion_too_short",
                  {{"seconds", motion_.seconds}, {"least_s", least_s}});
  if (!poses && motion_.angle_rows < kLeastRows)
    throw Refusal(is_markerless() ? "hand_too_seldom" : "marks_too_seldom",
                  {{"angles", motion_.angle_rows}, {"least", kLeastRows}});
}

void Calibration::go(StepEvent event, const char* refusal) {
  const std::optional<Step> to = after(step_, event, setup_.reference);
  if (!to) throw Refusal(refusal);
  log_.reset();
  camera_.reset();
  if (*to == Step::motion) begin_motion();
  step_ = *to;
}

void Calibration::next(bool glove_is_there) {
  require_complete(glove_is_there);
  if (step_ == Step::motion) {
    log_->flush();
    if (camera_) camera_->flush();
    glove_hz_ = motion_.worn_s > 0 ? static_cast<double>(log_->rows()) / motion_.worn_s : 0;
    session_.seconds = motion_.seconds;
  }
  const bool waits = step_ == Step::identify && failure_.empty();
  go(StepEvent::next, waits ? "identifies" : step_ == Step::identify ? "not_identified" : "accept_or_repeat");
}

// The article's hand has one joint for each finger, which is what a bionic hand of five motors takes: the knuckle, called like
// its finger. Empty: by name.
std::string Calibration::map() const {
  if (setup_.joints != kArticlesHand) return "";
  std::string out;
  for (const std::string& column : columns_) {
    const std::string finger = recording::cut_name(column).name;
    const std::string angle = finger + "_mcp_deg";
    if (std::ranges::find(angles_, angle) == angles_.end()) continue;
    out += fmt::format("{}{}={}:{}", out.empty() ? "" : ",", finger, column, angle);
  }
  return out;
}

// "index_mcp=14", "index_pip=13": of the joints that will be fitted.
Json Calibration::reference_error() const {
  Json out = Json::array();
  for (const std::string& angle : angles_) {
    const std::string joint = angle.substr(0, angle.rfind('_'));
    const std::string finger = joint.substr(0, joint.find('_'));
    const bool is_sensed = std::ranges::any_of(
        columns_, [&](const std::string& column) { return recording::cut_name(column).name == finger; });
    if (is_sensed) out.push_back(fmt::format("{}={:g}", joint, markerless_error_deg(joint)));
  }
  return out;
}

Json Calibration::identify_request(double lead_s, const Json& pose_angles) const {
  require_own(model());
  require_own(file("report"));
  Json out = {{"rate", setup_.rate_hz}, {"model", model().string()}};
  if (setup_.reference == Reference::poses) {
    out.update({{"poses", file("log.csv").string()}, {"pose-angles", pose_angles}, {"first-pose", "open"}});
    return out;
  }
  out["pair"] = Json::array({Json::array({file("log.csv").string(), file("camera.csv").string()})});
  out["fit-all"] = true;
  out["neighbours"] = true;
  out["report"] = file("report").string();
  if (!map().empty()) out["map"] = map();
  if (is_markerless()) out["reference-error"] = reference_error();
  if (lead_s > 0) out["lead"] = lead_s;
  return out;
}

void Calibration::identified(const Json& result, std::vector<std::string> warnings) {
  warnings_ = std::move(warnings);
  fingers_ = Json::array();
  curves_ = Json::object();
  plot_ = nullptr;
  for (const auto& [name, joint] : result.at("joints").items()) {
    if (joint.contains("held_out_curve")) curves_[name] = joint.at("held_out_curve");
    const auto of = [&joint = joint](const std::string& path) {
      return joint.value(Json::json_pointer(path), Json(nullptr));
    };
    const bool is_measured = joint.contains("holdout");  // else of poses alone
    const Json best = of("/verdict/baseline");
    const bool has_best = best.is_string() && best != "";
    const Json fit_percent =
        of("/holdout/fit_percent");  // null: the finger stood still where it was held out
    const bool follows = fit_percent.is_number() && fit_percent >= kFollows_percent;
    fingers_.push_back(
        {{"name", name},
         {"error_deg", of(is_measured ? "/holdout/rmse_deg" : "/expected_error_deg")},
         {"line_deg", of("/baselines/line/rmse_deg")},
         {"baseline", has_best ? best : Json(nullptr)},
         {"baseline_deg",
          has_best ? of("/baselines/" + best.get<std::string>() + "/rmse_deg") : Json(nullptr)},
         {"fit_percent", fit_percent},
         {"verdict", !is_measured ? Json("expected")
                     : follows    ? of("/verdict/word")
                                  : Json("astray")},
         {"reference_error_deg", is_markerless() ? Json(markerless_error_deg(name)) : Json(nullptr)}});
  }
  go(StepEvent::identified, "nothing_to_identify");
  if (!curves_.empty()) plot(curves_.begin().key());
}

void Calibration::plot(const std::string& finger) {
  if (step_ != Step::result || !curves_.contains(finger)) throw Refusal("no_plot", {{"finger", finger}});
  const Json& curve = curves_.at(finger);
  plot_ = {{"finger", finger},
           {"t_s", curve.at("t_s")},
           {"reference_deg", curve.at("measured_deg")},
           {"model_deg", curve.at("estimated_deg")},
           {"line_deg", curve.at("straight_line_deg")}};
}

const char* Calibration::motion_asks() const {
  constexpr double kTwoOfThree = 0.6;
  const auto is_any = [this](bool (*holds)(const Covered&)) {
    return motion_.coverage && std::ranges::any_of(motion_.coverage->covered(), holds);
  };
  if (!log_) return "wait";
  if (motion_.lasts_s > 0) return motion_.is_over ? "enough" : "watch";
  const auto now = instructions(setup_.reference, motion_.seconds);
  if (setup_.reference == Reference::poses && now.empty())  // some sensor has rested at two places
    return is_any([](const Covered& c) { return c.holds > kTwoOfThree; }) ? "enough" : "rest";
  if (setup_.reference == Reference::poses) return now.front().kind;
  if (pictures_ > 20 && recent_share_ < kSeen) return "hidden";
  if (motion_.seconds - motion_.angle_came_s > kUnseen_s) return "no_angles";
  if (!now.empty()) return now.front().kind;
  return is_any([](const Covered& c) { return !c.is_enough(); }) ? "missing" : "enough";
}

const char* Calibration::asks() const {
  switch (step_) {
    case Step::glove:
      return "put_on";
    case Step::reference:
      return pictures_ == 0 ? "show_hand" : recent_share_ < kSeen ? "turn" : "seen";
    case Step::motion:
      return motion_asks();
    case Step::identify:
      return failure_.empty() ? "identifies" : "failed";
    case Step::result:
      return "result";
    case Step::send:
      return is_sent_ ? "sent" : "accepted";
  }
  return "";
}

Json Calibration::result_state() const {
  if (fingers_.is_null()) return nullptr;
  const bool is_measured = setup_.reference != Reference::poses;
  const std::string report = session_.name + "/" + file("report").filename().string() + "/report.html";
  return {{"fingers", fingers_},
          {"plot", plot_},
          {"warnings", warnings_},
          {"report", is_measured ? Json(report) : Json(nullptr)}};
}

Json Calibration::state() const {
  const bool none = setup_.reference == Reference::poses;
  const char* camera = none ? "none" : setup_.reference == Reference::drawn ? "server" : "page";
  const bool is_guided = step_ == Step::motion && motion_.lasts_s == 0;
  const auto now = instructions(setup_.reference, is_guided ? motion_.seconds : INFINITY);
  return {{"step", name_of(step_)},
          {"reference", name_of(setup_.reference)},
          {"camera", camera},
          {"joints", setup_.joints},
          {"person", session_.person},
          {"side", session_.side},
          {"session", session_.name},
          {"asks", asks()},
          {"seconds", motion_.seconds},
          {"of_seconds", none                  ? kPoses_s
                         : motion_.lasts_s > 0 ? motion_.lasts_s
                                               : kLong_s},
          {"left_s", now.empty() ? Json(nullptr) : Json(now.front().until_s - motion_.seconds)},
          {"then", now.size() < 2 ? Json(nullptr) : Json(now[1].kind)},
          {"covered", motion_.coverage && !none ? Json(motion_.coverage->covered()) : Json::array()},
          {"pictures", pictures_},
          {"angles", motion_.angle_rows},
          {"marks_found", marks_found_},
          {"marks", marks_},
          {"marks_at", marks_at_},
          {"tracked", recent_share_},
          {"failed", failure_.empty() ? Json(nullptr) : Json(failure_)},
          {"result", result_state()}};
}

}  // namespace flexor::live
