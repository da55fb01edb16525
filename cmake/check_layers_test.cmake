# The layer check notices a forbidden include in each room, however deep it lies, a library in a room that does not keep
# it, a file in no room, and a forbidden link; and lets allowed ones pass. Arguments: WORK, a folder for the tries.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/layers.cmake)

# One source with one line, and one link, in a tree of their own; with which exit status the check ends.
function(expect result path line edge)
  file(REMOVE_RECURSE ${WORK})
  file(WRITE ${WORK}/tree/${path} "#pragma once\n${line}\n")
  file(WRITE ${WORK}/graph "${edge}\n")
  execute_process(
    COMMAND ${CMAKE_COMMAND} -DGRAPH=${WORK}/graph -DROOT=${WORK}/tree -P ${CMAKE_CURRENT_LIST_DIR}/check_layers.cmake
    RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
  if(NOT status EQUAL result)
    message(SEND_ERROR "${status} instead of ${result}: ${path}: ${line}; ${edge}")
  endif()
endfunction()

# All that a room must not use, in one tree: each include and each link is named.
function(expect_all_noticed room forbidden)
  file(REMOVE_RECURSE ${WORK})
  set(lines "")
  set(edges "")
  foreach(other IN LISTS forbidden)
    string(APPEND lines "#include \"${FOLDER_${other}}/x.hpp\"\n")
    string(APPEND edges "${room} ${other} some_test\n")
  endforeach()
  file(WRITE ${WORK}/tree/${FOLDER_${room}}/deep/er/x.hpp "${lines}")
  file(WRITE ${WORK}/graph "${edges}")
  execute_process(
    COMMAND ${CMAKE_COMMAND} -DGRAPH=${WORK}/graph -DROOT=${WORK}/tree -P ${CMAKE_CURRENT_LIST_DIR}/check_layers.cmake
    OUTPUT_QUIET ERROR_VARIABLE message)
  foreach(other IN LISTS forbidden)
    foreach(wanted "#include \"${FOLDER_${other}}/x.hpp\"" "some_test of ${room} links ${other}\n")
      string(FIND "${message}\n" "${wanted}" at)
      if(at EQUAL -1)
        message(SEND_ERROR "not noticed in ${room}: ${wanted}")
      endif()
    endforeach()
  endforeach()
endfunction()

set(good "cli study flexor_cli")
foreach(room IN LISTS ROOMS)
  flexor_reachable(${room} allowed)
  set(forbidden ${ROOMS})
  list(REMOVE_ITEM forbidden ${allowed})
  expect_all_noticed(${room} "${forbidden}")
  if(ALLOWED_${room})
    list(GET ALLOWED_${room} 0 other)
    expect(0 ${FOLDER_${room}}/deep/er/x.cpp "#include \"${FOLDER_${other}}/x.hpp\"" "${room} ${other} some_test")
  endif()
endforeach()
expect(1 host/twin/deep/x.cpp "#include <opencv2/core.hpp>" "${good}")
# However it is spelt.
foreach(line "#  include \"host/camera/lens.hpp\"" " #include <host/camera/lens.hpp>" "#include \"../../host/camera/lens.hpp\""
        "#include \"host/study/../camera/lens.hpp\"" "#include \"deep/../../../host/camera/lens.hpp\"" "#include \"opencv2/core.hpp\"" "// [\n#include \"host/camera/lens.hpp\"")
  expect(1 apps/cli/x.cpp "${line}" "${good}")
endforeach()
foreach(file x.h x.cc x.inl x.cpp.in)
  expect(1 host/io/${file} "#include \"host/camera/lens.hpp\"" "${good}")
endforeach()
# Who is asked through a pipe is not included.
expect(1 apps/cli/x.cpp "#include \"host/camera/lens.hpp\"" "${good}")
expect(1 apps/cli/x.cpp "" "cli filming flexor_cli")
expect(1 cosim/x.cpp "" "cosim cli flexor_cosim")
expect(1 host/nowhere/x.cpp "" "${good}")
