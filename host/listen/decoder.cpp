#include "host/listen/decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "host/recording/line_format.hpp"
#include "host/recording/lines.hpp"
#include "host/recording/table.hpp"
#include "host/recording/unit.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::listen {
namespace {

constexpr std::size_t kLongestLine = 4096;  // bytes; beyond it is no line of a glove's

// What one of the two boards sends in frames, of which some are samples.
class FrameDecoder : public Decoder {
 public:
  explicit FrameDecoder(link::Type samples) : samples_(samples) {}

  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) final {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      ++held_;
      const link::Received result = packet_.push(byte);
      if (byte != link::kDelimiter) continue;
      const std::uint64_t size = held_;
      held_ = 0;
      if (result == link::Received::nothing) continue;
      if (result != link::Received::pending) {
        count_malformed();
      } else if (is_its_own()) {
        tally_.understood += size + 1;  // and the delimiter before it: alone it may be a line that is low
        if (packet_.type() == samples_) take(host_s, out);
      }
    }
  }

  void cut() final {
    if (held_ > 0) count_malformed();
    held_ = 0;
    (void)packet_.push(link::kDelimiter);
  }

 protected:
  virtual bool is_its_own() = 0;  // the frame is of this board
  virtual bool read(std::uint16_t& time_ms, Sample& sample) = 0;

  bool is_state_of(link::BoardKind board) const {
    return packet_.type() == link::Type::state && packet_.body_bytes() == link::State::kBytes &&
           link::get_state(packet_.body()).board == board;
  }

  // A counter that starts again, as with each challenge, is no gap.
  void count_gap() {
    constexpr std::uint16_t kLongestGap = 1000;
    const std::uint16_t sequence = packet_.sequence();
    const auto gap = static_cast<std::uint16_t>(sequence - next_);
    tally_.lost = tally_.lost.value_or(0) + (tally_.samples > 0 && gap < kLongestGap ? gap : 0);
    next_ = static_cast<std::uint16_t>(sequence + 1);
  }

  const link::Type samples_;
  link::PacketReader packet_;

 private:
  void take(double host_s, std::vector<Sample>& out) {
    std::uint16_t time_ms = 0;
    Sample sample;
    if (!read(time_ms, sample)) return count_malformed();
    if (is_late(time_ms, host_s)) {
      ++tally_.late;
      return;
    }
    last_sequence_ = packet_.sequence();
    if (samples_ != link::Type::readings) count_gap();  // which have no counter
    sample.host_s = host_s;
    sample.board_s = seconds(time_ms, host_s);
    count_sample();
    out.push_back(std::move(sample));
  }

  // The board's clock, of 16 bits in milliseconds, which wraps every 65.5 s, made whole by the host's.
  double seconds(std::uint16_t now_ms, double host_s) {
    constexpr double kWrap_ms = 65536;
    const double step_ms = static_cast<std::uint16_t>(now_ms - last_ms_);
    const double passed_ms = std::exchange(started_, true) ? 1000 * (host_s - host_s_) : 0;
    total_ms_ += step_ms + kWrap_ms * std::max(0.0, std::round((passed_ms - step_ms) / kWrap_ms));
    last_ms_ = now_ms;
    host_s_ = host_s;
    return total_ms_ / 1000;
  }

  // Whether it was sent before the newest sample, or is that once more: a little less, of one that came soon after it.
  bool is_late(std::uint16_t now_ms, double host_s) const {
    constexpr int kMost_ms = 250;
    const int behind_ms = static_cast<std::int16_t>(last_ms_ - now_ms);
    if (!started_ || host_s - host_s_ > 1 || behind_ms < 0 || behind_ms > kMost_ms) return false;
    return behind_ms > 0 || packet_.sequence() == last_sequence_;
  }

  bool started_ = false;
  std::uint16_t last_ms_ = 0;
  double total_ms_ = 0;
  double host_s_ = 0;
  std::uint64_t held_ = 0;
  std::uint16_t next_ = 0;
  std::uint16_t last_sequence_ = 0;  // of a sample
};

constexpr std::array kSensorRemarks = {"", "broken wire", "short circuit", "stuck"};  // by SensorStatus

class GloveFrames : public FrameDecoder {
 public:
  explicit GloveFrames(bool readings) : FrameDecoder(readings ? link::Type::readings : link::Type::angles) {}
  // Its angles would wait for the hand's challenge; readings carry no tag in any case: nobody moves by them.
  std::string remark() const override {
    if (samples_ == link::Type::angles || !waits_for_hand_) return {};
    return "the glove waits for its hand; nothing guards its readings";
  }

 protected:
  bool is_its_own() override {
    const link::Type type = packet_.type();
    const bool state = is_state_of(link::BoardKind::glove);
    if (state) waits_for_hand_ = !link::get_state(packet_.body()).in_touch;
    if (type == link::Type::angles) waits_for_hand_ = false;
    return state || type == link::Type::angles || type == link::Type::readings ||
           type == link::Type::coefficients;
  }
  bool read(std::uint16_t& time_ms, Sample& sample) override {
    return samples_ == link::Type::angles ? angles(time_ms, sample) : readings(time_ms, sample);
  }

