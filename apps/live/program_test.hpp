// The program as a page sees it: `flexor live` over its socket.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/test_wire.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"

namespace flexor::live {

using Json = nlohmann::json;

class Program : public testing::Test {
 protected:
  // With these arguments of its own.
  void begin(const std::vector<std::string>& arguments) {
    io::Pipe out;
    const std::string program = std::filesystem::absolute(FLEXOR_PROGRAM).string();
    std::vector<std::string> all = {"flexor", "live", "--json", "--sessions",
                                    (folder_.path() / "sessions").string()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    process_.emplace(program, all, std::vector<io::HandedOn>{{out.end[1].number(), STDOUT_FILENO}});
    out.end[1].close();
    std::string line;
    for (char c = 0; read(out.end[0].number(), &c, 1) == 1 && c != '\n';) line += c;
    place_.emplace(Json::parse(line).at("url").get<std::string>());
    tab_.emplace(*place_);
    ASSERT_EQ(tab_->status, 101);
  }
  void TearDown() override { end(); }
  void end() {
    tab_.reset();
    process_.reset();
  }

  // The answer to this message.
  Json ask(Json message) {
    message["id"] = ++id_;
    tab_->send(message.dump());
    Json received = tab_->receive_json();
    while (!received.is_null() && received.value("id", Json()) != id_) received = tab_->receive_json();
    return received;
  }
  void done(const Json& message) { EXPECT_TRUE(ask(message).at("ok").get<bool>()) << message; }
  // The next state for which this holds. Throws after two minutes, which fails the test.
  template <class Holds>
  Json state_when(Holds&& holds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (std::chrono::steady_clock::now() < end) {
      const Json received = tab_->receive_json();
      if (received.is_null()) break;
      if (received.value("event", "") == "state" && holds(received)) return received;
    }
    throw std::runtime_error("no such state");
  }
  Json five_fingers() {
    return state_when([](const Json& s) { return s.at("fingers").size() == 5; });
  }
  void expect_refused(const Json& message, const std::string& reason) {
    const Json answer = ask(message);
    EXPECT_FALSE(answer.at("ok").get<bool>()) << message;
    EXPECT_NE(answer.at("error").get<std::string>().find(reason), std::string::npos) << answer;
  }

  io::TemporaryFolder folder_;
  std::optional<io::Process> process_;
  std::optional<Place> place_;
  std::optional<Tab> tab_;
  int id_ = 0;
};

}  // namespace flexor::live
