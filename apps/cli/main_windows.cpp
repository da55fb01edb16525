// Names and standard streams are UTF-8 and bytes, whatever the system's code page is.
#include "apps/cli/commands.hpp"

#include <io.h>
#include <windows.h>

#include <fcntl.h>
#include <cstdio>
#include <vector>

int wmain(int argc, wchar_t** argv) {
  int number = 0;
  for (std::FILE* stream : {stdin, stdout, stderr}) {
    if (_get_osfhandle(number) < 0) (void)_dup2(_open("NUL", _O_RDWR), number);  // no console
    stream->_file = number;
    (void)_setmode(number++, _O_BINARY);
  }
  SetConsoleOutputCP(CP_UTF8);
  std::vector<std::string> words;
  for (int i = 0; i < argc; ++i) words.push_back(std::filesystem::path(argv[i]).string());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return flexor::cli::run(argc, pointers.data());
}