 private:
  bool angles(std::uint16_t& time_ms, Sample& sample) {
    const std::uint8_t joints = link::joints_in(packet_.body_bytes());
    if (joints == 0 || !fits(joints, "deg")) return false;
    std::array<std::int16_t, link::kMaxJoints> angle{};
    std::array<link::SensorStatus, link::kMaxJoints> status{};
    link::get_angles(packet_.body(), joints, time_ms, angle.data(), status.data());
    for (std::size_t i = 0; i < joints; ++i) {
      sample.value.push_back(angle.at(i) / 16.0);
      sample.remark.emplace_back(kSensorRemarks.at(static_cast<std::size_t>(status.at(i))));
    }
    return true;
  }

  bool readings(std::uint16_t& time_ms, Sample& sample) {
    if (packet_.body_bytes() != link::readings_bytes(link::kFingers) || !fits(link::kFingers, "count"))
      return false;
    std::array<std::uint16_t, link::kFingers> counts{};
    link::get_readings(packet_.body(), link::kFingers, time_ms, counts.data());
    sample.value.assign(counts.begin(), counts.end());
    return true;
  }

  // The first frame states how many there are.
  bool fits(std::size_t count, const char* unit) {
    const bool are_fingers = count == recording::kFingers.size();
    for (std::size_t i = columns_.size(); tally_.samples == 0 && i < count; ++i) {
      const std::string joint = are_fingers ? recording::kFingers.at(i) : fmt::format("joint{}", i + 1);
      columns_.push_back(fmt::format("{}_{}", joint, unit));
    }
    if (columns_.size() != count) count_misfit(count, columns_.size());
    return columns_.size() == count;
  }

  bool waits_for_hand_ = false;
};

std::string remark_of_finger(std::uint8_t fault) {
  static constexpr std::array kNames = {"",        "stalled",  "blind",    "frozen",
                                        "slipped", "reversed", "floating", "noisy"};
  return fault < kNames.size() ? kNames.at(fault) : "a fault that this version does not know";
}

std::string remark_of_board(std::uint8_t faults) {
  static constexpr std::array kNames = {"supply dip", "converter stuck", "started by a brown-out",
                                        "started by the watchdog", "a driver that did not stop"};
  std::string out;
  for (std::size_t bit = 0; bit < kNames.size(); ++bit)
    if ((faults >> bit & 1) != 0) out += (out.empty() ? "" : ", ") + std::string(kNames.at(bit));
  return out;
}

class HandFrames : public FrameDecoder {
 public:
  HandFrames() : FrameDecoder(link::Type::telemetry) {
    for (const char* unit : {"deg", "duty_percent", "fault"})
      for (const char* finger : recording::kFingers) columns_.push_back(fmt::format("{}_{}", finger, unit));
    columns_.emplace_back("board_faults");
  }

 protected:
  bool is_its_own() override {
    const link::Type type = packet_.type();
    const bool state = is_state_of(link::BoardKind::hand);
    if (state) count_gap();
    return state || type == link::Type::telemetry || type == link::Type::challenge;
  }
  bool read(std::uint16_t& time_ms, Sample& sample) override {
    if (packet_.body_bytes() != link::telemetry_bytes(link::kFingers)) return false;
    const std::uint8_t* body = packet_.body();
    time_ms = static_cast<std::uint16_t>(body[0] | body[1] << 8);
    sample.value.resize(columns_.size());
    sample.remark.resize(columns_.size());
    for (std::uint8_t i = 0; i < link::kFingers; ++i) {
      const link::FingerTelemetry finger = link::get_telemetry(body, i);
      sample.value[i] = finger.angle / 16.0;
      sample.value[i + link::kFingers] = std::max(-100.0, 100 * finger.duty / 127.0);
      sample.value[i + 2 * link::kFingers] = finger.fault;
      sample.remark[i + 2 * link::kFingers] = remark_of_finger(finger.fault);
    }
    sample.value.back() = body[2];
    sample.remark.back() = remark_of_board(body[2]);
    return true;
  }
};

// A recording has a t_s and a host_s of its own, and is read by names: one that is taken gets a number.
std::vector<std::string> without_clashes(const std::vector<std::string>& names) {
  std::set<std::string> given = {"t_s", "host_s"};
  std::vector<std::string> out;
  for (const std::string& name : names) {
    std::string own = name;
    for (int k = 2; given.contains(own) || (own != name && std::ranges::find(names, own) != names.end()); ++k)
      own = fmt::format("{}-{}", name, k);
    given.insert(own);
    out.push_back(own);
  }
  return out;
}

