// Somebody who has the pair's key and receives both boards: what the hand believes, and why.
#pragma once

#include <algorithm>

#include "host/deploy/config.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {

class RadioEar {
 public:
  // `key` outlives this object.
  explicit RadioEar(const deploy::Key& key) : receiver_(key ? &*key : nullptr), key_(key) {}

  // A byte that the hand sends: its challenges are followed.
  void hand_sent(std::uint8_t byte) {
    if (reader_.push(byte) != link::Received::pending || reader_.type() != link::Type::challenge) return;
    link::Nonce nonce{};
    std::copy_n(reader_.body(), link::kNonceBytes, nonce.bytes);
    if (session_.started() && nonce == session_.nonce()) return;
    receiver_.challenge(nonce);
    session_.start(nonce);
    while (!session_.ready()) session_.derive(*key_);
  }

  // A byte of the glove's, where this ear is.
  link::Received glove_sent(std::uint8_t byte) { return receiver_.receive(byte); }

  const link::Receiver& receiver() const { return receiver_; }
  // For who wants to send as the glove does; null: without a key, or before the first challenge.
  const link::Key* session_key() const { return session_.ready() ? &session_.key() : nullptr; }

 private:
  link::Receiver receiver_;
  link::PacketReader reader_;
  link::Session session_;
  const deploy::Key& key_;
};

}  // namespace flexor::cosim
