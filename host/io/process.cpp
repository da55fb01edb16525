#include "host/io/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <sstream>
#include <string_view>

#include "host/io/interrupt.hpp"
#include "host/io/io.hpp"

extern char** environ;

namespace flexor::io {
namespace {

// This process's environment, with another TMPDIR if there is one.
std::vector<std::string> environment(const std::filesystem::path& temporaries) {
  std::vector<std::string> out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (temporaries.empty() || !std::string_view(*entry).starts_with("TMPDIR=")) out.emplace_back(*entry);
  }
  if (!temporaries.empty()) out.push_back("TMPDIR=" + temporaries.string());
  return out;
}

std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (const std::string& text : texts) out.push_back(const_cast<char*>(text.c_str()));
  out.push_back(nullptr);
  return out;
}

// 0, or errno.
int start(pid_t& child, const std::filesystem::path& program, const posix_spawn_file_actions_t& actions,
          const sigset_t& mask, const std::vector<std::string>& arguments,
          const std::vector<std::string>& variables) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  posix_spawnattr_setsigmask(&attributes, &mask);
  sigset_t ignored_here;
  sigemptyset(&ignored_here);
  sigaddset(&ignored_here, SIGPIPE);
  sigaddset(&ignored_here, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &ignored_here);
  const int failed = posix_spawn(&child, program.c_str(), &actions, &attributes, pointers(arguments).data(),
                                 pointers(variables).data());
  posix_spawnattr_destroy(&attributes);
  return failed;
}

int exit_status(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

}  // namespace

Pipe::Pipe() {
  // Above the descriptors that programs know by number, so that handing one on never closes another.
  constexpr int kLeast = 16;
  std::array<int, 2> made{};
  if (pipe2(made.data(), O_CLOEXEC) != 0) throw JobError(fmt::format("pipe: {}", std::strerror(errno)));
  for (std::size_t i = 0; i < 2; ++i) {
    ends_[i] = fcntl(made[i], F_DUPFD_CLOEXEC, kLeast);
    close(made[i]);
  }
  if (ends_[0] < 0 || ends_[1] < 0) throw JobError(fmt::format("pipe: {}", std::strerror(errno)));
}

Pipe::~Pipe() {
  close_end(0);
  close_end(1);
}

void Pipe::close_end(std::size_t i) {
  if (ends_[i] >= 0) close(ends_[i]);
  ends_[i] = -1;
}

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& argv,
                 const std::vector<HandedOn>& descriptors, const std::filesystem::path& temporaries)
    : child_([&](const sigset_t& mask) {
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        int last = STDERR_FILENO;
        for (const HandedOn& d : descriptors) {
          posix_spawn_file_actions_adddup2(&actions, d.ours, d.theirs);
          last = std::max(last, d.theirs);
        }
        // Libraries open what they like.
        for (const auto& open : std::filesystem::directory_iterator("/proc/self/fd")) {
          const int ours = std::atoi(open.path().filename().c_str());
          if (ours > last) posix_spawn_file_actions_addclose(&actions, ours);
        }
        pid_t child = 0;
        const int failed = start(child, program, actions, mask, argv, environment(temporaries));
        posix_spawn_file_actions_destroy(&actions);
        if (failed != 0) throw JobError(fmt::format("{}: {}", program.string(), std::strerror(failed)));
        return child;
      }) {}

int Process::wait() {
  int status = 0;
  while (waitpid(child_.pid(), &status, 0) < 0 && errno == EINTR) {
  }
  return exit_status(status);
}

int Process::wait_at_most(int ms) {
  const timespec millisecond{0, 1'000'000};
  for (int status = 0; ms > 0; --ms) {
    if (waitpid(child_.pid(), &status, WNOHANG) != 0) return exit_status(status);
    nanosleep(&millisecond, nullptr);
  }
  kill();
  return wait();
}

void Process::kill() { (void)::kill(-child_.pid(), SIGKILL); }

void Process::end() {
  (void)::kill(-child_.pid(), SIGINT);
  (void)::kill(-child_.pid(), SIGTERM);
}

std::filesystem::path find_program(const std::string& name, const char* path) {
  if (name.find('/') != std::string::npos) return access(name.c_str(), X_OK) == 0 ? name : "";
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    auto candidate = std::filesystem::path(folder) / name;
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

namespace {

// Both streams to their ends. False: it was silent for too long.
bool read_streams(const std::array<int, 2>& streams, ProcessResult& result, const Watch& watch) {
  std::array<pollfd, 2> waiting{{{streams[0], POLLIN, 0}, {streams[1], POLLIN, 0}}};
  const std::array<std::string*, 2> text{&result.out, &result.err};
  while (waiting[0].fd >= 0 || waiting[1].fd >= 0) {
    const int ready = poll(waiting.data(), waiting.size(), watch.longest_silence_ms);
    if (ready == 0) return false;
    if (ready < 0 && errno != EINTR) break;
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
  if (program.empty()) throw InputError(fmt::format("{}: no such program", argv.front()));
  Pipe out;
  Pipe err;
  Process process(program, argv, {{out.end(1), STDOUT_FILENO}, {err.end(1), STDERR_FILENO}}, temporaries);
  out.close_end(1);
  err.close_end(1);
  ProcessResult result;
  if (!read_streams({out.end(0), err.end(0)}, result, watch)) process.kill();
  result.status = process.wait();
  return result;
}

}  // namespace flexor::io
