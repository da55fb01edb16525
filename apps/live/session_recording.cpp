#include "apps/live/session_recording.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kLongestMarker = 200;
constexpr std::size_t kMostMarkers = 500;  // who opens the page gets them all

}  // namespace

void SessionRecording::add(const listen::Sample& sample, const std::vector<std::string>& columns) {
  if (!log_) {
    log_ = std::make_unique<listen::Log>(log_file(), columns);
    columns_ = columns;
    begun_s_ = sample.host_s;
  }
  if (columns != columns_) throw io::JobError("another_glove");
  log_->add(sample);
  newest_s_ = sample.host_s;
}

void SessionRecording::add_hand(const listen::Sample& sample, const std::vector<std::string>& columns) {
  if (!hand_) hand_ = std::make_unique<listen::Log>(folder_ / "hand.csv", columns);
  hand_->add(sample);
}

void SessionRecording::mark(double host_s, const std::string& text) {
  if (text.size() > kLongestMarker) throw io::InputError("a marker has at most {} letters", kLongestMarker);
  if (markers_.size() >= kMostMarkers)
    throw io::InputError("a recording has at most {} markers", kMostMarkers);
  if (!marks_) {
    marks_ = std::make_unique<io::GrowingFile>(folder_ / "markers.csv");
    marks_->append("host_s,text\n");
  }
  marks_->append(fmt::format("{:.6f},{}\n", host_s, recording::quoted(io::one_line(text))));
  markers_.push_back({{"event", "marker"}, {"host_s", host_s}, {"text", text}});
}

bool SessionRecording::is_silent(double now_s) const {
  constexpr double kSilent_s = 1;
  return rows() > 0 && now_s - newest_s_ > kSilent_s;
}

std::string SessionRecording::in_words(double now_s) const {
  std::string out = fmt::format("{} rows in {}", rows(), log_file().string());
  if (left_out_ > 0)
    out += fmt::format("; {} rows that came were malformed or did not fit, and are left out", left_out_);
  if (is_silent(now_s)) out += fmt::format("; nothing was recorded in the last {:.0f} s", now_s - newest_s_);
  return out;
}

void SessionRecording::flush() {
  if (log_) log_->flush();
  if (hand_) hand_->flush();
}

void SessionRecording::flush_if_due(double host_s) {
  if (log_) log_->flush_if_due(host_s);
  if (hand_) hand_->flush_if_due(host_s);
}

}  // namespace flexor::live
