#include "host/io/process.hpp"

#include <cerrno>
#include <chrono>
#include <sstream>
#include <thread>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"

namespace flexor::io {

Process::~Process() { (void)wait_at_most(0); }

int Process::wait() {
  (void)is_over(true);
  return status_;
}

int Process::wait_at_most(int ms) {
  for (; !is_over(false) && ms > 0; --ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!is_over(false)) kill();
  return wait();
}

std::filesystem::path find_program(const std::string& name) {
  if (name.find('/') != std::string::npos)
    return access(std::filesystem::path(name).c_str(), X_OK) == 0 ? name : "";
  const char* path = std::getenv("PATH");
  std::istringstream folders(this_program().parent_path().string() + kBetweenFolders +
                             (path != nullptr ? path : ""));
  for (std::string folder; std::getline(folders, folder, kBetweenFolders);) {
    auto candidate = std::filesystem::path(folder) / (name + kProgramSuffix);
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

namespace {

// Both streams to their ends. False: it was silent for too long.
bool read_streams(const std::array<int, 2>& streams, ProcessResult& result, const Watch& watch) {
  std::array<Waiting, 2> waiting{{{streams[0], kToRead, 0}, {streams[1], kToRead, 0}}};
  const std::array<std::string*, 2> text{&result.out, &result.err};
  while (waiting[0].fd >= 0 || waiting[1].fd >= 0) {
    const int ready = poll(waiting.data(), waiting.size(), watch.longest_silence_ms);
    if (ready == 0) return false;
    if (ready < 0 && errno != EINTR) break;
    go_on();
    if (ready < 0) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      if (waiting[i].fd < 0 || waiting[i].revents == 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t n = read(waiting[i].fd, buffer.data(), buffer.size());
      if (n > 0) text[i]->append(buffer.data(), static_cast<std::size_t>(n));
      if (n == 0 || (n < 0 && errno != EINTR)) waiting[i].fd = -1;
      if (n > 0 && i == 1 && watch.on_err) watch.on_err(result.err);
    }
  }
  return true;
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& argv, const std::filesystem::path& temporaries,
                          const Watch& watch) {
  const auto program = find_program(argv.front());
  if (program.empty()) throw InputError("{}: no such program", argv.front());
  Pipe out;
  Pipe err;
  ProcessResult result;
  Process process(program, argv, {{out.end[1].number(), STDOUT_FILENO}, {err.end[1].number(), STDERR_FILENO}},
                  temporaries);
  out.end[1].close();
  err.end[1].close();
  const bool is_silent = !read_streams({out.end[0].number(), err.end[0].number()}, result, watch);
  result.status = is_silent ? process.wait_at_most(0) : process.wait();
  return result;
}

}  // namespace flexor::io