class LineDecoder : public Decoder {
 public:
  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) override {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      ++line_.bytes;
      if (!splitter_.push(byte)) continue;
      line_.host_s = host_s;
      std::swap(line_.text, splitter_.line());
      if (is_piece()) {
        // Of an end of a line nobody knows how much was lost.
      } else if (line_.bytes > kLongestLine) {
        count_malformed();
      } else if (!table_.push(line_)) {
        tally_.understood += line_.bytes;
      }
      splitter_.cut();
      line_.bytes = 0;
      take_all(out);
    }
  }

  void cut() override {
    if (!may_be_piece_ && line_.bytes > 0) count_malformed();
    splitter_.cut();
    line_.bytes = 0;
    may_be_piece_ = true;
    table_.cut();
  }

  std::string refusal() const override {
    if (table_.refusal().empty()) return {};
    return "another glove speaks: its columns are " + table_.refusal();
  }
  bool is_for_drivers() const override { return table_.layout() == recording::Layout::keyed; }

 private:
  // The first line of a port is as a rule the end of one; but a board that starts when its port is opened begins with its header.
  bool is_piece() {
    if (!std::exchange(may_be_piece_, false)) return false;
    std::string text = line_.text;
    std::string monitor_time;
    recording::cut_prefix(text, monitor_time);
    const char separator = recording::separator_of(text);
    std::vector<std::string> cells;
    recording::split(text, separator, cells);
    return line_.bytes > kLongestLine || cells.size() < 2 || !recording::is_header(cells, separator);
  }

  void take_all(std::vector<Sample>& out) {
    using Take = recording::TableReader::Take;
    recording::Row row;
    for (Take take = table_.take(row); take != Take::none; take = table_.take(row)) {
      const recording::Line& line = table_.line();
      if (take == Take::malformed) count_malformed(line.text);
      if (take != Take::malformed) tally_.understood += line.bytes;
      if (take == Take::row) {
        if (tally_.samples == 0) name_columns();
        const auto board_s = table_.has_time() ? std::optional(row.t_s) : std::nullopt;
        count_sample();
        out.push_back({line.host_s, board_s, row.value, {}});
      } else if (tally_.samples > 0 && table_.found() != table_.header().size()) {
        count_misfit(table_.found(), table_.header().size());
      }
    }
  }

  void name_columns() {
    std::vector<std::string> names = table_.columns();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::string& unit = table_.units()[i];
      if (!unit.empty() && recording::unit_of(names[i]).empty()) names[i] += "_" + unit;
    }
    columns_ = without_clashes(names);
  }

  bool may_be_piece_ = false;
  recording::LineSplitter splitter_{kLongestLine};
  recording::Line line_;
  recording::TableReader table_{
      {.columns = {}, .holes = recording::Holes::all, .from = recording::From::port}};
};

std::optional<Guess> judge(std::span<const std::uint8_t> bytes, Format format, bool readings) {
  constexpr std::uint64_t kFewestSamples = 3;
  constexpr std::uint64_t kFewestFrameBytes = 2 * 13;  // two states
  const auto decoder = make_decoder(format, readings);
  std::vector<Sample> samples;
  decoder->push(bytes, 0, samples);
  const Tally& tally = decoder->tally();
  const bool waits = format != Format::lines && tally.samples == 0 && tally.understood >= kFewestFrameBytes;
  if (tally.samples < (format == Format::hand ? 1 : kFewestSamples) && !waits) return {};
  const double share = static_cast<double>(tally.understood) / static_cast<double>(tally.bytes);
  if (share < 0.5) return {};
  return Guess{decoder->is_for_drivers() ? Format::gloves : format, readings, share, tally.samples};
}

}  // namespace

std::string lost_in_words(const Tally& tally) {
  return (tally.lost ? fmt::format("{} lost", *tally.lost) : "not known how many were lost") +
         (tally.late > 0 ? fmt::format(", {} twice or late", tally.late) : "");
}

std::string misfit_in_words(const Misfit& misfit) {
  if (misfit.found == 0)
    return fmt::format("the lines that come are no rows of numbers, and {} values are expected",
                       misfit.expected);
  return fmt::format("the rows that come have {} values, and {} are expected", misfit.found, misfit.expected);
}

const char* name_of(Format format) {
  static constexpr std::array kNames = {"Flexor's frames", "a hand's telemetry", "text for VR drivers",
                                        "lines of numbers"};
  return kNames.at(static_cast<std::size_t>(format));
}

std::unique_ptr<Decoder> make_decoder(Format format, bool readings) {
  if (format == Format::frames) return std::make_unique<GloveFrames>(readings);
  if (format == Format::hand) return std::make_unique<HandFrames>();
  return std::make_unique<LineDecoder>();
}

std::optional<Guess> guess(std::span<const std::uint8_t> bytes, bool readings) {
  if (readings) {
    const std::optional<Guess> frames = judge(bytes, Format::frames, true);
    if (frames && frames->samples > 0) return frames;  // nothing else speaks so
  }
  std::optional<Guess> best;
  for (const Format format : {Format::frames, Format::hand, Format::lines}) {
    const std::optional<Guess> now = judge(bytes, format, false);
    if (now && (!best || now->share > best->share)) best = now;
  }
  return best;
}

}  // namespace flexor::listen
