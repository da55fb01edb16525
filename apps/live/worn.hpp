// What is worn: a glove's columns as fingers, and the model over them.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/fingers.hpp"
#include "apps/live/glove_port.hpp"
#include "apps/live/hand_view.hpp"
#include "apps/live/messages.hpp"

namespace flexor::live {

// Samples on their way to the page: together where they come close, and how the link that they come over does.
class Stream {
 public:
  explicit Stream(Context& context) : context_(&context) {}

  void add(double host_s, const Fingers& fingers);
  // What waits, where the last message was so long ago.
  void send(double after_s = 0);
  void restart() { rows_ = Rows(Kind::samples, 0); }  // fingers are others: what waits is left out
  void forget_old();
  void drop() { *this = Stream(*context_); }  // the source has gone for good

  double rate_hz() const;  // of what came in the last two seconds: bursts and all
  Json state(const listen::Source* source) const;

 private:
  Context* context_;
  Rows rows_{Kind::samples, 0};
  std::deque<double> arrival_s_;  // of the last two seconds
  double begun_s_ = -1;
  double sent_s_ = 0;
  double latency_s_ = 0;  // smoothed
};

struct ChosenModel : model::Model {
  std::filesystem::path path;
  Session session;  // none of its own: without a name
};
// By whom it was made, or its file.
Json model_state(const Session& session, const std::filesystem::path& path);

class Worn {
 public:
  Worn(Context& context, GlovePort& glove);  // adds its words

  // A model; where it does not fit the one before stays. Throws io::InputError.
  void wear(const Session& session, const std::filesystem::path& path);
  void take(const listen::Sample& sample);
  void tick();
  void drop();  // the glove has gone for good
  bool is_connected() const { return fingers_ && !glove_.is_gone(); }
  const std::optional<ChosenModel>& model() const { return model_; }
  const std::vector<std::string>& columns() const { return columns_; }
  Session new_session(const char* what, const std::string& person, const std::string& side) const;
  Session new_session(const char* what) const;  // of who wears the model, where one is worn

  void write(Json& state) const;
  Json next() const;  // what to do, as SOCKET.md has it

  Stream stream;

 private:
  ChosenModel load(const Session& session, const std::filesystem::path& path) const;
  void learn_columns();
  void put_on();
  void choose(io::JsonReader& parts);
  void name_columns(const Json& given);

  Context& context_;
  GlovePort& glove_;
  std::vector<std::string> columns_;
  std::optional<Fingers> fingers_;
  std::optional<ChosenModel> model_;
  bool is_chosen_;      // by a person: it stays when another glove comes
  std::string misfit_;  // why it is not worn on this one
  bool is_tracked_ = false;
  Outs outs_;
  std::optional<HandView> hand_;  // last, so that it ends first: it has a thread
};

}  // namespace flexor::live
