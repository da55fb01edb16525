#include "host/camera/video.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "host/camera/jpeg.hpp"
#include "host/camera/opencv.hpp"
#include "host/camera/test_pictures.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {
namespace fs = std::filesystem;

// The smallest Matroska file: JPEG pictures, each with a time of its own in milliseconds.
class Matroska {
 public:
  Matroska(int width, int height) {
    const std::string video = element("\xB0", number(width)) + element("\xBA", number(height));
    const std::string track = element("\xD7", number(1)) + element("\x73\xC5", number(1)) +
                              element("\x83", number(1)) + element("\x86", "V_MJPEG") +
                              element("\xE0", video);
    segment_ = element("\x15\x49\xA9\x66", element("\x2A\xD7\xB1", number(1000000)) +
                                               element("\x4D\x80", "test") + element("\x57\x41", "test")) +
               element("\x16\x54\xAE\x6B", element("\xAE", track));
  }

  void add(int t_ms, const Picture& picture) {
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", mat(picture), jpeg, {cv::IMWRITE_JPEG_QUALITY, 98});
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
  static std::string number(int value) {
    std::string out;
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 255);
    return out;
  }
  static std::string element(const std::string& id, const std::string& content) {
    std::string size = "\x01";
    for (int shift = 48; shift >= 0; shift -= 8) size += static_cast<char>(content.size() >> shift & 255U);
    return id + size + content;
  }

  std::string segment_;
};

class Video : public testing::Test {
 protected:
  void TearDown() override {
    for (const fs::path& p : made_) fs::remove_all(p);
  }
  fs::path path(const std::string& name) {
    made_.push_back(scratch(name));
    return made_.back();
  }
  fs::path file(const std::string& name, const std::string& bytes) {
    const fs::path p = path(name);
    std::ofstream(p, std::ios::binary) << bytes;
    return p;
  }
  static std::string error(const fs::path& p) {
    try {
      VideoReader reader(p);
      Picture picture;
      double t = 0;
      while (reader.next(picture, t)) {
      }
    } catch (const io::InputError& e) {
      return e.what();
    } catch (const io::JobError& e) {
      return e.what();
    }
    return "";
  }

 private:
  std::vector<fs::path> made_;
};

Picture grey(int width, int height, int level) { return dots(width, height, {level, level, level}, {}); }

TEST_F(Video, TimesAreTheContainersAtAVariableRateAndDroppedFramesAreCounted) {
  const std::vector<int> times = {0, 33, 67, 100, 133, 167, 200, 300, 333, 340, 380, 413};
  Matroska film(64, 48);
  for (const int t : times) film.add(t, grey(64, 48, 100 + t / 10));
  VideoReader reader(file("variable.mkv", film.bytes()));
  Picture picture;
  double t = 0;
  DropFinder drops;
  std::vector<int> missing;
  for (const int expected : times) {
    ASSERT_TRUE(reader.next(picture, t));
    EXPECT_NEAR(t, expected / 1000.0, 1e-9);
    missing.push_back(drops.add(t));
  }
  EXPECT_FALSE(reader.next(picture, t));
  EXPECT_EQ(drops.dropped(), 2);
  EXPECT_EQ(missing[7], 2);
}

TEST_F(Video, PicturesWithoutAContainerHaveTheTimesOfTheNominalRate) {
  constexpr int kPictures = 5;
  constexpr double kNominal_hz = 25;
  std::string film;
  for (int k = 0; k < kPictures; ++k) film += to_jpeg(grey(64, 64, 100 + 10 * k));
  VideoReader reader(file("bare.mjpeg", film));
  Picture picture;
  double t = -1;
  for (int k = 0; k < kPictures; ++k) {
    ASSERT_TRUE(reader.next(picture, t));
    EXPECT_NEAR(t, k / kNominal_hz, 1e-9);
  }
  ASSERT_FALSE(reader.warnings().empty());
  EXPECT_NE(reader.warnings().front().find("no clock of its own"), std::string::npos);
}

TEST_F(Video, FramesThatGoBackInTimeAreLeftOutWithAWarning) {
  Matroska film(64, 48);
  for (const int t : {10, 43, 77, 60, 110}) film.add(t, grey(64, 48, 100));
  VideoReader reader(file("back.mkv", film.bytes()));
  Picture picture;
  double t = 0;
  double last = -1;
  int frames = 0;
  while (reader.next(picture, t)) {
    EXPECT_GT(t, last);
    last = t;
    ++frames;
  }
  EXPECT_EQ(frames, 4);
  ASSERT_FALSE(reader.warnings().empty());
  EXPECT_NE(reader.warnings().front().find("1 frame(s) whose time does not increase"), std::string::npos);
}

