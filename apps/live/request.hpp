// What a request's bytes ask for, and whether they come from where they should: functions of text alone.
#pragma once

#include <string>
#include <string_view>

namespace flexor::live {

inline constexpr std::size_t kLongestName = 1024;  // bytes of a decoded path

struct Target {
  enum class Kind {
    foreign,  // no token, or another
    nothing,  // a path that is no name here: dots, hidden, encoded slashes, bytes that are no letter
    bare,     // the token without the slash behind it, on which relative addresses hang
    asset,    // the page ("index.html") and what it names
    file,     // of the sessions' folder: `name` is relative, its parts are plain names
    socket,
  };
  Kind kind = Kind::foreign;
  std::string name;
};

// The part before `?` of a request's target. Compares the token in a time that does not depend on where it differs.
Target read_target(std::string_view target, std::string_view token);

// "127.0.0.1:8080" against "http://127.0.0.1:8080". Origin "null" is nobody's.
bool is_origin_of(std::string_view origin, std::string_view host);

// MIME type of a part of the page by its ending; and of a session's file, whose scripts and styles are text: the page runs none but
// its own.
std::string_view type_of_asset(std::string_view name);
std::string_view type_of_file(std::string_view name);

}  // namespace flexor::live
