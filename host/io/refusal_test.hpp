// For tests: what the user reads who is refused.
#pragma once

#include <string>

#include "host/io/io.hpp"

namespace flexor::io {

// The message of what `work` throws; "accepted" where it throws none.
template <class Error = Failure, class Work>
std::string refusal_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace flexor::io
