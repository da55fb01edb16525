#include "host/listen/decoder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "host/recording/line_format.hpp"
#include "host/recording/lines.hpp"
#include "host/recording/time.hpp"
#include "host/recording/unit.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::listen {
namespace {

constexpr std::array<const char*, 5> kFingerNames = {"thumb", "index", "middle", "ring", "pinky"};
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLongestLine = 4096;  // bytes; beyond it is no line of a glove's

// A clock of 16 bits in milliseconds, which wraps every 65.5 s, made whole by the host's.
class WrappingClock {
 public:
  double seconds(std::uint16_t now_ms, double host_s) {
    constexpr double kWrap_ms = 65536;
    if (!started_) {
      started_ = true;
      total_ms_ = now_ms;
    } else {
      const double step_ms = static_cast<std::uint16_t>(now_ms - last_ms_);
      const double wraps = std::max(0.0, std::round((1000 * (host_s - host_s_) - step_ms) / kWrap_ms));
      total_ms_ += step_ms + wraps * kWrap_ms;
    }
    last_ms_ = now_ms;
    host_s_ = host_s;
    return total_ms_ / 1000;
  }

 private:
  bool started_ = false;
  std::uint16_t last_ms_ = 0;
  double total_ms_ = 0;
  double host_s_ = 0;
};

// What one of both boards says in frames, of which some are samples.
class FrameDecoder : public Decoder {
 public:
  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) final {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      ++held_;
      const link::Received result = packet_.push(byte);
      if (byte != link::kDelimiter) continue;
      const std::uint64_t size = held_;
      held_ = 0;
      if (size == 1) tally_.understood += 1;  // a delimiter alone
      if (result == link::Received::nothing) continue;
      if (result != link::Received::pending) {
        ++tally_.torn;
        continue;
      }
      if (!is_its_own()) continue;
      tally_.understood += size;
      if (is_sample()) take(host_s, out);
    }
  }

  void cut() final {
    if (held_ > 0) ++tally_.torn;
    held_ = 0;
    (void)packet_.push(link::kDelimiter);
  }

 protected:
  virtual bool is_its_own() = 0;  // the frame is of this board
  virtual bool is_sample() const = 0;
  virtual bool read(std::uint16_t& time_ms, Sample& sample) = 0;

  bool is_state_of(link::BoardKind board) const {
    return packet_.type() == link::Type::state && packet_.body_bytes() == link::State::kBytes &&
           link::get_state(packet_.body()).board == board;
  }

  // A counter that starts anew, as with each challenge, is no gap.
  void count_gap() {
    constexpr std::uint16_t kLongestGap = 1000;
    const std::uint16_t sequence = packet_.sequence();
    const auto gap = static_cast<std::uint16_t>(sequence - next_);
    tally_.lost = tally_.lost.value_or(0) + (tally_.samples > 0 && gap < kLongestGap ? gap : 0);
    next_ = static_cast<std::uint16_t>(sequence + 1);
  }

  link::PacketReader packet_;

 private:
  void take(double host_s, std::vector<Sample>& out) {
    std::uint16_t time_ms = 0;
    Sample sample;
    if (!read(time_ms, sample)) {
      ++tally_.torn;
      return;
    }
    sample.host_s = host_s;
    sample.board_s = clock_.seconds(time_ms, host_s);
    count_sample();
    out.push_back(std::move(sample));
  }

  WrappingClock clock_;
  std::uint64_t held_ = 0;
  std::uint16_t next_ = 0;
};

const char* remark_of(link::SensorStatus status) {
  switch (status) {
    case link::SensorStatus::ok:
      return "";
    case link::SensorStatus::open:
      return "broken wire";
    case link::SensorStatus::short_circuit:
      return "short circuit";
    case link::SensorStatus::stuck:
      break;
  }
  return "stuck";
}

