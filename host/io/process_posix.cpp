#include "host/io/process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>

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

bool Process::is_over(bool waits) {
  int status = 0;
  while (status_ < 0) {
    const pid_t ended = waitpid(child_, &status, waits ? 0 : WNOHANG);
    if (ended == 0) return false;
    if (ended < 0 && errno == EINTR) continue;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return true;
}

void Process::kill() { (void)::kill(-child_, SIGKILL); }
void Process::end() { (void)::kill(-child_, SIGTERM); }

}  // namespace flexor::io
