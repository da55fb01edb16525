// What is recorded of a glove that is worn: for whoever asks for it, and the ten seconds of one that was put on again.
#pragma once

#include <optional>

#include "apps/live/job_runner.hpp"
#include "host/io/growing_file.hpp"
#include "host/listen/log.hpp"

namespace flexor::live {

// What is written of a glove that is worn: log.csv, hand.csv where a bionic hand speaks at a port, markers.csv, in the folder of a session.
// What is wrong with a file is thrown as io::InputError or io::JobError, one line.
class SessionRecording {
 public:
  SessionRecording(Session of, std::filesystem::path folder)
      : session(std::move(of)), folder_(std::move(folder)) {}

  // Each file begins with its first sample, which determines the columns. Another glove's are refused.
  void add(const listen::Sample& sample, const std::vector<std::string>& columns);
  void add_hand(const listen::Sample& sample, const std::vector<std::string>& columns);
  void mark(double host_s, const std::string& text);
  void leave_out(std::uint64_t rows) { left_out_ += rows; }  // that came and are not to be understood
  void flush();
  void flush_if_due(double host_s);

  std::uint64_t rows() const { return log_ ? log_->rows() : 0; }
  double seconds() const { return newest_s_ - begun_s_; }  // from the first sample to the newest
  // What is in its log, and what is not: rows that were left out, a silence before `now_s`.
  std::string in_words(double now_s) const;
  bool is_silent(double now_s) const;  // nothing came for a second
  std::filesystem::path log_file() const { return folder_ / "log.csv"; }
  // As they are sent; who opens the page later gets them too.
  const std::vector<Json>& markers() const { return markers_; }

  Session session;

 private:
  std::filesystem::path folder_;
  std::unique_ptr<listen::Log> log_;
  std::vector<std::string> columns_;  // of log_
  std::unique_ptr<listen::Log> hand_;
  std::unique_ptr<io::GrowingFile> marks_;
  std::vector<Json> markers_;
  double begun_s_ = 0;
  double newest_s_ = 0;
  std::uint64_t left_out_ = 0;
};

// What came of a glove that was put on again: the answer of `flexor recalibrate --json`, finger by finger.
struct RedonningResult {
  bool applied = false;  // there is a model that fits better
  bool is_off = false;   // by more than it is sure of, at some finger
  // Of each joint: name, before_deg, after_deg, and a verdict on each of its sensors: "fitted", or why it stays as it was, which
  // begins with "kept", "wanted" or "does not fit".
  Json fingers = Json::array();
  std::string wanted;   // what the motion lacked; "": nothing
  std::string misfits;  // sensors that no donning explains; "": none
};

// `old`: the model that was recalibrated. Before: how far off its angles are by the new calibration, root mean square. After:
// the standard error that is left. Throws where the answer is none of that model.
RedonningResult result_of(const model::Model& old, const Json& report);

// Of a glove that was put on again: its motion is recorded, fitted, and what came of it waits for an answer.
enum class RedonningStep { none, motion, fits, answer };
enum class RedonningEvent { starts, moved, fitted, ends };
RedonningStep after(RedonningStep step, RedonningEvent event);

class Recorder {
 public:
  Recorder(Context& context, Worn& worn, GlovePort& glove, JobRunner& jobs);  // adds its words

  void take(const listen::Sample& sample);
  void take_hand(const std::vector<listen::Sample>& samples, const std::vector<std::string>& columns);
  void leave_out(std::uint64_t rows);  // that came and are not to be understood
  void tick();
  void end();  // the program ends

  std::vector<Json> markers() const { return recording_ ? recording_->markers() : std::vector<Json>(); }
  void write(Json& state) const;
  Json next() const;  // what to do, as SOCKET.md has it; null: nothing

 private:
  void guard(const std::function<void()>& work);
  void stop();
  void start_redonning();
  void fit_redonning();
  void end_redonning(bool is_accepted);

  Context& context_;
  Worn& worn_;
  GlovePort& glove_;
  JobRunner& jobs_;
  std::optional<SessionRecording> recording_;
  struct Redonning {
    RedonningStep step = RedonningStep::none;
    std::optional<SessionRecording> recording = {};
    double worn_s = 0;  // of samples, without pauses
    RedonningResult result = {};
  } redonning_;
};

}  // namespace flexor::live