class GloveFrames : public FrameDecoder {
 public:
  explicit GloveFrames(bool readings) : wanted_(readings ? link::Type::readings : link::Type::angles) {}
  // Its angles would wait for the hand's challenge; readings carry no tag in any case: nobody moves by them.
  std::string remark() const override {
    if (wanted_ == link::Type::angles || !waits_for_hand_) return {};
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
  bool is_sample() const override { return packet_.type() == wanted_; }
  bool read(std::uint16_t& time_ms, Sample& sample) override {
    return wanted_ == link::Type::angles ? angles(time_ms, sample) : readings(time_ms, sample);
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
      sample.remark.emplace_back(remark_of(status.at(i)));
    }
    count_gap();
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

  // The first frame says how many there are.
  bool fits(std::size_t count, const char* unit) {
    for (std::size_t i = columns_.size(); tally_.samples == 0 && i < count; ++i) {
      columns_.push_back(count == kFingerNames.size() ? fmt::format("{}_{}", kFingerNames.at(i), unit)
                                                      : fmt::format("joint{}_{}", i + 1, unit));
    }
    if (columns_.size() != count) count_misfit(count, columns_.size());
    return columns_.size() == count;
  }

  link::Type wanted_;
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
  for (std::size_t bit = 0; bit < kNames.size(); ++bit) {
    if ((faults >> bit & 1) != 0) out += (out.empty() ? "" : ", ") + std::string(kNames.at(bit));
  }
  return out;
}

class HandFrames : public FrameDecoder {
 public:
  HandFrames() {
    for (const char* unit : {"deg", "duty_percent", "fault"}) {
      for (const char* finger : kFingerNames) columns_.push_back(fmt::format("{}_{}", finger, unit));
    }
    columns_.emplace_back("board_faults");
  }

 protected:
  bool is_its_own() override {
    const link::Type type = packet_.type();
    const bool state = is_state_of(link::BoardKind::hand);
    if (state) count_gap();
    return state || type == link::Type::telemetry || type == link::Type::challenge;
  }
  bool is_sample() const override { return packet_.type() == link::Type::telemetry; }
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
    count_gap();
    return true;
  }
};

// What comes as lines.
class TextDecoder : public Decoder {
 public:
  void push(std::span<const std::uint8_t> bytes, double host_s, std::vector<Sample>& out) final {
    for (const std::uint8_t byte : bytes) {
      ++tally_.bytes;
      if (byte != '\n') {
        if (line_.size() <= kLongestLine) line_ += static_cast<char>(byte);
        continue;
      }
      const std::uint64_t size = line_.size() + 1;
      if (!line_.empty() && line_.back() == '\r') line_.pop_back();
      if (std::exchange(is_piece_, false)) {
        if (size <= kLongestLine) take_piece(line_);
      } else if (size <= kLongestLine && take(line_, host_s, out)) {
        tally_.understood += size;
      } else {
        ++tally_.torn;
      }
      line_.clear();
    }
  }

  void cut() override {
    if (!is_piece_ && !line_.empty()) ++tally_.torn;
    line_.clear();
    is_piece_ = true;
  }

 protected:
  virtual bool take(const std::string& line, double host_s, std::vector<Sample>& out) = 0;
  // The first line of a port, which as a rule is the end of one.
  virtual void take_piece(const std::string& /*line*/) {}

  void give(Sample sample, std::vector<Sample>& out) {
    count_sample();
    out.push_back(std::move(sample));
  }

 private:
  std::string line_;
  bool is_piece_ = false;
};

bool is_name(std::string_view cell) {
  return !recording::is_missing(cell) && !recording::to_number(cell) && !recording::to_time(cell);
}

bool is_written_time(std::string_view cell) {
  const auto time = recording::to_time(cell);
  return time && time->format != recording::TimeFormat::number;
}

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

// `keyed`: text for VR drivers, and nothing else.
class LineDecoder : public TextDecoder {
 public:
  explicit LineDecoder(bool keyed) : keyed_(keyed) {}
  void cut() override {
    TextDecoder::cut();
    is_fresh_ = true;
  }
  std::string refusal() const override { return refusal_; }

