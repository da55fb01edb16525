# Windows of x86-64, built on Debian by mingw-w64: preset windows, script/windows.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_INCLUDE_PATH /usr/include)  # where cmake/headers.cmake finds its libraries
add_link_options(-static -Wl,--no-insert-timestamp)
add_compile_definitions(_FILE_OFFSET_BITS=64 _WIN32_WINNT=0x0A00 WIN32_LEAN_AND_MEAN NOMINMAX)
