// What a glove sends on its line, and when: frames in its slots, its state and its readings before them where somebody has
// asked, and turns for the other end. It receives challenges and requests; the caller sends the bytes. A request
// takes the place of one frame in ten at most: anybody may ask.
#pragma once

#include "runtime/link/glove_end.hpp"
#include "runtime/link/glove_turns.hpp"

namespace flexor {
namespace link {

// Of a glove that takes no models.
struct NoModels {
  bool take(PacketReader&) { return false; }
  void offer() {}
};

// Whether a slot has the time for readings and angles together, 16 and 25 bytes of ten bits.
constexpr bool has_room(uint32_t baud, uint8_t slots_per_second) { return 410UL * slots_per_second <= baud; }

// Board: uint8_t reset_cause(), uint32_t uptime_s(), void send(Type, const uint8_t* wire, uint8_t bytes).
// Models: bool take(PacketReader&), whether a frame of coefficients is believed, and void offer(), one is asked for.
class GloveSender {
 public:
  // slots_per_second: so often send_frame() is called. has_room: has_room(); without it one slot of ten has readings.
  GloveSender(const Key* pair, const Turns& turns, uint8_t slots_per_second, bool has_room)
      : end_(pair, static_cast<uint16_t>(kSettled_s * slots_per_second)),
        turns_(turns),
        slots_per_second_(slots_per_second),
        has_room_(has_room) {}

  // At its start: the hand's challenge, if it comes at once, is there before the first sample.
  template <class Board>
  void start(Board& board) {
    if (!end_.in_touch()) send_state(true, board);
  }

  // A byte came.
  template <class Models>
  void push(uint8_t byte, Models& models) {
    turns_.byte();
    const Received result = end_.push(byte);
    if (result == Received::pending || result == Received::other) turns_.received();
    if (result == Received::pending) take(models);
  }

  // A slot for a frame. counts: kFingers readings of its sample.
  template <class Board>
  void send_frame(Frame& frame, const uint16_t* counts, Board& board) {
    if (!turns_.take_slot(end_.packet().amid())) return;
    const bool listens = turns_.listens(!end_.in_touch());
    if (until_state_ > 0) --until_state_;
    // First: after a frame that listens the hand sends.
    if (readings_left_ > 0 && (--readings_left_ % 10 == 0 || has_room_)) send_readings(frame, counts, board);
    if (!end_.in_touch()) {
      if (listens) send_state(true, board);
      return;
    }
    if (wants_state_ && until_state_ == 0) send_state(false, board);
    send_angles(frame, listens, board);
  }

  GloveEnd& end() { return end_; }

 private:
  template <class Models>
  void take(Models& models) {
    const Type type = end_.packet().type();
    if (type == Type::coefficients && models.take(end_.packet())) turns_.favour(slots_per_second_);
    if (type != Type::request || end_.packet().body_bytes() != 1) return;
    const Request request = static_cast<Request>(end_.packet().body()[0]);
    if (request == Request::coefficients) models.offer();
    if (request == Request::state) wants_state_ = true;
    if (request == Request::readings) readings_left_ = slots_per_second_;
  }

  template <class Board>
  void send_angles(Frame& frame, bool listens, Board& board) {
    uint8_t wire[kMaxWire];
    const uint8_t bytes = end_.angles(frame, listens, wire);
    board.send(Type::angles, wire, bytes);
  }

  template <class Board>
  void send_state(bool listens, Board& board) {
    wants_state_ = false;
    until_state_ = slots_per_second_;
    uint8_t wire[kMaxWire];
    board.send(Type::state, wire, end_.state(board.reset_cause(), board.uptime_s(), wire, listens));
  }

  template <class Board>
  void send_readings(const Frame& frame, const uint16_t* counts, Board& board) {
    Packet packet;
    const uint8_t body_bytes = put_readings(frame.time_ms, counts, kFingers, packet.body());
    uint8_t wire[kMaxWire];
    board.send(Type::readings, wire, GloveEnd::seal(Type::readings, packet, body_bytes, false, wire));
  }

  static constexpr uint16_t kSettled_s = 30;

  GloveEnd end_;
  GloveTurns turns_;
  uint8_t slots_per_second_;
  bool has_room_;
  uint8_t readings_left_ = 0;  // slots
  uint8_t until_state_ = 0;    // slots: one a second is answered
  bool wants_state_ = false;
};

}  // namespace link
}  // namespace flexor
