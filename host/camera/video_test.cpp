#include "host/camera/video.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "host/camera/jpeg.hpp"
#include "host/camera/pictures_test.hpp"
#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {
namespace fs = std::filesystem;

// Four bytes, the largest first.
std::string number(std::uint32_t value) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 255U);
  return out;
}

// The smallest Matroska file: JPEG pictures, each with a time of its own in milliseconds.
class Matroska {
 public:
  Matroska(std::uint32_t width, std::uint32_t height) {
    const std::string video = element("\xB0", number(width)) + element("\xBA", number(height));
    const std::string track = element("\xD7", number(1)) + element("\x73\xC5", number(1)) +
                              element("\x83", number(1)) + element("\x86", "V_MJPEG") +
                              element("\xE0", video);
    segment_ = element("\x15\x49\xA9\x66", element("\x2A\xD7\xB1", number(1000000)) +
                                               element("\x4D\x80", "test") + element("\x57\x41", "test")) +
               element("\x16\x54\xAE\x6B", element("\xAE", track));
  }

  void add(std::uint32_t t_ms, const Picture& picture) {
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", picture, jpeg, {cv::IMWRITE_JPEG_QUALITY, 98});
    std::string block = {'\x81', '\0', '\0', '\x80'};
    block.append(jpeg.begin(), jpeg.end());
    segment_ += element("\x1F\x43\xB6\x75", element("\xE7", number(t_ms)) + element("\xA3", block));
  }

  std::string bytes() const {
    const std::string header = element("\x42\x86", number(1)) + element("\x42\xF7", number(1)) +
                               element("\x42\xF2", number(4)) + element("\x42\xF3", number(8)) +
                               element("\x42\x82", "matroska") + element("\x42\x87", number(4)) +
                               element("\x42\x85", number(2));
    return element("\x1A\x45\xDF\xA3", header) + element("\x18\x53\x80\x67", segment_);
  }

 private:
  static std::string element(const std::string& id, const std::string& content) {
    std::string size = "\x01";
    for (int shift = 48; shift >= 0; shift -= 8) size += static_cast<char>(content.size() >> shift & 255U);
    return id + size + content;
  }

  std::string segment_;
};

// All of a video; its times increase.
struct Film {
  std::vector<double> t_s;
  std::vector<Picture> pictures;
  std::vector<std::string> warnings;
};

Film read(const fs::path& path) {
  VideoReader reader(path);
  Film out;
  Picture picture;
  for (double t = 0; reader.next(picture, t);) {
    EXPECT_TRUE(std::isfinite(t) && (out.t_s.empty() || t > out.t_s.back())) << t;
    EXPECT_EQ(picture.type(), CV_8UC3);
    out.t_s.push_back(t);
    out.pictures.push_back(picture.clone());
  }
  out.warnings = reader.warnings();
  return out;
}

// A dot that moves by a pixel from one picture to the next.
Picture moving_dot(int k) { return dots(64, 48, kWall, {{{10.0 + k, 24}, 6}}); }

void write_film(const fs::path& path, int pictures, double rate_hz) {
  VideoWriter writer(path, 64, 48, rate_hz);
  for (int k = 0; k < pictures; ++k) writer.add(moving_dot(k));
  EXPECT_FALSE(fs::exists(path)) << "before it is whole";
  writer.finish();
}

class Video : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  fs::path file(const std::string& name, const std::string& bytes) const {
    io::write_file(path(name), bytes);
    return path(name);
  }
  static std::string error(const fs::path& p) {
    return io::refusal_of([&] { (void)read(p); });
  }

  const io::TemporaryFolder folder_;
};

Picture grey(int width, int height, int level) { return dots(width, height, {level, level, level}, {}); }

TEST_F(Video, TimesAreTheContainersAtAVariableRateAndDroppedFramesAreCounted) {
  const std::vector<unsigned> times = {0, 33, 67, 100, 133, 167, 200, 300, 333, 340, 380, 413};
  Matroska matroska(64, 48);
  for (const unsigned t : times) matroska.add(t, grey(64, 48, 100 + static_cast<int>(t) / 10));
  const Film film = read(file("variable.mkv", matroska.bytes()));
  ASSERT_EQ(film.t_s.size(), times.size());
  DropFinder drops;
  std::vector<int> missing;
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_NEAR(film.t_s[k], times[k] / 1000.0, 1e-9);
    missing.push_back(drops.add(film.t_s[k]));
  }
  EXPECT_EQ(drops.dropped(), 2);
  EXPECT_EQ(missing[7], 2);
}

TEST_F(Video, PicturesWithoutAContainerHaveTheTimesOfTheNominalRate) {
  constexpr double kNominal_hz = 25;
  std::string pictures;
  for (int k = 0; k < 5; ++k) pictures += to_jpeg(grey(64, 64, 100 + 10 * k));
  const Film film = read(file("bare.mjpeg", pictures));
  ASSERT_EQ(film.t_s.size(), 5U);
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(film.t_s[static_cast<std::size_t>(k)], k / kNominal_hz, 1e-9);
  io::expect_line(film.warnings.at(0), "no clock of its own");
}

