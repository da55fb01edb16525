// A line from a glove's readings to a camera's angles, and how well it does on the half that it never saw.
#include <cstdio>
#include <exception>

#include "host/identify/identify.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) return std::puts("usage: fit GLOVE.csv CAMERA.csv MODEL.json"), 2;
  flexor::identify::Request request;
  request.pairs = {{argv[1], argv[2]}};
  request.map = flexor::identify::map_by_name(request.pairs.front(), {});
  request.structure = "line";
  const auto result = flexor::identify::identify_files(request, [](auto...) { return true; });
  for (const auto& joint : result.joints)
    std::printf("%s errs by %.2f degrees\n", joint.name.c_str(), joint.holdout.rmse_deg);
  flexor::model::save(result.model, argv[3]);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "fit: %s\n", error.what()), 1;
}
