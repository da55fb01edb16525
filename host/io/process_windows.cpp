#include "host/io/io.hpp"
#include "host/io/process.hpp"

#include <windows.h>

#include <system_error>

namespace flexor::io {
namespace {

// Ends what is in it with this program, however that ends.
HANDLE group() {
  static const HANDLE made = [] {
    const HANDLE job = CreateJobObjectW(nullptr, nullptr);
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits = {};
    limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
    SetInformationJobObject(job, JobObjectExtendedLimitInformation, &limits, sizeof limits);
    return job;
  }();
  return made;
}

// As the C library takes a command line apart.
std::string quoted(const std::string& word) {
  std::string out = "\"";
  std::size_t backslashes = 0;
  for (const char c : word) {
    if (c == '"') out.append(backslashes + 1, '\\');
    backslashes = c == '\\' ? backslashes + 1 : 0;
    out += c;
  }
  return out.append(backslashes, '\\') + "\" ";
}

HANDLE handle_of(pid_t child) { return reinterpret_cast<HANDLE>(child); }

}  // namespace

Pipe::Pipe() {
  int made[2] = {-1, -1};
  if (_pipe(made, 1 << 16, _O_BINARY | _O_NOINHERIT) != 0) throw JobError("no pipe can be made");
  for (std::size_t i = 0; i < 2; ++i) end[i] = Descriptor(made[i]);
}

// Its three streams alone; `temporaries` stay those of this process.
Process::Process(const std::filesystem::path& program, const std::vector<std::string>& argv,
                 const std::vector<HandedOn>& descriptors, const std::filesystem::path&) {
  std::string words;
  for (const std::string& word : argv) words += quoted(word);
  std::wstring line = std::filesystem::path(words).wstring();
  HANDLE streams[3] = {};
  for (int i = 0; i < 3; ++i) {
    int ours = i;
    for (const HandedOn& d : descriptors)
      if (d.theirs == i) ours = d.ours;
    const HANDLE self = GetCurrentProcess();
    DuplicateHandle(self, reinterpret_cast<HANDLE>(_get_osfhandle(ours)), self, &streams[i], 0, TRUE,
                    DUPLICATE_SAME_ACCESS);
  }
  alignas(std::max_align_t) char memory[256];
  SIZE_T size = sizeof memory;
  STARTUPINFOEXW start = {};
  start.StartupInfo.cb = sizeof start;
  start.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
  start.StartupInfo.hStdInput = streams[0];
  start.StartupInfo.hStdOutput = streams[1];
  start.StartupInfo.hStdError = streams[2];
  start.lpAttributeList = reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(memory);
  InitializeProcThreadAttributeList(start.lpAttributeList, 1, 0, &size);
  UpdateProcThreadAttribute(start.lpAttributeList, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, streams,
                            sizeof streams, nullptr, nullptr);
  PROCESS_INFORMATION made = {};
  const DWORD flags = EXTENDED_STARTUPINFO_PRESENT | CREATE_SUSPENDED | CREATE_NEW_PROCESS_GROUP |
                      (GetConsoleWindow() == nullptr ? CREATE_NO_WINDOW : 0);
  const bool runs = CreateProcessW(program.c_str(), line.data(), nullptr, nullptr, TRUE, flags, nullptr,
                                   nullptr, &start.StartupInfo, &made) != 0;
  const auto error = static_cast<int>(GetLastError());
  for (const HANDLE stream : streams) CloseHandle(stream);
  if (!runs) throw JobError("{}: {}", program.string(), std::system_category().message(error));
  AssignProcessToJobObject(group(), made.hProcess);
  ResumeThread(made.hThread);
  CloseHandle(made.hThread);
  child_ = reinterpret_cast<pid_t>(made.hProcess);
}

bool Process::is_over(bool waits) {
  if (status_ >= 0) return true;
  if (WaitForSingleObject(handle_of(child_), waits ? INFINITE : 0) != WAIT_OBJECT_0) return false;
  DWORD status = 0;
  GetExitCodeProcess(handle_of(child_), &status);
  status_ = static_cast<int>(status & 0xff);
  CloseHandle(handle_of(child_));
  return true;
}

void Process::kill() { TerminateProcess(handle_of(child_), 128 + 9); }

// Where it has a console it gets the event, and cleans up.
void Process::end() {
  if (status_ < 0 && GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, GetProcessId(handle_of(child_))) == 0) kill();
}

}  // namespace flexor::io
