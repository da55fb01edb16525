// For tests: what the user reads who is refused.
#pragma once

#include <string>

#include "host/io/io.hpp"

namespace flexor::io {

// The message of the InputError or JobError that `work` throws; "accepted" where it throws none.
template <class Work>
std::string refusal_of(const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  } catch (const JobError& error) {
    return error.what();
  }
  return "accepted";
}

// Of errors of this class alone.
template <class Error, class Work>
std::string message_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no such error";
}

}  // namespace flexor::io
