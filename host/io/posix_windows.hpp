// The calls of POSIX that this room makes, by those of Windows. Names are wide, as std::filesystem has them there; errno is what
// failed.
#pragma once

#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <filesystem>

// No program is started with what this one has open.
constexpr int O_CLOEXEC = 0, O_NOFOLLOW = 0, O_DIRECTORY = 0, O_NOCTTY = 0, O_NONBLOCK = 0;
constexpr int F_GETFD = 1, F_GETFL = 3, F_DUPFD_CLOEXEC = 1030;
constexpr int LOCK_EX = 2, LOCK_NB = 4;
constexpr int EDQUOT = 10000;
constexpr int SIGHUP = SIGBREAK;  // the window was closed
constexpr int SIGALRM = 10000, SIGPIPE = SIGALRM, SIGXFSZ = SIGALRM, SIGTTIN = SIGALRM, SIGTTOU = SIGALRM;
constexpr int SA_RESTART = 0;
constexpr bool S_ISSOCK(int) { return false; }

struct sigaction {
  void (*sa_handler)(int);
  int sa_flags;
};
struct Waiting {
  int fd;
  short events;
  short revents;
};
constexpr short kToRead = 1, kToWrite = 4;
constexpr const char* kNothing = "NUL";
constexpr const char* kHome = "USERPROFILE";
constexpr const char* kRandomBits = "rand_s";
constexpr const char* kProgramSuffix = ".exe";
constexpr const char* kWorkers =
    "what films hands or simulates boards is not in the build for Windows: use Flexor for Linux in WSL2";
constexpr char kBetweenFolders = ';';
std::filesystem::path this_program();

// Others may read, write, rename and remove the file meanwhile.
int open(const wchar_t* name, int flags, int mode = 0);
int stat(const wchar_t* name, struct stat* status);  // no numbers of files: st_ino is 0
int access(const wchar_t* name, int mode);
// Waits two seconds for who holds `to`: an antivirus, a cloud's folder.
int rename(const wchar_t* from, const wchar_t* to);
int flock(int file, int operation);  // at once or EWOULDBLOCK
int fcntl(int file, int what, int least = 0);
int fsync(int file);
ssize_t write(int file, const void* bytes, std::size_t count);
ssize_t pread(int file, void* bytes, std::size_t count, off_t offset);
char* mkdtemp(char* pattern);
int gethostname(char* name, std::size_t size);
int poll(Waiting* files, std::size_t count, int timeout_ms);  // of pipes, to read; to write at once
int kill(pid_t process, int signal);  // 0: whether it runs; else this process, which ends
int sigaction(int signal, const struct sigaction* now, struct sigaction* before);
unsigned alarm(unsigned seconds);
int pause();
inline int fchown(int, int, int) { return 0; }
inline int fchmod(int, int) { return 0; }
inline int flock(void*, int) { return 0; }  // a port is opened for one alone
