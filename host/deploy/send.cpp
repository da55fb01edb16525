#include "host/deploy/send.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "runtime/compensator/graph.hpp"
#include "runtime/glove/glove_model.hpp"
#include "runtime/glove/model_receiver.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;
using io::JobError;
using link::Received;

constexpr double kTurn_s = 0.15;  // until the glove leaves a turn; where it does not, the line is not a radio
constexpr double kLost_s =
    0.08;  // the writing of a piece and the answer at 9600 baud; then it is sent once more
constexpr double kFrame_s = 0.06;    // a frame that has begun is awaited
constexpr double kDoubt_s = 3;       // without a receipt since an offer
constexpr double kPatience_s = 10;   // without any answer
constexpr double kNoFurther_s = 60;  // of answers, without a further piece

// Why a model that has come does not run.
std::string reason_of(std::uint8_t stage) {
  if (stage == glove::kNotWritten) return "its EEPROM does not keep what is written: it is worn out";
  if (stage == glove::kNotTaken) return "it has no room for it";
  switch (static_cast<compensator::Loaded>(stage - 2)) {
    case compensator::Loaded::wrong_version:
      return "its image is of another version: flexor flash";
    case compensator::Loaded::other_calibration:
      return "it has another sensor calibration";
    case compensator::Loaded::other_rate:
      return "it has another sample rate";
    case compensator::Loaded::no_room:
      return "it needs more RAM than it has";
    default:
      return fmt::format("it was refused, code {}", stage);
  }
}

class Sender {
 public:
  Sender(const Line& line, Glove glove, const SendProgress& progress)
      : line_(line), glove_(std::move(glove)), progress_(progress) {}

  Sent run(const AtRate& at_rate) {
    const double start_s = line_.now_s();
    const link::Offer offer = ask();
    if (at_rate) glove_ = at_rate(offer.rate_hz);
    check_made_for(glove_, offer.rate_hz, offer.calibration, "the glove");
    const ModelBlock block = model_block(glove_);
    const auto bytes = static_cast<int>(block.bytes.size());
    const int ram = bytes + block.state_bytes;
    if (bytes > offer.room || ram > glove::kArenaBytes) {
      throw InputError(
          "model {:?} does not fit the glove's EEPROM: {} bytes where {} are, {} of RAM where {} "
          "are: add --bootloader (over USB), or use fewer knots",
          glove_.model.name, bytes, offer.room, ram, glove::kArenaBytes);
    }
    all_ = bytes;
    send_all(block.bytes);
    return {all_, pieces_, line_.now_s() - start_s};
  }

 private:
  // Where the line breaks, the error reports what the glove runs then.
  auto still_there(const auto& work) const {
    try {
      return work();
    } catch (const JobError& error) {
      throw JobError("{}: {}", error.what(), left_behind());
    }
  }

  void write(link::Type type, link::Packet& packet, std::uint8_t body_bytes, const link::Key* key) {
    std::array<std::uint8_t, link::kMaxWire> wire{};
    const std::uint8_t size = packet.seal({type, false, false, sequence_++}, body_bytes, key, wire.data());
    still_there([&] { line_.write({wire.data(), size}); });
  }

  std::string left_behind() const {
    return fmt::format("{} of {} bytes are there: it runs its old model; send again", received_, all_);
  }

  // The next whole frame until a time; false: none.
  bool next(double until_s) {
    while (true) {
      while (at_ < came_.size()) {
        if (reader_.push(came_[at_++]) == Received::pending) return true;
      }
      const double left_s = until_s - line_.now_s();
      if (left_s <= 0) return false;
      came_ = still_there([&] { return line_.read(left_s); });
      at_ = 0;
    }
  }

  // The next whole frame until a time, or behind it what has begun to come by then; where there is none, the line is quiet.
  bool receives(double until_s) {
    turn_ = true;
    return next(until_s) || (reader_.amid() && next(until_s + kFrame_s));
  }

  // Until the glove listens. A radio carries one direction at a time.
  void await_turn() {
    if (std::exchange(turn_, false)) return;
    const double until_s = line_.now_s() + kTurn_s;
    while (next(until_s)) {
      if (reader_.listens()) return;
    }
  }

  bool is(link::Answer answer, std::uint8_t bytes) const {
    return reader_.type() == link::Type::coefficients && reader_.body_bytes() == bytes &&
           reader_.body()[0] == static_cast<std::uint8_t>(answer);
  }

  // Of the glove that has this key.
  bool is_offer() {
    return is(link::Answer::offer, link::Offer::kBytes) && reader_.guarded() == glove_.key.has_value() &&
           (!glove_.key || reader_.fits(*glove_.key, reader_.sequence()));
  }

  void request() {
    await_turn();
    link::Packet packet;
    packet.body()[0] = static_cast<std::uint8_t>(link::Request::coefficients);
    write(link::Type::request, packet, 1, nullptr);
  }