TEST_F(Video, WhatIsWrittenWithoutLossIsReadBack) {
  for (const char* name : {"lossless.avi", "lossless.mkv"}) {
    const fs::path p = path(name);
    VideoWriter writer(p, 64, 48, 25);
    std::vector<Picture> written;
    for (int k = 0; k < 5; ++k) {
      written.push_back(dots(64, 48, kWall, {{{20.0 + k, 24}, 6}}));
      writer.add(written.back());
    }
    EXPECT_FALSE(fs::exists(p));
    writer.finish();
    VideoReader reader(p);
    Picture picture;
    double t = 0;
    for (int k = 0; k < 5; ++k) {
      ASSERT_TRUE(reader.next(picture, t));
      EXPECT_NEAR(t, k / 25.0, 0.0011);
      int worst = 0;
      for (std::size_t i = 0; i < picture.bgr.size(); ++i) {
        worst = std::max(worst, std::abs(picture.bgr[i] - written[static_cast<std::size_t>(k)].bgr[i]));
      }
      EXPECT_LE(worst, 2);  // colour space, there and back
    }
  }
}

TEST_F(Video, AnH264VideoHasATimeForEveryFrame) {
  const fs::path p = path("film.mp4");
  VideoWriter writer(p, 64, 48, 30);
  for (int k = 0; k < 30; ++k) writer.add(dots(64, 48, kWall, {{{10.0 + k, 24}, 6}}));
  writer.finish();
  VideoReader reader(p);
  Picture picture;
  double t = 0;
  for (int k = 0; k < 30; ++k) {
    ASSERT_TRUE(reader.next(picture, t));
    EXPECT_NEAR(t, k / 30.0, 1e-3);
  }
  EXPECT_FALSE(reader.next(picture, t));
}

TEST_F(Video, AWriterThatIsNotFinishedLeavesNothingBehind) {
  const fs::path folder = path("unfinished");  // of its own: other tests write beside it
  fs::create_directory(folder);
  {
    VideoWriter writer(folder / "left.mp4", 64, 48, 30);
    writer.add(grey(64, 48, 5));
    EXPECT_FALSE(fs::is_empty(folder));
  }
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_THROW(VideoWriter(path("film.txt"), 64, 48, 30), io::InputError);
  EXPECT_THROW(VideoWriter(path("none.mp4"), 0, 0, 30), io::InputError);
}

