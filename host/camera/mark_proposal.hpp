// Setting up a video without a desktop: what looks like a mark, numbered, and which is probably which.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/camera/joints.hpp"
#include "host/camera/labels.hpp"
#include "host/camera/marks.hpp"

namespace flexor::camera {

struct MarkProposal {
  ColourModel colour;
  std::vector<Mark> candidates;   // numbered from 1 in this order: from the top left to the bottom right
  std::vector<std::string> name;  // proposed or assigned, "" for none
  std::string trouble;            // why nothing is proposed
};

// Of a skeleton of colour marks. `mark`: a point on one, whose colour is learnt. `assigned`: candidate number -> mark; then nothing is proposed. Throws
// io::InputError for a number or a name that does not exist, io::JobError when no colour is found.
MarkProposal propose_marks(const Skeleton& skeleton, const Picture& picture, const std::optional<Point>& mark,
                           const std::map<int, std::string>& assigned);

// The skeleton with this colour and these start positions. Throws io::InputError when a mark has no
// candidate.
Skeleton with_start(const Skeleton& skeleton, const MarkProposal& proposal);

}  // namespace flexor::camera
