#include "apps/live/command.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <regex>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kLongestOutput = 64 << 20;

// A job that nobody waits for any more ends.
std::vector<std::string> as_job(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"flexor", "--ends-with", std::to_string(getpid())});
  arguments.emplace_back("--json");
  return arguments;
}

// What there is; false: the other end has gone.
bool read_into(int descriptor, std::string& text) {
  std::array<char, 4096> buffer{};
  const ssize_t n = ::read(descriptor, buffer.data(), buffer.size());
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  if (n <= 0) return false;
  if (text.size() < kLongestOutput) text.append(buffer.data(), static_cast<std::size_t>(n));
  return true;
}

std::string without_name(const std::string& line) {
  constexpr std::string_view kName = "flexor: ";
  return line.starts_with(kName) ? line.substr(kName.size()) : line;
}

}  // namespace

Progress progress_of(const std::string& line) {
  static const std::regex counted(R"((.*?),? (\d+) of (\d+)(?:, about (\d+) s left)?)");
  std::smatch found;
  if (!std::regex_match(line, found, counted)) return {line, {}, {}};
  const double of = std::stod(found[3]);
  Progress out{found[1], {}, {}};
  if (of > 0) out.share = std::stod(found[2]) / of;
  if (found[4].matched) out.left_s = std::stod(found[4]);
  return out;
}

Command::Command(const std::filesystem::path& program, std::vector<std::string> arguments,
                 std::function<void(const Progress&)> progress, std::function<void(CommandResult)> done)
    : process_(program, as_job(std::move(arguments)),
               {{out_.end(1), STDOUT_FILENO}, {err_.end(1), STDERR_FILENO}}) {
  out_.close_end(1);
  err_.close_end(1);
  thread_ =
      std::thread([this, progress = std::move(progress), done = std::move(done)] { done(follow(progress)); });
}

Command::~Command() {
  cancel();
  thread_.join();
}

void Command::cancel() {
  if (!cancelled_.exchange(true)) process_.kill();
}

CommandResult Command::follow(const std::function<void(const Progress&)>& progress) {
  std::string out;
  std::string err;
  std::string last;
  CommandResult result;
  std::array<pollfd, 2> ends{{{out_.end(0), POLLIN, 0}, {err_.end(0), POLLIN, 0}}};
  const auto take_lines = [&] {
    for (std::size_t end = 0; (end = err.find('\n')) != std::string::npos; err.erase(0, end + 1)) {
      last = err.substr(0, end);
      progress(progress_of(last));
    }
  };
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    if (::poll(ends.data(), ends.size(), -1) < 0) continue;
    if (ends[0].revents != 0 && !read_into(ends[0].fd, out)) ends[0].fd = -1;
    if (ends[1].revents != 0 && !read_into(ends[1].fd, err)) ends[1].fd = -1;
    take_lines();
  }
  if (!err.empty()) last = err;
  const int status = process_.wait();
  result.ok = status == 0 && !cancelled_;
  result.text = cancelled_ ? "ended before its time" : without_name(last);
  if (!result.ok && result.text.empty())
    result.text = status > 128 ? fmt::format("ended by signal {}", status - 128)
                               : fmt::format("ended with exit code {} and no word", status);
  if (!result.ok) return result;
  try {
    result.json = io::parse_json(out, "its result");
    for (const auto& warning : result.json.value("warnings", nlohmann::ordered_json::array()))
      result.warnings.push_back(warning.get<std::string>());
  } catch (const std::exception& error) {
    result.ok = false;
    result.text = error.what();
  }
  return result;
}

}  // namespace flexor::live
