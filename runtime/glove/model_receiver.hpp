// Takes a model, piece by piece, from whoever has the pair's key, and has it written down.
//
// A request is answered with an offer: what fits here, and a nonce. Only pieces under the key that is made of it are
// taken, so that no model that was sent before is taken again: its number is
// the store's checksum. Each is answered with how far it has come; a
// piece may come twice. Without a key whoever is near can send a model.
#pragma once

#include "runtime/glove/model_store.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor {
namespace glove {

static_assert(kChunk == link::Piece::kMost, "a piece is written at once");

// Stages of a model, beside 0, which goes on, and 2 + compensator::Loaded.
constexpr uint8_t kRuns = 1;
constexpr uint8_t kNotWritten = 254;  // what was read back is not what was written
constexpr uint8_t kNotTaken = 255;    // too large

// What an image takes.
struct Terms {
  uint8_t rate_hz;
  const uint16_t* calibration;  // of kFingers sensors
};

template <class Eeprom>
class ModelReceiver {
 public:
  using Store = ModelStore<Eeprom>;

  ModelReceiver(const link::Key* pair, Store& store) : pair_(pair), store_(store) {}

  // A request came: pieces that answer this nonce are taken from now on. Two SipHashes.
  void challenge(const link::Nonce& nonce) {
    session_.start(nonce);
    while (pair_ != nullptr && !session_.ready()) session_.derive(*pair_);
    window_.restart();
    begun_ = false;
    count_ = 0;
    answer_ = link::Answer::offer;
    is_due_ = true;
  }

  // A whole frame of coefficients; whether it is believed. One SipHash.
  bool take(link::PacketReader& packet, Eeprom& eeprom) {
    const link::Piece piece = link::get_piece(packet.body(), packet.body_bytes());
    if (piece.count == 0 || !believed(packet)) return false;
    if (reloads_ || count_ > 0) return true;
    if (!begun_ && !begin(piece, eeprom)) {
      report(kNotTaken);
    } else if (stage_ != 0 || piece.offset != store_.received()) {
      report(stage_);
    } else {
      for (uint8_t i = 0; i < piece.count; ++i) bytes_[i] = piece.bytes[i];
      count_ = piece.count;
    }
    return true;
  }

  // Writes one byte at most. True: what the store has now is to be loaded, and loaded() to be called. A model is tried
  // before it counts: power that is lost meanwhile leaves the old one.
  bool work(Eeprom& eeprom) {
    const Stored stored = store_.work(eeprom);
    if (reloads_) return true;
    if (stage_ != 0 || !begun_) return false;
    if (stored == Stored::failed) refuse(kNotWritten);
    if (stored == Stored::committed) report(kRuns);
    if (stored != Stored::ready) return stored == Stored::whole;
    if (count_ > 0) {
      // More than the slot has room for: answered with what there is.
      if (!store_.write(store_.received(), bytes_, count_)) stage_ = kNotTaken;
      count_ = 0;
      report(stage_);
    } else if (store_.received() == size_) {
      store_.commit();
    }
    return false;
  }

  // `reason`: compensator::Loaded. A model that cannot run never counts, and what was there before is to be loaded again.
  void loaded(uint8_t reason) {
    if (reloads_) {
      reloads_ = false;
    } else if (reason == 0) {
      store_.keep();
    } else {
      store_.drop();
      refuse(static_cast<uint8_t>(2 + reason));
    }
  }

  // Not to sleep: there is something to write.
  bool busy() const { return reloads_ || (begun_ && stage_ == 0); }

  // What is to be sent, to wire; 0: nothing.
  uint8_t answer(const Terms& terms, uint16_t model, uint8_t* wire) {
    if (!is_due_) return 0;
    is_due_ = false;
    link::Packet packet;
    uint8_t bytes = 0;
    if (answer_ == link::Answer::offer) {
      link::Offer offer = {session_.nonce(), kSlotRoom, terms.rate_hz, model, {}};
      for (uint8_t i = 0; i < link::kFingers; ++i) offer.calibration[i] = terms.calibration[i];
      bytes = link::put_offer(offer, packet.body());
    } else {
      bytes = link::put_receipt({store_.received(), stage_}, packet.body());
    }
    const link::Key* session = pair_ == nullptr ? nullptr : &session_.key();
    const link::Key* key = answer_ == link::Answer::offer ? pair_ : session;
    return packet.seal({link::Type::coefficients, false, true, sequence_++}, bytes, key, wire);
  }

 private:
  bool believed(link::PacketReader& packet) {
    if (pair_ == nullptr) return session_.started() && !packet.guarded();
    if (!session_.ready() || !packet.guarded()) return false;
    const uint32_t counter = window_.counter_of(packet.sequence());
    if (counter >= link::kCounters || !packet.fits(session_.key(), counter)) return false;
    window_.accept(counter);
    return true;
  }

  bool begin(const link::Piece& piece, Eeprom& eeprom) {
    begun_ = true;
    size_ = piece.size;
    stage_ = store_.begin(eeprom, piece.size) ? 0 : kNotTaken;
    return stage_ == 0;
  }

  void refuse(uint8_t stage) {
    report(stage);
    reloads_ = true;
  }

  void report(uint8_t stage) {
    stage_ = stage;
    answer_ = link::Answer::receipt;
    is_due_ = true;
  }

  const link::Key* pair_;
  Store& store_;
  link::Session session_;
  link::Window window_;
  uint16_t sequence_ = 0;
  uint16_t size_ = 0;  // of the model
  bool begun_ = false;
  uint8_t stage_ = 0;
  uint8_t count_ = 0;  // bytes that wait to be written
  uint8_t bytes_[kChunk] = {};
  link::Answer answer_ = link::Answer::offer;
  bool is_due_ = false;
  bool reloads_ = false;
};

}  // namespace glove
}  // namespace flexor
