// What the page is made of, carried in the program: the output of `npm run build` in web/, or one page that states what is missing.
#pragma once

#include <span>
#include <string_view>

namespace flexor::live {

struct Asset {
  std::string_view name;  // "index.html", "assets/main.js": the path behind the token
  std::string_view bytes;
};

std::span<const Asset> assets();

}  // namespace flexor::live
