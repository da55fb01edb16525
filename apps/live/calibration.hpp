// A guided calibration, step by step: what to do now, what the motion has shown so far, and the files that it leaves in its
// session. It knows no sockets and starts no programs; calibration_session.hpp does what it asks for.
//
//   glove      a glove that gives readings is connected
//   reference  the camera sees the marks (or there is none)
//   motion     readings go into log.csv, the camera's angles into camera.csv; it goes on as long as the person likes
//   identify   the log and the angles become model.json and report/
//   result     the error on the part that was held out, beside the baselines: accept, or repeat the motion
//   send       the model is worn here; it may go into the glove
// A step ends when the person ends it; what is not there yet is reported, and nothing is thrown away for a bad second.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/camera.hpp"
#include "apps/live/coverage.hpp"
#include "apps/live/sessions.hpp"
#include "host/listen/log.hpp"

namespace flexor::live {

enum class Step { glove, reference, motion, identify, result, send };
enum class StepEvent { next, back, repeat, identified, accepted };

// How the angles are known: marks by the goniometer, held poses alone, a markerless tracker in the page, marks on a drawn hand.
enum class Reference { marks, poses, markerless, drawn };

struct CalibrationSetup {
  Reference reference = Reference::marks;
  std::string joints;  // joint file; of marks
  double rate_hz = 0;  // of the model; 0: not known yet
};

class Calibration {
 public:
  // The session is there already.
  Calibration(CalibrationSetup setup, Session session, std::filesystem::path folder);
  // One that was open when the program ended, at its step: a motion is made again, and so is a model. Throws io::InputError.
  static Calibration resumed(const Session& session, const std::filesystem::path& folder);
  // What that takes, as Session::calibration.
  nlohmann::ordered_json kept() const;

  Step step() const { return step_; }
  const CalibrationSetup& setup() const { return setup_; }
  Session& session() { return session_; }
  bool wants_pictures() const;

  void add(const listen::Sample& sample, const std::vector<std::string>& columns);
  void add(const SeenRow& seen, const std::vector<std::string>& names);  // as NAME_deg, always the same
  // Of one picture, and where in it (Seen::marks_at); without marks: whether there was a hand.
  void saw(int marks_found, int marks, std::vector<std::array<double, 2>> marks_at = {});
  void saw_no_camera();                          // it ended by itself
  double glove_hz() const { return glove_hz_; }  // samples a second of the motion that was recorded

  // To the next step or the one before. Throws Refusal: what this step still needs.
  void next(bool glove_is_there);
  void back() { go(StepEvent::back, "first_step"); }
  void repeat() { go(StepEvent::repeat, "nothing_to_repeat"); }

  void end_after(double seconds) { motion_.lasts_s = seconds; }  // of motion: what comes later is left out
  void set_rate(double rate_hz) { setup_.rate_hz = rate_hz; }
  // Of `flexor job identify`. `lead_s` of what follows the glove; `pose_angles` as --pose-angles has them.
  nlohmann::ordered_json identify_request(
      double lead_s, const nlohmann::ordered_json& pose_angles = nlohmann::ordered_json::array()) const;
  // Of `flexor job identify`.
  void identified(const nlohmann::ordered_json& result, std::vector<std::string> warnings);
  void failed(const std::string& why) { failure_ = why; }
  void accepted() { go(StepEvent::accepted, "nothing_to_accept"); }
  void sent() { is_sent_ = step_ == Step::send; }  // into the glove
  bool is_sent() const { return is_sent_; }
  void plot(const std::string& finger);  // throws Refusal
  std::filesystem::path model() const { return file("model.json"); }

  const char* asks() const;  // what to do now: a kind, as SOCKET.md has it
  nlohmann::ordered_json state() const;

 private:
  std::filesystem::path file(const std::string& name) const;
  void read_motion();
  void begin_motion();
  void require_complete(bool glove_is_there) const;
  void go(StepEvent event, const char* refusal);  // throws it where no step follows
  const char* motion_asks() const;
  nlohmann::ordered_json result_state() const;
  std::string map() const;
  bool is_markerless() const { return setup_.reference == Reference::markerless; }
  nlohmann::ordered_json reference_error() const;

  CalibrationSetup setup_;
  Session session_;
  std::filesystem::path folder_;
  Step step_ = Step::glove;
  int attempt_ = 1;
  bool is_sent_ = false;
  std::unique_ptr<listen::Log> log_;
  std::unique_ptr<listen::Log> camera_;
  std::vector<std::string> columns_;  // of log.csv
  std::vector<std::string> angles_;   // of camera.csv
  // From its begin on.
  struct Motion {
    std::optional<Coverage> coverage;
    double begun_s = -1;   // host's
    double lasts_s = 0;    // 0: as long as the person likes
    bool is_over = false;  // that, in the camera's angles, which come later
    double seconds = 0;
    double worn_s = 0;  // likewise, without the glove's pauses
    double newest_angle_s = -1e9;
    std::uint64_t angle_rows = 0;
    double angle_came_s = 0;  // seconds when the newest row came
  } motion_;
  double glove_hz_ = 0;
  std::uint64_t pictures_ = 0;
  int marks_found_ = 0;  // in the newest picture
  int marks_ = 0;        // that there are
  std::vector<std::array<double, 2>> marks_at_;
  double recent_share_ = 0;  // of marks that were found, lately
  std::string failure_;
  nlohmann::ordered_json fingers_;  // of the result
  nlohmann::ordered_json plot_;
  std::vector<std::string> warnings_;
  nlohmann::ordered_json curves_;  // of each joint that has been measured
};

// None: nothing follows.
std::optional<Step> after(Step step, StepEvent event, Reference by);
// Throws io::InputError listing the known.
Reference reference_of(const std::string& name);
const char* name_of(Reference reference);
const char* name_of(Step step);

}  // namespace flexor::live
