# Builds SOURCE for the ATmega328P as TO, and fails if it needs a heap or soft-float.
if(NOT CXX OR NOT NM)
  message(FATAL_ERROR "avr-g++ is missing: run script/bootstrap (packages gcc-avr, avr-libc, binutils-avr)")
endif()
execute_process(
  COMMAND ${CXX} -mmcu=atmega328p -Os -std=c++14 -Wall -Wextra -Werror -fno-exceptions -fno-rtti
          -ffunction-sections -Wl,--gc-sections -I${ROOT} ${SOURCE} -o ${TO}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${NM} ${TO} OUTPUT_VARIABLE symbols)
if(symbols MATCHES "malloc|_Znw|__cxa_|__(add|sub|mul|div|fix|fixuns|float|floatun|cmp|le|ge)[a-z]*sf")
  message(FATAL_ERROR "it needs a heap, exceptions or soft-float: ${CMAKE_MATCH_0}")
endif()
