# Helpers that keep every room's CMakeLists.txt to a few lines.
#   flexor_runtime(NAME HEADERS ... USES ...)           header-only, C++14
#   flexor_library(NAME HEADERS ... SOURCES ... USES)   host library, C++20
#   flexor_test(NAME SOURCES ... USES ...)              GoogleTest program, one ctest entry per test
#   flexor_fuzzer(NAME SOURCES ... USES ...)            libFuzzer program (preset fuzz)
# Includes are written from the repository root: "host/model/model.hpp".

add_library(flexor_warnings INTERFACE)
target_compile_options(flexor_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # False alarms of GCC 12 inside the standard library's string and vector (GCC bugs 105329, 105562).
  target_compile_options(flexor_warnings INTERFACE -Wno-restrict -Wno-stringop-overflow)
endif()

function(flexor_runtime name)
  cmake_parse_arguments(ARG "" "" "HEADERS;USES" ${ARGN})
  add_library(${name} INTERFACE)
  target_include_directories(${name} INTERFACE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} INTERFACE ${ARG_USES})
  flexor_headers_compile_alone(${name} ${ARG_HEADERS})
endfunction()

# PRIVATE_USES are libraries that must not show in the room's headers (Ceres, matio, ...).
function(flexor_library name)
  cmake_parse_arguments(ARG "" "" "HEADERS;SOURCES;USES;PRIVATE_USES" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${ARG_USES} PRIVATE flexor_warnings ${ARG_PRIVATE_USES})
  target_compile_definitions(${name} PRIVATE FLEXOR_VERSION="${PROJECT_VERSION}")
  flexor_headers_compile_alone(${name} ${ARG_HEADERS})
endfunction()

# Each public header gets a translation unit of its own: a header that leans on its includer fails here.
function(flexor_headers_compile_alone library)
  file(RELATIVE_PATH room ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(units "")
  foreach(header IN LISTS ARGN)
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/alone/${header}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "#include \"${room}/${header}\"\n")
    list(APPEND units ${unit})
  endforeach()
  add_library(${library}_headers OBJECT ${units})
  target_link_libraries(${library}_headers PRIVATE ${library} flexor_warnings)
endfunction()

function(flexor_test name)
  if(FLEXOR_FUZZ)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_USES} flexor_warnings GTest::gtest_main rapidcheck)
  target_compile_definitions(${name} PRIVATE FLEXOR_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 300)
endfunction()

function(flexor_fuzzer name)
  if(NOT FLEXOR_FUZZ)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_USES} flexor_warnings)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
endfunction()

if(FLEXOR_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -O1)
  add_link_options(-fsanitize=address,undefined)
endif()