  link::Offer ask() {
    const double until_s = line_.now_s() + kPatience_s;
    bool is_answered = false;
    bool foreign = false;
    while (line_.now_s() < until_s) {
      request();
      const double lost_s = line_.now_s() + kLost_s;
      while (receives(lost_s)) {
        is_answered = true;
        if (is_offer()) return accept(link::get_offer(reader_.body()));
        foreign = foreign || is(link::Answer::offer, link::Offer::kBytes);
      }
    }
    if (foreign) {
      throw InputError(glove_.key ? "the glove has another key, or none: --key FILE is that of its deployment"
                                  : "the glove has a key: --key FILE, pair.key of its deployment");
    }
    if (is_answered)
      throw InputError(
          "the glove takes no models on this line: what it sends is text, or its image is an older one: add "
          "--bootloader (over USB), or deploy and flash it once");
    throw JobError("nothing answers: is it the glove's port, and --baud its rate?");
  }

  link::Offer accept(const link::Offer& offer) {
    session_.start(offer.nonce);
    while (glove_.key && !session_.ready()) session_.derive(*glove_.key);
    sequence_ = 0;
    received_ = 0;
    offered_s_ = line_.now_s();
    turn_ = reader_.listens();
    return offer;
  }

  void send_all(const Bytes& bytes) {
    double answered_s = line_.now_s();
    double further_s = answered_s;
    std::size_t most = 0;
    std::size_t offset = 0;
    while (true) {
      if (line_.now_s() - answered_s > kPatience_s) {
        throw JobError("the glove no longer answers, " + left_behind());
      }
      if (line_.now_s() - further_s > kNoFurther_s) {
        throw JobError("somebody else speaks to the glove again and again, " + left_behind());
      }
      // The offer may have been the tape of an old one, whose session the glove has left.
      const bool doubts = offered_s_ && line_.now_s() - *offered_s_ > kDoubt_s;
      if (doubts) {
        request();
      } else {
        offset = send_piece(bytes, received_);
      }
      const auto receipt = answer(offset, doubts);
      if (!receipt) continue;
      answered_s = line_.now_s();
      offered_s_.reset();
      if (receipt->stage == glove::kRuns) break;
      if (receipt->stage != 0) {
        throw JobError("the glove does not take the model: {}; it runs its old model",
                       reason_of(receipt->stage));
      }
      received_ = std::min<std::size_t>(receipt->received, bytes.size());
      if (received_ > most) further_s = line_.now_s();
      most = std::max(most, received_);
      report_progress(received_);
    }
    report_progress(bytes.size());
  }

  // The piece that is wanted next; where all have come, the last one once more: the glove answers when it runs.
  // Returns where the piece begins.
  std::size_t send_piece(const Bytes& bytes, std::size_t received) {
    const std::size_t last = (bytes.size() - 1) / link::Piece::kMost * link::Piece::kMost;
    const std::size_t offset = std::min(received, last);
    const auto count = std::min<std::size_t>(link::Piece::kMost, bytes.size() - offset);
    await_turn();
    link::Packet packet;
    const std::uint8_t size =
        link::put_piece({static_cast<std::uint16_t>(bytes.size()), static_cast<std::uint16_t>(offset),
                         static_cast<std::uint8_t>(count), bytes.data() + offset},
                        packet.body());
    write(link::Type::coefficients, packet, size, glove_.key ? &session_.key() : nullptr);
    ++pieces_;
    return offset;
  }

  // To a piece that begins at `offset`. One that came twice is answered twice: what does not go beyond it is of the piece before.
  std::optional<link::Receipt> answer(std::size_t offset, bool doubts) {
    const double lost_s = line_.now_s() + kLost_s;
    while (receives(lost_s)) {
      // Somebody has asked again, or the air has doubled the question: what counts now is this offer.
      if (is_offer()) {
        const std::optional<double> since_s = doubts ? std::nullopt : offered_s_;
        (void)accept(link::get_offer(reader_.body()));
        if (since_s) offered_s_ = since_s;
        return {};
      }
      if (!is(link::Answer::receipt, link::Receipt::kBytes) ||
          (glove_.key && !reader_.fits(session_.key(), reader_.sequence())))
        continue;
      const link::Receipt receipt = link::get_receipt(reader_.body());
      turn_ = reader_.listens();
      if (receipt.stage != 0 || receipt.received > offset) return receipt;
    }
    return {};
  }

  void report_progress(std::size_t bytes) const {
    if (progress_) progress_(static_cast<int>(bytes), all_);
  }

  const Line& line_;
  Glove glove_;
  const SendProgress& progress_;
  link::PacketReader reader_;
  std::vector<std::uint8_t> came_;
  std::size_t at_ = 0;
  bool turn_ = false;  // it listens now
  link::Session session_;
  std::uint32_t sequence_ = 0;
  int all_ = 0;
  int pieces_ = 0;
  std::size_t received_ = 0;
  std::optional<double> offered_s_;  // when an offer came that no receipt has followed
};

}  // namespace

Sent send_model(const Line& line, const Glove& glove, const SendProgress& progress, const AtRate& at_rate) {
  return Sender(line, glove, progress).run(at_rate);
}

}  // namespace flexor::deploy