 protected:
  bool take(const std::string& line, double host_s, std::vector<Sample>& out) override {
    std::string text(recording::trimmed(line));
    if (!recording::is_utf8(text)) text = recording::latin1_to_utf8(text);
    std::string monitor_time;
    (void)recording::cut_at_arrow(text, monitor_time);
    if (text.empty() || text.front() == '#' || !refusal_.empty()) return true;
    if (!split(text) && tally_.samples > 0) count_misfit(0, names_.size());
    if (cells_.label.empty() && (keyed_ || cells_.layout != recording::Layout::table))
      return keyed_ && cells_.layout == recording::Layout::keyed;  // what the glove is
    if (!cells_.label.empty() && !take_labels()) return false;
    std::vector<std::string>& cells = cells_.value;
    while (cells.size() > std::max<std::size_t>(names_.size(), 1) && cells.back().empty()) cells.pop_back();
    const bool is_header =
        cells_.label.empty() && std::ranges::all_of(cells, is_name) &&
        std::ranges::none_of(cells, [this](const auto& cell) { return number(cell).has_value(); });
    const bool is_row =
        !is_header || (!cells[0].empty() && number(cells[0].substr(0, 1)));  // "1;2" is a name, too
    if (has_header_ && tally_.samples == 0 && cells.size() == names_.size()) {
      if (recording::is_units_row(cells)) return take_units(cells);
      if (!is_header) find_time(cells);
    }
    if (!is_header && cells.size() == order_.size()) cells = in_own_order(order_, std::move(cells));
    std::vector<double> numbers = is_header ? std::vector<double>() : numbers_in(cells);
    const bool is_text = !is_row || (numbers.empty() && cells.size() == names_.size());
    const std::size_t found = is_text ? 0 : cells.size();
    if (tally_.samples > 0 && found != names_.size() && (is_text || found != other_.size()))
      count_misfit(found, names_.size());
    if (is_header) return take_header(cells);
    if (numbers.empty()) return false;
    if (names_.empty() && !take_names(cells)) return true;
    if (is_anothers(numbers.size())) return true;
    if (numbers.size() != names_.size()) return false;
    is_fresh_ = false;
    if (time_ && std::isnan(numbers[*time_])) return false;
    Sample sample{host_s, {}, {}, {}};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (time_ == i) {
        sample.board_s = numbers[i] * unit_s_;
      } else if (!is_text_[i]) {
        sample.value.push_back(numbers[i]);
      }
    }
    give(std::move(sample), out);
    return true;
  }

  // A board that starts when its port is opened begins with its header.
  void take_piece(const std::string& line) override {
    const char separator = separator_ == 0 ? recording::separator_of(line) : separator_;
    std::vector<std::string> cells;
    recording::split(line, separator, cells);
    if (keyed_ || cells.size() < 2 || !std::ranges::all_of(cells, is_name)) return;
    separator_ = separator;
    take_header(cells);
  }

 private:
  // Into cells_; false, and no cells, where it is no line of this format.
  bool split(const std::string& text) {
    const bool has_labels = recording::read_labelled(text, cells_);
    if (has_labels && (cells_.layout == recording::Layout::keyed) == keyed_) return true;
    cells_ = {has_labels ? recording::Layout::labelled : recording::Layout::table, {}, {}};
    if (has_labels || keyed_) return false;
    if (names_.empty() || (has_header_ && tally_.samples == 0)) separator_ = recording::separator_of(text);
    recording::split(text, separator_, cells_.value);
    return true;
  }

  // A labelled row says itself whose it is; another glove's are known by two alike, for a label may be torn. Text for VR drivers
  // has the fingers that it has.
  bool take_labels() {
    const std::vector<std::string>& label = cells_.label;
    std::vector<std::string> value = in_own_order(label, cells_.value);
    if (!names_.empty() && value.size() == names_.size() && (keyed_ || label.size() == value.size())) {
      cells_.value = std::move(value);
      order_.clear();
      other_.clear();
      return true;
    }
    if (keyed_ && !names_.empty()) {
      count_misfit(label.size(), names_.size());
      return false;
    }
    const bool is_again = !other_.empty() && label == other_;
    if (take_header(label)) return true;
    if (is_again) is_anothers(label.size());
    return false;
  }

  std::optional<double> number(std::string_view cell) const {
    const auto parsed = recording::read_number(cell, separator_);
    if (!parsed || !recording::is_measurement(parsed->value)) return {};
    return parsed->value;
  }

  // A sensor that is dead is missing, NaN, beside others that are not, once it is known what the columns are. Empty: torn.
  std::vector<double> numbers_in(const std::vector<std::string>& cells) const {
    std::vector<double> out;
    for (const std::string& cell : cells) {
      const bool is_written = (time_ == out.size() || names_.empty()) && is_written_time(cell);
      const bool is_missing = !names_.empty() && (recording::is_missing(cell) || is_text_[out.size()]);
      const std::optional<double> value = is_missing   ? kMissing
                                          : is_written ? recording::to_time(cell)->value
                                                       : number(cell);
      if (!value) return {};
      out.push_back(*value);
    }
    return std::ranges::all_of(out, [](double value) { return std::isnan(value); }) ? std::vector<double>()
                                                                                    : out;
  }

  // By the first row: a written time beats a number without a unit; words are no readings, nor is a date beside its clock.
  void find_time(const std::vector<std::string>& cells) {
    std::optional<double> unit_s;
    const bool states_unit = time_ && recording::is_time_name(names_[*time_], unit_s) && unit_s;
    const auto written = std::ranges::find_if(cells, is_written_time);
    if (written != cells.end() && !states_unit && !(time_ && is_written_time(cells[*time_])))
      time_ = static_cast<std::size_t>(written - cells.begin());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const bool is_read = recording::is_missing(cells[i]) || recording::read_number(cells[i], separator_);
      const bool is_word = !cells[i].empty() && std::isalpha(static_cast<unsigned char>(cells[i][0])) != 0;
      is_text_[i] = !is_read && time_ != i && (is_word || recording::is_time_name(names_[i], unit_s));
    }
    const auto words = static_cast<std::size_t>(std::ranges::count(is_text_, true));
    if (words + (time_ ? 1 : 0) == cells.size()) is_text_.assign(cells.size(), false);  // a torn row
    name_columns();
  }

  // Of a row below the header.
  bool take_units(const std::vector<std::string>& cells) {
    for (std::size_t i = 0, column = 0; i < cells.size(); ++i) {
      if (time_ == i) unit_s_ = recording::seconds_in(cells[i]).value_or(unit_s_);
      if (time_ == i || is_text_[i]) continue;
      std::string& name = columns_[column++];
      const auto unit = recording::known_unit(cells[i]);
      if (unit && recording::unit_of(name).empty()) name += "_" + *unit;
    }
    return true;
  }

  // The header again, as after a reset of the board, is no sample and nothing torn.
  bool take_header(const std::vector<std::string>& names) {
    if (tally_.samples > 0) return take_later_header(names);
    if (names == names_) return true;
    if (names.size() < 2 && !keyed_) {
      separator_ = 0;  // a greeting
      return false;
    }
    names_ = names;
    has_header_ = true;
    time_.reset();
    is_text_.clear();
    std::optional<double> unit_s;
    for (std::size_t i = 0; i < names_.size() && !time_; ++i) {
      if (recording::is_time_name(names_[i], unit_s)) time_ = i;
    }
    if (time_) unit_s_ = unit_s.value_or(1);
    name_columns();
    return true;
  }

  // Of the glove that was plugged in again, or another. A greeting shares no name with a header, and where nothing was
  // plugged in a greeting is all that it can be. Without a header before, no name is wrong.
  bool take_later_header(const std::vector<std::string>& names) {
    if (std::vector<std::string> order = ordered_as(names); !order.empty()) {
      order_ = std::move(order);
      other_.clear();
      return true;
    }
    const bool shares = std::ranges::any_of(
        names, [this](const std::string& name) { return std::ranges::find(names_, name) != names_.end(); });
    if (has_header_ && names.size() > 1 && (is_fresh_ || shares)) other_ = names;
    return false;
  }

  // The names of the first header as this one orders them; empty: they are not the same. The first one may be torn, or stand
  // behind half a row.
  std::vector<std::string> ordered_as(std::vector<std::string> names) const {
    for (const std::string& name : names_) {
      const bool is_torn = names[0].ends_with(name) || name.ends_with(names[0]);
      if (is_torn && std::ranges::count(names, name) == 0) names[0] = name;
    }
    return std::ranges::is_permutation(names, names_) ? names : std::vector<std::string>();
  }

  // Cells under `names` in the order of the first header, as far as they are there.
  std::vector<std::string> in_own_order(const std::vector<std::string>& names,
                                        std::vector<std::string> cells) const {
    if (names.empty() || names == names_) return cells;
    std::vector<std::string> out;
    for (const std::string& name : names_) {
      const auto at = static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
      if (at < cells.size()) out.push_back(cells[at]);
    }
    return out;
  }

  // Whether a row of so many numbers is of the other header that came last.
  bool is_anothers(std::size_t count) {
    if (other_.empty()) return false;
    if (count == other_.size()) {
      refusal_ = fmt::format("another glove speaks: its columns are {}, and they were {}",
                             fmt::join(other_, ","), fmt::join(names_, ","));
    }
    other_.clear();
    return !refusal_.empty();
  }

  // Without a header only times of day are a clock for sure. The first line may be half a one: two must agree.
  bool take_names(const std::vector<std::string>& cells) {
    const std::size_t count = cells.size();
    if (std::exchange(count_before_, count) != count) return false;
    for (std::size_t i = 0; i < count; ++i) {
      names_.push_back(fmt::format("column{}", i + 1));
      if (!time_ && !number(cells[i])) time_ = i;
    }
    name_columns();
    return true;
  }

  void name_columns() {
    is_text_.resize(names_.size());
    columns_.clear();
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (time_ != i && !is_text_[i]) columns_.push_back(names_[i]);
    }
    columns_ = without_clashes(columns_);
  }

  bool keyed_;
  char separator_ = 0;
  recording::Cells cells_;
  std::vector<std::string> names_;
  std::size_t count_before_ = 0;
  std::optional<std::size_t> time_;
  std::vector<bool> is_text_;  // columns of words
  bool has_header_ = false;
  bool is_fresh_ = false;           // plugged in, and no row came yet
  std::vector<std::string> order_;  // of the header that came last; empty: that of the first
  std::vector<std::string> other_;  // a header with other names; no row came yet
  std::string refusal_;
  double unit_s_ = 1;
};

