// One skeleton of colour marks through a video: found once in the whole picture, then followed in small
// windows.
//
// searching -> the colour is learnt if it is not known, all marks of it are found, the skeleton determines which is
// which. A guess (labels.hpp: margin) is not taken; the next picture may be clearer.
// following -> each mark is measured around where it is predicted. One that is not there, has lost more than
// half of its area, or is too far from the prediction is hidden. After kMaxHidden pictures it is lost and
// looked for in the whole picture, at the distances that its bones allow; when more than half are lost, all
// are searched for again, now with the bone lengths of this video. Where a bone has another length than before,
// a mark has taken another's place: all are named again, if that gives each bone its length.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/camera/filter.hpp"
#include "host/camera/joints.hpp"
#include "host/camera/labels.hpp"
#include "host/camera/lens.hpp"
#include "host/camera/marks.hpp"
#include "host/camera/motion.hpp"

namespace flexor::camera {

struct ObservedMark {
  Point at;  // measured, or predicted while hidden
  double area_px = 0;
  bool measured = false;
  bool lost = true;
};

// One picture's worth.
struct Observation {
  std::vector<ObservedMark> marks;        // in the order of the skeleton
  std::vector<Measurement> measurements;  // in the order of its angles
  bool labelled() const;                  // every mark measured
};

// The colour that the joint file gives, or the one that has the skeleton's number of dots. Throws as
// colour_like and colour_automatic do.
ColourModel learn_colour(const Skeleton& skeleton, const Picture& picture);

// Where a mark will be in the next picture: Kalman's filter of both coordinates (motion.hpp). Its density q (px^2/s^3) follows the
// innovations: after nu^2 / S on average 1 it stays, above it grows.
class MarkPredictor {
 public:
  void begin(double t_s, Point at);

  // Where it will be, and the standard deviation of that.
  Point at(double t_s) const;
  double sigma_px(double t_s) const;

  void update(double t_s, Point measured);
  // Nothing was seen: the velocity fades, so that a hidden mark does not fly away.
  void skip(double t_s);

 private:
  Motion<2> after(double t_s) const { return motion_.after(t_s - t_s_, density_); }

  double t_s_ = 0;
  Motion<2> motion_;
  double density_ = 0;
};

class ColourTracker {
 public:
  ColourTracker(const Skeleton& skeleton, std::optional<Lens> lens);

  Observation step(const Picture& picture, double t_s);

  // Why nothing is followed; empty when something is.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Followed {
    MarkPredictor predictor;
    double area_px = 0;
    double level = 0;
    std::size_t hidden = kMaxHidden + 1;
    std::optional<Mark> seen;
    bool lost() const { return hidden > kMaxHidden; }
    void take(const Mark& mark, double t_s);
  };

  void search(const Picture& picture, double t_s);
  std::optional<std::vector<std::size_t>> by_start(const std::vector<Mark>& candidates) const;
  void follow(const Picture& picture, double t_s);
  void name_again(const std::vector<Mark>& candidates, double t_s);
  void find_lost(const std::vector<Mark>& candidates, double t_s);
  void find_missing(const Picture& picture, double t_s);
  std::optional<double> bone_now_px(std::size_t link) const;
  bool looks_wrong() const;
  std::optional<std::size_t> only_candidate(std::size_t mark, const std::vector<Mark>& candidates) const;
  Observation report(double t_s);

  Skeleton skeleton_;
  std::optional<Lens> lens_;
  std::optional<ColourModel> colour_;
  bool following_ = false;
  std::vector<Followed> marks_;
  std::vector<double> bone_px_;  // 0: not known yet
  std::string trouble_;
  std::size_t frame_ = 0;
  int searches_ = 0;
  double sign_ = 1;
};

}  // namespace flexor::camera