TEST_F(Video, WhatIsNoVideoIsOneClearLine) {
  const std::vector<std::pair<fs::path, std::string>> cases = {
      {path("missing.mp4"), "missing.mp4"},
      {file("empty.mp4", ""), "is empty"},
      {file("text.mp4", "this is no video"), "no video that can be read"},
      {file("none.mkv", Matroska(64, 48).bytes()), ""},
      {fs::temp_directory_path(), ""},
  };
  for (const auto& [p, expected] : cases) {
    const std::string message = error(p);
    EXPECT_FALSE(message.empty()) << p;
    EXPECT_NE(message.find(expected), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

TEST_F(Video, AnUnknownCodecIsSaidToBeOne) {
  Matroska film(64, 48);
  film.add(0, grey(64, 48, 9));
  std::string bytes = film.bytes();
  bytes.replace(bytes.find("V_MJPEG"), 7, "V_NOPE7");
  EXPECT_NE(error(file("codec.mkv", bytes)).find("codec"), std::string::npos);
}

TEST_F(Video, PicturesOfChangingSizeAreScaledToTheFirst) {
  Matroska film(64, 48);
  film.add(0, grey(64, 48, 50));
  film.add(33, grey(64, 48, 60));
  film.add(67, grey(32, 24, 50));
  film.add(100, grey(32, 24, 50));
  // A decoder that did not would be refused.
  EXPECT_EQ(error(file("size.mkv", film.bytes())), "");
}

TEST_F(Video, TruncatedAndFlippedFilesEndClearlyAndTimesStillIncrease) {
  Matroska film(64, 48);
  for (int k = 0; k < 20; ++k) film.add(33 * k, dots(64, 48, kWall, {{{10.0 + k, 24}, 6}}));
  const fs::path mp4 = path("whole.mp4");
  {
    VideoWriter writer(mp4, 64, 48, 30);
    for (int k = 0; k < 20; ++k) writer.add(dots(64, 48, kWall, {{{10.0 + k, 24}, 6}}));
    writer.finish();
  }
  unsigned state = 12345;
  const auto random = [&](std::size_t below) {
    state = state * 1664525U + 1013904223U;
    return static_cast<std::size_t>(state >> 8U) % below;
  };
  int readable = 0;
  for (const std::string& whole : {film.bytes(), io::read_file(mp4)}) {
    for (int i = 0; i < 60; ++i) {
      std::string bytes = whole;
      if (i % 2 == 0) bytes.resize(1 + random(bytes.size() - 1));
      for (std::size_t k = random(20); k-- > 0;)
        bytes[random(bytes.size())] ^= static_cast<char>(1U << random(8));
      try {
        VideoReader reader(file("mutated.bin", bytes));
        Picture picture;
        double t = 0;
        double last = -1;
        while (reader.next(picture, t)) {
          ASSERT_TRUE(std::isfinite(t) && t > last);
          ASSERT_EQ(picture.bgr.size(), 3U * static_cast<std::size_t>(picture.width * picture.height));
          last = t;
        }
        ++readable;
      } catch (const io::InputError&) {
      } catch (const io::JobError&) {
      }
    }
  }
  EXPECT_GT(readable, 10);
  EXPECT_LT(readable, 120);
}

TEST_F(Video, SixteenBitsBecomeEightAndOnePixelIsAPicture) {
  const fs::path deep = path("deep.png");
  cv::Mat sixteen(48, 64, CV_16UC3, cv::Scalar(30000, 20000, 60000));
  cv::imwrite(deep.string(), sixteen);
  const Picture picture = read_picture(deep);
  EXPECT_EQ(picture.width, 64);
  EXPECT_NEAR(picture.at(10, 10)[2], 234, 2);
  const fs::path one = path("one.png");
  write_picture(one, Picture(1, 1));
  EXPECT_EQ(read_picture(one).bgr.size(), 3U);
  EXPECT_THROW(read_picture(file("broken.png", "no picture")), io::InputError);
  EXPECT_THROW(write_picture(path("picture.xyz"), Picture(4, 4)), io::InputError);
}

std::string big_endian_4(std::uint32_t value) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 255U);
  return out;
}

// A header of 33 bytes that states a size, and no picture.
std::string png_of(std::uint32_t width, std::uint32_t height) {
  return "\x89PNG\r\n\x1a\n" + big_endian_4(13) + "IHDR" + big_endian_4(width) + big_endian_4(height) +
         std::string("\x08\x02\0\0\0", 5) + big_endian_4(0);
}

TEST(PictureSize, IsReadBeforeAnythingIsDecoded) {
  using std::literals::operator""s;
  const std::string jpeg = "\xff\xd8\xff\xc2\0\x11\x08\xff\xff\xff\xff\x03"s;
  const std::string bmp = "BM" + std::string(12, '\0') + "\x28\0\0\0\0\0\1\0\0\0\xff\xff"s;
  const std::string webp = "RIFF\0\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\xff\xff\0\xff\xff\0"s;
  const std::string tiff = "II*\0\x08\0\0\0\2\0\0\1\4\0\1\0\0\0\0\0\1\0\1\1\3\0\1\0\0\0\xff\xff\0\0"s;
  for (const std::string& huge : {png_of(50000, 50000), jpeg, bmp, webp, tiff, "P5 50000 50000 255\n"s}) {
    EXPECT_THROW((void)states_few_pixels(huge, "a"), io::InputError) << huge.substr(0, 4);
  }
  EXPECT_THROW((void)states_few_pixels(png_of(6000, 6001), "a"), io::InputError);
  EXPECT_TRUE(states_few_pixels(png_of(6000, 6000), "a"));
  EXPECT_FALSE(
      states_few_pixels("\0\0\0\x18"
                        "ftypmp42"s,
                        "a"));
}

// What FFmpeg does with a picture, its metadata too, has no bound.
TEST_F(Video, APicturesSizeIsBoundedAndAPictureIsAVideoOfOneFrame) {
  const fs::path huge = path("huge.png");
  io::write_file(huge, png_of(50000, 50000));
  EXPECT_THROW((void)read_picture(huge), io::InputError);
  EXPECT_THROW((void)VideoReader(huge), io::InputError);
  const fs::path small = path("small.png");
  write_picture(small, Picture(64, 48));
  VideoReader reader(small);
  Picture picture;
  double t_s = -1;
  EXPECT_TRUE(reader.next(picture, t_s));
  EXPECT_EQ(picture.width, 64);
  EXPECT_FALSE(reader.next(picture, t_s));
}

}  // namespace
}  // namespace flexor::camera
