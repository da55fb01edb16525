// What is written of a glove that is worn: log.csv, hand.csv where a bionic hand speaks at a port, markers.csv, in the folder of a session.
// What is wrong with a file is thrown as io::InputError or io::JobError, one line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/live/sessions.hpp"
#include "host/io/growing_file.hpp"
#include "host/listen/log.hpp"

namespace flexor::live {

class SessionRecording {
 public:
  SessionRecording(Session of, std::filesystem::path folder)
      : session(std::move(of)), folder_(std::move(folder)) {}

  // Each file begins with its first sample, which says what columns there are. Another glove's are refused.
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
  const std::vector<nlohmann::ordered_json>& markers() const { return markers_; }

  Session session;

 private:
  std::filesystem::path folder_;
  std::unique_ptr<listen::Log> log_;
  std::vector<std::string> columns_;  // of log_
  std::unique_ptr<listen::Log> hand_;
  std::unique_ptr<io::GrowingFile> marks_;
  std::vector<nlohmann::ordered_json> markers_;
  double begun_s_ = 0;
  double newest_s_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace flexor::live