// None: too little of it for this format.
std::optional<Guess> judge(std::span<const std::uint8_t> bytes, Format format, bool readings) {
  constexpr std::uint64_t kFewestSamples = 3;
  constexpr std::uint64_t kFewestFrameBytes = 2 * 13;  // two states
  const auto decoder = make_decoder(format, readings);
  std::vector<Sample> samples;
  decoder->push(bytes, 0, samples);
  const Tally& tally = decoder->tally();
  const bool frames = format == Format::frames || format == Format::hand;
  const bool waits = frames && tally.samples == 0 && tally.understood >= kFewestFrameBytes;
  if (tally.samples < (format == Format::hand ? 1 : kFewestSamples) && !waits) return {};
  const double share = static_cast<double>(tally.understood) / static_cast<double>(tally.bytes);
  if (share < 0.5) return {};
  return Guess{format, readings, share, tally.samples};
}

}  // namespace

std::string lost_in_words(const Tally& tally) {
  return tally.lost ? fmt::format("{} lost", *tally.lost) : "not known how many were lost";
}

std::string misfit_in_words(const Misfit& misfit) {
  if (misfit.found == 0)
    return fmt::format("the lines that come are no rows of numbers, and {} values are expected",
                       misfit.expected);
  return fmt::format("the rows that come have {} values, and {} are expected", misfit.found, misfit.expected);
}

const char* name_of(Format format) {
  switch (format) {
    case Format::frames:
      return "Flexor's frames";
    case Format::hand:
      return "a hand's telemetry";
    case Format::gloves:
      return "text for VR drivers";
    case Format::lines:
      break;
  }
  return "lines of numbers";
}

std::unique_ptr<Decoder> make_decoder(Format format, bool readings) {
  switch (format) {
    case Format::frames:
      return std::make_unique<GloveFrames>(readings);
    case Format::hand:
      return std::make_unique<HandFrames>();
    case Format::gloves:
      return std::make_unique<LineDecoder>(true);
    case Format::lines:
      break;
  }
  return std::make_unique<LineDecoder>(false);
}

std::optional<Guess> guess(std::span<const std::uint8_t> bytes, bool readings) {
  if (readings) {
    const std::optional<Guess> frames = judge(bytes, Format::frames, true);
    if (frames && frames->samples > 0) return frames;  // nothing else speaks so
  }
  std::optional<Guess> best;
  for (const Format format : {Format::frames, Format::hand, Format::gloves, Format::lines}) {
    const std::optional<Guess> now = judge(bytes, format, false);
    if (now && (!best || now->share > best->share)) best = now;
  }
  return best;
}

}  // namespace flexor::listen
