// A glove at a port for FLEXOR_SOAK_S seconds (script/soak live), pulled out and plugged in again, with four tabs that
// read and one that never does: what reaches the recording, how late the tabs receive it, what it costs.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <mutex>
#include <sstream>

#include "apps/live/program_test.hpp"
#include "host/listen/test_board.hpp"
#include "host/recording/csv.hpp"

namespace flexor::live {
namespace soak_test {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double soak_s() {
  const char* text = std::getenv("FLEXOR_SOAK_S");
  return text != nullptr ? std::stod(text) : 6;
}

constexpr int kChannels = 5;
constexpr int kWrap = 100000;  // of the first channel, which counts the rows

// A glove that sends a line of five numbers `rate_hz` times a second, at a path that stays.
class Glove {
 public:
  Glove(std::filesystem::path port, double rate_hz) : port_(std::move(port)), rate_hz_(rate_hz) { plug(); }

  void plug() {
    is_on_ = is_new_ = true;
    const auto sends = [this, begin_s = now_s(), first = rows()](const std::string&) {
      return is_on_ ? until(first + static_cast<std::uint64_t>(rate_hz_ * (now_s() - begin_s))) : "";
    };
    board_.emplace(sends);
    std::filesystem::create_symlink(board_->port(), port_);
  }
  // At the end of a line that has been read: what is lost then is nobody's but the board's.
  void unplug() {
    is_on_ = false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    std::filesystem::remove(port_);
    board_.reset();
  }
  std::uint64_t rows() const { return rows_; }
  // When the row that counts `count` was written, of the last ones; NaN: too long ago.
  double written_s(int count) const {
    const std::lock_guard lock(mutex_);
    return written_[static_cast<std::size_t>(count) % written_.size()];
  }

 private:
  std::string until(std::uint64_t rows) {
    const std::lock_guard lock(mutex_);
    std::string text =
        std::exchange(is_new_, false) ? "thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg\n" : "";
    for (; rows_ < rows; ++rows_) {
      const int count = static_cast<int>(rows_ % kWrap);
      const double t_s = static_cast<double>(rows_) / rate_hz_;
      text += std::to_string(count);
      for (int k = 1; k < kChannels; ++k) text += fmt::format(",{:.0f}", 500 + 300 * std::sin(t_s * k));
      text += '\n';
      written_[static_cast<std::size_t>(count) % written_.size()] = now_s();
    }
    return text;
  }

  std::filesystem::path port_;
  double rate_hz_;
  bool is_new_ = true;  // its header comes first
  std::atomic<bool> is_on_ = false;
  std::atomic<std::uint64_t> rows_ = 0;
  mutable std::mutex mutex_;
  std::array<double, 8192> written_{};
  std::optional<listen::Board> board_;
};

// A tab that reads: how late each row is, and how many came.
class Reader {
 public:
  Reader(const Place& place, const Glove& glove)
      : tab_(place), thread_([this, &glove](const std::stop_token& stop) { read(stop, glove); }) {}
  void stop() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  std::vector<double> late_s;
  std::uint64_t angles = 0;  // of the first finger that the model made
  bool dropped = false;

 private:
  void read(const std::stop_token& stop, const Glove& glove) {
    constexpr std::size_t kRow = 8 + kChannels * 8;
    while (!stop.stop_requested()) {
      const auto [opcode, bytes] = tab_.receive(1);
      if (tab_.ended()) dropped = true;
      if (dropped) return;
      if (opcode == kPing) tab_.put(frame(kPong, bytes));
      if (opcode != kBinary || bytes.size() < 4 + kRow || bytes[0] != 1 || bytes[1] != kChannels) continue;
      const double received_s = now_s();
      for (std::size_t at = 4; at + kRow <= bytes.size(); at += kRow) {
        float count = 0;
        float angle_deg = NAN;
        std::memcpy(&count, bytes.data() + at + 8, sizeof count);
        std::memcpy(&angle_deg, bytes.data() + at + 8 + 4 * kChannels, sizeof angle_deg);
        angles += std::isfinite(angle_deg) ? 1 : 0;
        if (late_s.size() < 1000000) late_s.push_back(received_s - glove.written_s(static_cast<int>(count)));
      }
    }
  }
  Tab tab_;
  std::jthread thread_;
};

struct Logged {
  std::uint64_t rows = 0;
  std::uint64_t gaps = 0;  // rows whose first value does not follow the one before
  int last = -1;
};
Logged read_log(const std::filesystem::path& sessions) {
  Logged out;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(sessions)) {
    if (entry.path().filename() != "log.csv") continue;
    const recording::Recording log = recording::read_csv(entry.path(), {"thumb_deg"});
    for (const double value : log.columns.front().value) {
      const int count = static_cast<int>(std::lround(value));
      if (out.last >= 0 && count != (out.last + 1) % kWrap) ++out.gaps;
      out.last = count;
      ++out.rows;
    }
  }
  return out;
}

struct Soaked {
  Logged log;
  std::uint64_t sent = 0;      // while it was recorded
  std::vector<double> late_s;  // sorted
  double processor_share = 0;
  double memory_mb = 0;       // half way: a busy machine takes long until all that it needs is loaded
  double memory_more_mb = 0;  // at the end
  std::uint64_t angles = 0;   // received
  int dropped = 0;            // of the tabs that read
  int replugged = 0;
};

class LiveSoak : public Program {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }

