#include "host/io/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>
#include <thread>

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
          const std::vector<std::string>& arguments, const std::vector<std::string>& variables) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
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

}  // namespace

Pipe::Pipe() {
  // Above the descriptors that programs know by number, so that handing one on never closes another.
  constexpr int kLeast = 16;
  std::array<int, 2> made{-1, -1};
  (void)pipe2(made.data(), O_CLOEXEC);
  for (std::size_t i = 0; i < 2; ++i) {
    end[i] = Descriptor(fcntl(Descriptor(made[i]).number(), F_DUPFD_CLOEXEC, kLeast));
    if (!end[i]) throw JobError("pipe: {}", std::strerror(errno));
  }
}

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& argv,
                 const std::vector<HandedOn>& descriptors, const std::filesystem::path& temporaries) {
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
  const int failed = start(child_, program, actions, argv, environment(temporaries));
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw JobError("{}: {}", program.string(), std::strerror(failed));
}

Process::~Process() { (void)wait_at_most(0); }

bool Process::is_over(int flags) {
  int status = 0;
  while (status_ < 0) {
    const pid_t ended = waitpid(child_, &status, flags);
    if (ended == 0) return false;
    if (ended < 0 && errno == EINTR) continue;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return true;
}

int Process::wait() {
  (void)is_over(0);
  return status_;
}

int Process::wait_at_most(int ms) {
  for (; !is_over(WNOHANG) && ms > 0; --ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!is_over(WNOHANG)) (void)::kill(-child_, SIGKILL);
  return wait();
}

void Process::end() { (void)::kill(-child_, SIGTERM); }

std::filesystem::path find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return access(name.c_str(), X_OK) == 0 ? name : "";
  const char* path = std::getenv("PATH");
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
