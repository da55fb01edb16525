# Builds SOURCE for the ATmega328P, once with each of VARIANTS defined, and fails if it needs a heap, or soft-float in
# the variant FIXED_POINT.
if(NOT CXX OR NOT NM)
  message(FATAL_ERROR "avr-g++ is missing: run script/bootstrap (packages gcc-avr, avr-libc, binutils-avr)")
endif()
file(MAKE_DIRECTORY ${OUT})

function(build name)
  execute_process(
    COMMAND ${CXX} -mmcu=atmega328p -Os -std=c++14 -Wall -Wextra -Werror -fno-exceptions -fno-rtti
            -ffunction-sections -Wl,--gc-sections -I${ROOT} -D${name}
            ${SOURCE} -o ${OUT}/${name}.elf
    RESULT_VARIABLE failed ERROR_VARIABLE log)
  if(failed)
    message(FATAL_ERROR "${name} does not compile with avr-g++:\n${log}")
  endif()
  execute_process(COMMAND ${NM} ${OUT}/${name}.elf OUTPUT_VARIABLE symbols)
  if(symbols MATCHES "malloc|_Znw|__cxa_")
    message(FATAL_ERROR "${name} pulls in a heap or exceptions:\n${symbols}")
  endif()
  if(name STREQUAL "FIXED_POINT" AND symbols MATCHES "__(add|sub|mul|div|fix|fixuns|float|floatun|cmp|le|ge)[a-z]*sf")
    message(FATAL_ERROR "the fixed-point path pulls in soft-float:\n${symbols}")
  endif()
endfunction()

foreach(variant IN LISTS VARIANTS)
  build(${variant})
endforeach()