  // By a tab of its own: one that does not read would be dropped.
  bool asked(const char* what) {
    tab_.emplace(*place_);
    const bool ok = ask({{"do", what}}).value("ok", false);
    tab_.reset();
    return ok;
  }
  // Field `number` of a file that /proc has of the program, counted from 0.
  double field(const char* file, int number) const {
    std::istringstream fields(io::read_file("/proc/" + std::to_string(child_) + "/" + file));
    std::string field;
    for (int i = 0; i <= number; ++i) fields >> field;
    return std::stod(field);
  }
  // Seconds of processor time so far.
  double processor_s() const {
    return (field("stat", 13) + field("stat", 14)) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }
  double memory_mb() const { return field("statm", 1) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6; }
  Soaked soak(double rate_hz, double seconds, double replug_every_s);

  int child_ = 0;
};

Soaked LiveSoak::soak(double rate_hz, double seconds, double replug_every_s) {
  const auto port = folder_.path() / "port";
  Glove glove(port, rate_hz);
  begin({"--port", port.string(), "--model", FLEXOR_SOURCE_DIR "/models/published_hw.json"});
  std::ifstream("/proc/thread-self/children") >> child_;
  Soaked out;
  state_when([](const Json& s) { return s.value("/fingers/0/name"_json_pointer, "") != std::string(); });
  std::vector<std::unique_ptr<Reader>> readers;
  for (int i = 0; i < 4; ++i) readers.push_back(std::make_unique<Reader>(*place_, glove));
  auto never_reads = std::make_unique<Tab>(*place_, "", 4096);
  EXPECT_TRUE(asked("record.start"));
  std::this_thread::sleep_for(std::chrono::duration<double>(std::min(20.0, seconds / 4)));
  const double used_s = processor_s();
  const double begin_s = now_s();
  double replug_s = begin_s + replug_every_s;
  while (now_s() < begin_s + seconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (out.memory_mb == 0 && now_s() > begin_s + seconds / 2) out.memory_mb = memory_mb();
    if (replug_every_s <= 0 || now_s() < replug_s) continue;
    replug_s += replug_every_s;
    glove.unplug();
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    glove.plug();
    never_reads = std::make_unique<Tab>(*place_, "", 4096);  // the one before was dropped
    ++out.replugged;
  }
  out.processor_share = (processor_s() - used_s) / (now_s() - begin_s);
  out.memory_more_mb = memory_mb() - out.memory_mb;
  glove.unplug();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(asked("record.stop"));
  for (auto& reader : readers) {
    reader->stop();
    out.dropped += reader->dropped ? 1 : 0;
    out.angles += reader->angles;
    out.late_s.insert(out.late_s.end(), reader->late_s.begin(), reader->late_s.end());
  }
  std::sort(out.late_s.begin(), out.late_s.end());
  out.log = read_log(folder_.path() / "sessions");
  out.sent = glove.rows();
  return out;
}

void print(const char* what, const Soaked& soaked) {
  const auto late_ms = [&](double share) {
    const auto& all = soaked.late_s;
    return all.empty() ? NAN
                       : 1e3 * all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))];
  };
  fmt::print(
      "{}: {} rows logged, {} gaps, plugged in again {} times; delay to four tabs: median {:.2f} "
      "ms, 99th percentile {:.2f} ms; {:.1f} % of a core; {:.1f} MB and {:+.1f} MB\n",
      what, soaked.log.rows, soaked.log.gaps, soaked.replugged, late_ms(0.5), late_ms(0.99),
      100 * soaked.processor_share, soaked.memory_mb, soaked.memory_more_mb);
}

// Everything that the board sent from the first logged row on.
void expect_nothing_lost(const Soaked& soaked) {
  EXPECT_GT(soaked.log.rows, 0U);
  EXPECT_EQ(soaked.log.gaps, 0U);
  EXPECT_EQ(soaked.log.last, static_cast<int>((soaked.sent - 1) % kWrap));
  EXPECT_EQ(soaked.dropped, 0);
  EXPECT_LT(soaked.memory_more_mb, 4);
  EXPECT_GT(soaked.angles, soaked.log.rows) << "the model is worn";
}

TEST_F(LiveSoak, PluggedInAgainNothingIsLost) {
  const double seconds = soak_s();
  const Soaked soaked = soak(100, seconds, std::min(60.0, seconds / 4));
  print("100 rows/s", soaked);
  expect_nothing_lost(soaked);
  EXPECT_GE(soaked.replugged, 3);
}

TEST_F(LiveSoak, TenThousandRowsASecond) {
  const double seconds = std::min(600.0, soak_s());
  const Soaked soaked = soak(10000, seconds, 0);
  print("10000 rows/s", soaked);
  expect_nothing_lost(soaked);
  EXPECT_GT(static_cast<double>(soaked.log.rows), 9000 * seconds);
  EXPECT_LT(soaked.processor_share, 0.3);
}

}  // namespace soak_test
}  // namespace flexor::live
