# Helpers that keep every room's CMakeLists.txt to a few lines.
#   flexor_runtime(NAME HEADERS ... USES ...)           header-only, C++14
#   flexor_library(NAME HEADERS ... SOURCES ... USES)   host library, C++20
#   flexor_test(NAME SOURCES ... USES ...)              GoogleTest program; runs in the root
#   flexor_script_test(NAME COMMAND ...)                any other program that tests
#   flexor_test_runs(NAME DEFINITION TARGET ...)        a program that it runs, as DEFINITION
#   flexor_avr_test(NAME file)                          builds for the ATmega328P
#   flexor_fuzzer(NAME SOURCES ... USES ...)            libFuzzer program (preset asan)
# Includes are written from the repository root: "host/model/model.hpp".

# What was compiled before, in whatever clone, is not compiled again.
find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
endif()

# The address sanitizer stops at null pointers too; leaving these checks to it makes the build five times faster.
if(FLEXOR_SANITIZE STREQUAL "thread")
  add_compile_options(-fsanitize=thread)
  add_link_options(-fsanitize=thread)
elseif(FLEXOR_SANITIZE)
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=null,vptr,object-size,alignment
                      -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
  add_custom_target(fuzzers)
endif()
add_custom_target(sanitized)

# A program loads the libraries that it calls, not those that something beside it calls: OpenCV brings two hundred.
add_link_options(-Wl,--as-needed)

include(${CMAKE_CURRENT_LIST_DIR}/layers.cmake)

function(flexor_targets_below folder out)
  get_property(all DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  get_property(subfolders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(subfolder IN LISTS subfolders)
    flexor_targets_below(${subfolder} more)
    list(APPEND all ${more})
  endforeach()
  set(${out} ${all} PARENT_SCOPE)
endfunction()

# CMake's own graph between rooms, one "from to TARGET" a line, for cmake/check_layers.cmake: of every target that lies in
# a room's folder, libraries, programs and tests.
function(flexor_write_graph file)
  set(text "")
  flexor_targets_below(${PROJECT_SOURCE_DIR} targets)
  foreach(target IN LISTS targets)
    get_target_property(folder ${target} SOURCE_DIR)
    file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${folder})
    flexor_room_of("${folder}" room)
    if(NOT room)
      continue()
    endif()
    foreach(property LINK_LIBRARIES INTERFACE_LINK_LIBRARIES)
      get_target_property(links ${target} ${property})
      foreach(other IN LISTS ROOMS)
        if("flexor_${other}" IN_LIST links OR "$<LINK_ONLY:flexor_${other}>" IN_LIST links)
          if(NOT other STREQUAL room)
            string(APPEND text "${room} ${other} ${target}\n")
          endif()
        endif()
      endforeach()
    endforeach()
  endforeach()
  file(WRITE ${file} "${text}")
endfunction()

# Files that the program carries with it, as C++: FILES below FOLDER fill @ROWS@ of NAME.cpp.in, one {"name", text} each. Those with a
# whole path have their own name; where one is missing, its text is empty.
function(flexor_embed name folder)
  set(ROWS "")
  foreach(file IN LISTS ARGN)
    get_filename_component(path ${file} ABSOLUTE BASE_DIR ${folder})
    file(RELATIVE_PATH key ${folder} ${path})
    if(IS_ABSOLUTE ${file})
      get_filename_component(key ${file} NAME)
    endif()
    set(text "")
    if(EXISTS ${path})
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
      file(READ ${path} text)
    endif()
    string(APPEND ROWS "      {\"${key}\", R\"embedded(${text})embedded\"},\n")
  endforeach()
  configure_file(${name}.cpp.in ${name}.cpp @ONLY)
endfunction()

add_library(flexor_warnings INTERFACE)
target_compile_options(flexor_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror)
if(FLEXOR_UNITY)
  # Of a room as one file, where one source's names meet another's; script/lint has them for each source alone.
  target_compile_options(flexor_warnings INTERFACE -Wno-shadow $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
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

# What a target compiles of its sources: with FLEXOR_UNITY one file that includes them, in a third of the time. It names the
# sources from the root, so that every clone compiles the same text, which CMake's own unity build does not; names in the
# unnamed namespaces of one room must therefore differ.
function(flexor_sources name out)
  if(NOT FLEXOR_UNITY)
    set(${out} ${ARGN} PARENT_SCOPE)
    return()
  endif()
  set(generated "")
  set(text "")
  foreach(source IN LISTS ARGN)
    if(IS_ABSOLUTE ${source})
      list(APPEND generated ${source})
    else()
      file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${source})
      string(APPEND text "#include \"${path}\"\n")
    endif()
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}_room.cpp CONTENT "${text}")
  set(${out} ${CMAKE_CURRENT_BINARY_DIR}/${name}_room.cpp ${generated} PARENT_SCOPE)
endfunction()

# PRIVATE_USES are libraries that must not show in the room's headers (OpenCV, ...). APART are sources that are always
# compiled alone, for options of their own.
function(flexor_library name)
  cmake_parse_arguments(ARG "" "" "HEADERS;SOURCES;APART;USES;PRIVATE_USES" ${ARGN})
  flexor_sources(${name} sources ${ARG_SOURCES})
  add_library(${name} STATIC ${sources} ${ARG_APART})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${ARG_USES} PRIVATE flexor_warnings ${ARG_PRIVATE_USES})
  target_compile_definitions(${name} PRIVATE FLEXOR_VERSION="${PROJECT_VERSION}")
  flexor_headers_compile_alone(${name} ${ARG_HEADERS})
endfunction()

