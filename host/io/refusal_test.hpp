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

}  // namespace flexor::io