TEST_F(Video, FramesThatGoBackInTimeAreLeftOutWithAWarning) {
  Matroska matroska(64, 48);
  for (const unsigned t : {10U, 43U, 77U, 60U, 110U}) matroska.add(t, grey(64, 48, 100));
  const Film film = read(file("back.mkv", matroska.bytes()));
  EXPECT_EQ(film.t_s.size(), 4U);
  io::expect_line(film.warnings.at(0), "1 frame(s) whose time does not increase");
}

TEST_F(Video, WhatIsWrittenIsReadBackWithItsTimes) {
  const fs::path p = path("h264.mp4");
  write_film(p, 30, 30);
  const Film film = read(p);
  ASSERT_EQ(film.t_s.size(), 30U);
  for (std::size_t k = 0; k < film.t_s.size(); ++k) {
    EXPECT_NEAR(film.t_s[k], static_cast<double>(k) / 30, 1e-3);
    EXPECT_NEAR(film.pictures[k].at<cv::Vec3b>(24, 10 + static_cast<int>(k))[1],
                moving_dot(static_cast<int>(k)).at<cv::Vec3b>(24, 10 + static_cast<int>(k))[1], 40)
        << "the dot";
  }
}

TEST_F(Video, AWriterThatIsNotFinishedLeavesNothingBehind) {
  {
    VideoWriter writer(path("left.mp4"), 64, 48, 30);
    writer.add(grey(64, 48, 5));
    EXPECT_FALSE(fs::is_empty(folder_.path()));
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  EXPECT_THROW(VideoWriter(path("film.txt"), 64, 48, 30), io::InputError);
  EXPECT_THROW(VideoWriter(path("none.mp4"), 0, 0, 30), io::InputError);
}

TEST_F(Video, WhatIsNoVideoIsOneClearLine) {
  Matroska film(64, 48);
  film.add(0, grey(64, 48, 9));
  std::string unknown = film.bytes();
  unknown.replace(unknown.find("V_MJPEG"), 7, "V_NOPE7");
  const std::vector<std::pair<fs::path, std::string>> cases = {
      {file("codec.mkv", unknown), "codec"},
      {path("missing.mp4"), "missing.mp4"},
      {file("empty.mp4", ""), "is empty"},
      {file("text.mp4", "this is no video"), "no video that can be read"},
      {file("none.mkv", Matroska(64, 48).bytes()), ""},
      {folder_.path(), ""},
  };
  for (const auto& [p, expected] : cases) {
    EXPECT_NE(error(p), "accepted") << p;
    io::expect_line(error(p), expected);
  }
}

TEST_F(Video, PicturesOfChangingSizeAreScaledToTheFirst) {
  Matroska film(64, 48);
  film.add(0, grey(64, 48, 50));
  film.add(33, grey(64, 48, 60));
  film.add(67, grey(32, 24, 50));
  film.add(100, grey(32, 24, 50));
  // A decoder that did not would be refused.
  EXPECT_EQ(error(file("size.mkv", film.bytes())), "accepted");
}

TEST_F(Video, SixteenBitsBecomeEightAndOnePixelIsAPicture) {
  const fs::path deep = path("deep.png");
  cv::Mat sixteen(48, 64, CV_16UC3, cv::Scalar(30000, 20000, 60000));
  cv::imwrite(deep.string(), sixteen);
  const Picture picture = read_picture(deep);
  EXPECT_EQ(picture.cols, 64);
  EXPECT_NEAR(picture.at<cv::Vec3b>(10, 10)[2], 234, 2);
  const fs::path one = path("one.png");
  write_picture(one, Picture(1, 1, CV_8UC3, cv::Scalar()));
  EXPECT_EQ(read_picture(one).total(), 1U);
  EXPECT_THROW(read_picture(file("broken.png", "no picture")), io::InputError);
  EXPECT_THROW(write_picture(path("picture.xyz"), Picture(4, 4, CV_8UC3, cv::Scalar())), io::InputError);
}

// A header of 33 bytes that states a size, and no picture.
std::string png_of(std::uint32_t width, std::uint32_t height) {
  return "\x89PNG\r\n\x1a\n" + number(13) + "IHDR" + number(width) + number(height) +
         std::string("\x08\x02\0\0\0", 5) + number(0);
}

// What FFmpeg does with a picture, its metadata too, has no bound.
TEST_F(Video, APicturesSizeIsBoundedAndAPictureIsAVideoOfOneFrame) {
  const fs::path huge = path("huge.png");
  io::write_file(huge, png_of(50000, 50000));
  EXPECT_THROW((void)read_picture(huge), io::InputError);
  io::expect_refused([&] { (void)VideoReader(huge); }, "at most 36 million");
  cv::imwrite(huge.string(), cv::Mat::zeros(6001, 6000, CV_8U));
  io::expect_refused([&] { (void)read_picture(huge); }, "at most 36 million");
  const fs::path small = path("small.png");
  write_picture(small, Picture(48, 64, CV_8UC3, cv::Scalar()));
  const Film film = read(small);
  ASSERT_EQ(film.pictures.size(), 1U);
  EXPECT_EQ(film.pictures[0].cols, 64);
}

}  // namespace
}  // namespace flexor::camera