# A header that leans on its includer must fail. One that its own .cpp or _test.cpp includes first is proven by that;
# every other gets a translation unit of its own.
function(flexor_headers_compile_alone library)
  if(FLEXOR_UNITY)
    return()
  endif()
  file(RELATIVE_PATH room ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(units "")
  foreach(header IN LISTS ARGN)
    string(REGEX REPLACE "\\.hpp$" "" stem ${header})
    set(proven FALSE)
    foreach(source ${CMAKE_CURRENT_SOURCE_DIR}/${stem}.cpp ${CMAKE_CURRENT_SOURCE_DIR}/${stem}_test.cpp)
      if(EXISTS ${source})
        file(STRINGS ${source} first REGEX "^#include" LIMIT_COUNT 1)
        if(first STREQUAL "#include \"${room}/${header}\"")
          set(proven TRUE)
          set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
        endif()
      endif()
    endforeach()
    if(NOT proven)
      set(unit ${CMAKE_CURRENT_BINARY_DIR}/alone/${header}.cpp)
      file(CONFIGURE OUTPUT ${unit} CONTENT "#include \"${room}/${header}\"\n")
      list(APPEND units ${unit})
    endif()
  endforeach()
  if(units)
    add_library(${library}_headers OBJECT ${units})
    target_link_libraries(${library}_headers PRIVATE ${library} flexor_warnings)
  endif()
endfunction()

# A program of GoogleTest's: one ctest entry, or SHARDS of them, which share its tests. Under the sanitizers there are those
# alone that are SANITIZED: parsers, the link, the runtime, threads; without those that STATISTICS names. LONG names tests, as --gtest_filter does, that need real
# time, thousands of fits or minutes: script/test --all has them, as NAME_long.
function(flexor_test name)
  cmake_parse_arguments(ARG "SANITIZED" "SHARDS;LONG;STATISTICS" "SOURCES;USES" ${ARGN})
  if(FLEXOR_WHEEL OR (FLEXOR_SANITIZE AND NOT ARG_SANITIZED))
    return()
  endif()
  flexor_sources(${name} sources ${ARG_SOURCES})
  add_executable(${name} ${sources})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_USES} flexor_warnings GTest::gtest_main rapidcheck)
  target_compile_definitions(${name} PRIVATE FLEXOR_SOURCE_DIR=".")
  target_compile_options(${name} PRIVATE -O1)  # the work that takes time is in the libraries
  set_property(GLOBAL APPEND_STRING PROPERTY FLEXOR_TESTS "$<TARGET_FILE:${name}>\n")
  if(FLEXOR_SANITIZE)
    add_dependencies(sanitized ${name})
    set(ARG_LONG "${ARG_LONG}:${ARG_STATISTICS}")
  endif()
  if(ARG_LONG AND NOT FLEXOR_SANITIZE)
    add_test(NAME ${name}_long COMMAND ${name} --gtest_filter=${ARG_LONG} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(${name}_long PROPERTIES LABELS long TIMEOUT 1800)
    if(ARG_LONG STREQUAL "*")
      return()
    endif()
  endif()
  if(NOT ARG_SHARDS)
    set(ARG_SHARDS 1)
  endif()
  foreach(shard RANGE 1 ${ARG_SHARDS})
    math(EXPR index "${shard} - 1")
    set(entry ${name})
    if(ARG_SHARDS GREATER 1)
      set(entry ${name}_${shard}_of_${ARG_SHARDS})
    endif()
    add_test(NAME ${entry} COMMAND ${name} --gtest_filter=-${ARG_LONG} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(${entry} PROPERTIES TIMEOUT 600 COST ${ARG_SHARDS}
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
  endforeach()
endfunction()

# Another program that tests: NAME COMMAND..., LONG as above where it stands first. Exit status 77: skipped.
function(flexor_script_test name)
  cmake_parse_arguments(ARG "LONG;ALONE" "" "COMMAND" ${ARGN})
  if(FLEXOR_WHEEL)
    return()
  endif()
  add_test(NAME ${name} COMMAND ${ARG_COMMAND} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1500 COST 9 RUN_SERIAL ${ARG_ALONE})
  if(ARG_LONG)
    set_tests_properties(${name} PROPERTIES LABELS long)
  endif()
endfunction()

# Its path from the repository's root, so that every clone compiles the same text.
function(flexor_test_runs name)
  if(NOT TARGET ${name})
    return()
  endif()
  while(ARGN)
    list(POP_FRONT ARGN definition target)
    target_compile_definitions(${name}
      PRIVATE ${definition}="$<PATH:RELATIVE_PATH,$<TARGET_FILE:${target}>,${PROJECT_SOURCE_DIR}>")
    add_dependencies(${name} ${target})
  endwhile()
endfunction()

# The same headers on the microcontroller's compiler: built, and its symbols searched for heap and soft-float.
function(flexor_avr_test name source)
  find_program(AVR_CXX avr-g++)
  find_program(AVR_NM avr-nm)
  add_test(NAME ${name}
    COMMAND ${CMAKE_COMMAND} -DCXX=${AVR_CXX} -DNM=${AVR_NM} -DROOT=${PROJECT_SOURCE_DIR}
            -DSOURCE=${CMAKE_CURRENT_SOURCE_DIR}/${source} -DTO=${CMAKE_CURRENT_BINARY_DIR}/${name}.elf
            -P ${PROJECT_SOURCE_DIR}/cmake/avr_build_test.cmake)
endfunction()

function(flexor_fuzzer name)
  if(NOT TARGET fuzzers)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_USES} flexor_warnings)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzzers ${name})
endfunction()
