// What may go wrong around `deploy`: hostile texts, keys in the open, runs that are cut off, units that do
// not fit.
#include <sys/stat.h>

#include <chrono>
#include <future>
#include <set>

#include "apps/cli/command_test.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"

namespace flexor::cli {
namespace deploy_faults_test {

const std::string kPublished = fs::absolute(FLEXOR_SOURCE_DIR "/models/published_hw.json").string();
const std::string kKey = "00112233445566778899aabbccddeeff";
const std::string kOtherKey = "ffeeddccbbaa99887766554433221100";

class DeployFaults : public Command {
 protected:
  Finished deploy(const std::string& model, const std::string& options) const {
    return run("deploy '" + model + "' " + options);
  }

  void expect_refused(const std::string& model, const std::string& options, const std::string& reason) const {
    Command::expect_refused("deploy '" + model + "' " + options, 2, reason);
  }

  // The published model with its text changed.
  std::string model(const std::string& name, const std::function<void(Json&)>& edit) const {
    auto json = Json::parse(content(kPublished));
    edit(json);
    write(path(name), json.dump());
    return path(name);
  }
};

std::string key_in(const fs::path& hex) {
  const deploy::Key key = deploy::key_in(deploy::read_image(hex), hex.string());
  return key ? deploy::to_hex(*key) : "";
}

// The first line that names the model by its digest is all that may differ.
std::string without_digest(const std::string& text) {
  const std::size_t from = text.find("fnv1a64:");
  return text.substr(0, from) + text.substr(text.find('\n', from));
}

TEST_F(DeployFaults, AModelsNameIsNeverCompiledNorMarkup) {
  write(path("k"), kKey + "\n");
  const std::string hostile = model("hostile.json", [](Json& m) {
    m["name"] = "x */ \\\n#error compiled\n?\?/\n<script>alert(1)</script> '\"`$(touch gone)`";
    m["description"] = "*/\n#error compiled";
    for (auto& input : m["inputs"]) input["column"] = "<script>\n#error_alpha";
  });
  const std::string harmless = model("harmless.json", [](Json& m) { m["name"] = "x"; });
  ASSERT_EQ(deploy(harmless, "--key k --out one").exit, 0) << content(path("stderr"));
  ASSERT_EQ(deploy(hostile, "--key k --out two").exit, 0) << content(path("stderr"));
  const std::string data = "/arduino/Flexor/src/glove_data.h";
  EXPECT_EQ(without_digest(content(path("one" + data))), without_digest(content(path("two" + data))));
  EXPECT_EQ(content(path("one/glove.hex")), content(path("two/glove.hex")));
  const std::string report = content(path("two/report.html"));
  EXPECT_EQ(report.find("<script"), std::string::npos);
  EXPECT_NE(report.find("&lt;script&gt;alert(1)&lt;/script&gt; &apos;&quot;`"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("gone")));
}

TEST_F(DeployFaults, AKeyIsKeptFromOneDeploymentToTheNext) {
  EXPECT_EQ(json_of(deploy(kPublished, "--out d --json")).at("key"), "new");
  const std::string key = content(path("d/pair.key"));
  EXPECT_EQ(key_in(path("d/glove.hex")) + "\n", key);
  write(path("d/mine.txt"), "mine");

  const Finished second = deploy(kPublished, "--out d --rate 20");
  ASSERT_EQ(second.exit, 0) << second.err;
  EXPECT_NE(second.out.find("used again; --new-key makes another"), std::string::npos) << second.out;
  EXPECT_EQ(content(path("d/pair.key")), key);
  EXPECT_EQ(key_in(path("d/hand.hex")) + "\n", key);
  EXPECT_EQ(content(path("d/mine.txt")), "mine");

  const Finished third = deploy(kPublished, "--out d --new-key --json");
  ASSERT_EQ(third.exit, 0) << third.err;
  EXPECT_NE(content(path("d/pair.key")), key);
  EXPECT_EQ(key_in(path("d/glove.hex")) + "\n", content(path("d/pair.key")));
  for (const auto& entry : fs::directory_iterator(path("d")))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

// Whoever looks, and however often: nobody else ever has a way to a file, not while it is written either.
TEST_F(DeployFaults, NobodyElseCanReadAKeyWhileItIsWritten) {
  fs::create_directories(path("d"));
  auto done = std::async(std::launch::async, [&] {
    return run("deploy '" + kPublished + "' --out d", "/dev/null", "umask 000;").exit;
  });
  std::set<std::string> seen;
  std::set<std::string> open;
  const std::function<void(const fs::path&, bool)> look = [&](const fs::path& folder, bool is_private) {
    std::error_code gone;
    for (fs::directory_iterator at(folder, gone), end; !gone && at != end; at.increment(gone)) {
      struct stat info {};
      if (lstat(at->path().c_str(), &info) != 0 || S_ISLNK(info.st_mode)) continue;
      const bool closed = is_private || (info.st_mode & 0077U) == 0;
      if (S_ISDIR(info.st_mode)) look(at->path(), closed);
      (S_ISDIR(info.st_mode) || closed ? seen : open).insert(at->path().filename());
    }
  };
  do {
    for (const char* folder : {"tmp", "d"}) look(path(folder), false);
  } while (done.wait_for(std::chrono::milliseconds(2)) != std::future_status::ready);
  EXPECT_EQ(done.get(), 0) << content(path("stderr"));
  look(path("d"), false);
  EXPECT_EQ(open, std::set<std::string>());
  for (const char* file : {"glove.hex", "hand.hex", "glove_data.h", "pair.key"})
    EXPECT_TRUE(seen.contains(file)) << file;
}

TEST_F(DeployFaults, AKeyComesFromAFileAndWithAWarningFromTheCommandLine) {
  write(path("k"), kKey + "\n");
  ASSERT_EQ(deploy(kPublished, "--key k --out d").exit, 0) << content(path("stderr"));
  EXPECT_EQ(content(path("stderr")).find("process list"), std::string::npos);
  EXPECT_EQ(content(path("d/pair.key")), kKey + "\n");
  EXPECT_EQ(key_in(path("d/hand.hex")), kKey);

  ASSERT_EQ(deploy(kPublished, "--key " + kOtherKey + " --out d").exit, 0) << content(path("stderr"));
  EXPECT_NE(content(path("stderr")).find("process list"), std::string::npos);
  EXPECT_EQ(content(path("d/pair.key")), kOtherKey + "\n");

  expect_refused(kPublished, "--key none --out e", "no file of this name, and not 32 hexadecimal digits");
  write(path("bad"), kKey + kKey);
  expect_refused(kPublished, "--key bad --out e", "bad: is not a key: 32 hexadecimal digits are needed");
  expect_refused(kPublished, "--key /dev/zero --out e", "/dev/zero: is not a key");
  expect_refused(kPublished, "--key k --new-key --out e", "--new-key");
  EXPECT_FALSE(fs::exists(path("e")));
}

TEST_F(DeployFaults, WhatMightHaveBeenAKeyIsNeverReplaced) {
  write(path("k"), kKey + "\n");
  for (const std::string was : {"", "half a ke", "00112233445566778899aabbccddeef"}) {
    fs::create_directories(path("d"));
    write(path("d/pair.key"), was);
    for (const char* option : {"", "--new-key", "--key k"})
      expect_refused(kPublished, std::string(option) + " --out d", "pair.key: is not a key");
    EXPECT_EQ(content(path("d/pair.key")), was);
  }
  fs::remove(path("d/pair.key"));
  fs::create_symlink(path("k"), path("d/pair.key"));
  expect_refused(kPublished, "--out d", "pair.key: is not a plain file");
}

TEST_F(DeployFaults, AModelInAnotherUnitNeedsACalibrationThatSaysIt) {
  const auto in = [&](const char* unit, const char* column) {
    return model("m.json", [&](Json& m) {
      for (auto& input : m["inputs"]) {
        input["unit"] = unit;
        input["column"] = column;
      }
    });
  };
  const auto calibration = [&](const std::string& unit) {
    std::string fingers;
    for (const char* finger : {"thumb", "index", "middle", "ring", "pinky"})
      fingers += (fingers.empty() ? "\"" : ", \"") + std::string(finger) +
                 R"(": {"counts": [400, 700], "value": [20, 140]})";
    write(path("c.json"), R"({"schema": "flexor-calibration", "schema_version": 1, )" + unit +
                              R"("fingers": {)" + fingers + "}}");
    return "--plain --out d --calibration '" + path("c.json") + "'";
  };
  expect_refused(in("deg", "bend_deg"), "--out d", "the board reads counts: --calibration FILE");
  expect_refused(in("V", "bend_V"), "--out d", R"("unit": "V")");
  expect_refused(in("raw", "x"), "--out d", R"(in "raw")");
  expect_refused(in("", "x"), "--out d", "does not state the unit");
  const std::string volts = in("V", "bend_V");
  expect_refused(volts, calibration(""), R"(add "unit": "V")");
  expect_refused(volts, calibration(R"("unit": "deg", )"), R"(its values are in "deg")");
  EXPECT_EQ(deploy(volts, calibration(R"("unit": "V", )")).exit, 0) << content(path("stderr"));
  EXPECT_EQ(deploy(kPublished, calibration("")).exit, 0) << "alpha: the unit may be left out";
  write(path("c.json"), R"({"fingers": {}})");
  expect_refused(kPublished, "--plain --out d --calibration '" + path("c.json") + "'",
                 R"(begin it with "schema": "flexor-calibration", "schema_version": 1,)");
}

TEST_F(DeployFaults, WiringDoesNotWriteOverADeployments) {
  fs::create_directories(path("d"));
  write(path("d/results.json"), R"({"kind": "deployment"})");
  write(path("d/wiring.md"), "its own");
  const Finished r = run("wiring --hardware lucidgloves --out d");
  EXPECT_EQ(r.exit, 2);
  EXPECT_NE(r.err.find("d: holds what another job found"), std::string::npos) << r.err;
  EXPECT_EQ(content(path("d/wiring.md")), "its own");
  EXPECT_EQ(run("wiring --hardware lucidgloves --out w").exit, 0);
}

// What it says to do next is a command for a shell.
TEST_F(DeployFaults, WhatItProposesIsQuotedAndNothingRuns) {
  const Finished r = deploy(kPublished, "--rate 20 --out \"two words; it's\"");
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_NE(r.out.find(R"(flexor flash "two words; it's" --board glove)"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find(R"(--key "two words; it's/pair.key")"), std::string::npos) << r.out;
  const Finished hidden = deploy(kPublished, "--rate 20 --out \"$(printf 'a\\033[2Jb\\nc')\"");
  ASSERT_EQ(hidden.exit, 0) << hidden.err;
  EXPECT_EQ(hidden.out.find('\033'), std::string::npos);
  EXPECT_NE(hidden.out.find("report    a?[2Jb?c/report.html"), std::string::npos) << hidden.out;
  EXPECT_NE(hidden.out.find(R"(flexor flash "a?[2Jb?c" --board glove)"), std::string::npos) << hidden.out;
}

}  // namespace deploy_faults_test
}  // namespace flexor::cli
