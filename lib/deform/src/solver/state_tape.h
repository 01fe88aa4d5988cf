// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <any>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "contact/contact.h"
#include "organbake/deform/deformer.h"

namespace organbake {

// What the parts of a solver remember from step to step, member after member in the order in which
// each part's pass() names them: by a StateWriter away, by a StateReturner back. Lists of plain
// values are held in pieces, which a state shares with an earlier one where nothing has changed.
struct Deformer::State::Tape {
  using Piece = std::shared_ptr<const std::vector<std::byte>>;
  static constexpr std::size_t kPieceBytes = 8192;

  std::vector<std::size_t> sizes;  // of the lists, in bytes
  std::vector<Piece> pieces;       // of all lists
  std::vector<std::any> others;    // members that are no such lists, whole
  std::size_t other_bytes = 0;
};

namespace deform {

// Values whose bytes are all that they are: Eigen's fixed vectors are, although they don't say so.
template <class T>
inline constexpr bool kPlain = std::is_trivially_destructible_v<T> && !std::is_pointer_v<T>;

class StateWriter {
 public:
  using Tape = Deformer::State::Tape;
  StateWriter(Tape& tape, const Tape* earlier) : tape_(tape), earlier_(earlier) {}

  template <class... Members>
  void operator()(const Members&... members) {
    (write(members), ...);
  }

 private:
  template <class T>
  void write(const T& member) {
    tape_.others.emplace_back(member);
    tape_.other_bytes += sizeof(T);
  }
  // Without their columns, which are made again when they are asked for.
  void write(const std::vector<Contact>& contacts) {
    std::vector<Contact> kept = contacts;
    for (Contact& c : kept)
      if (Carried* carried = c.as<Carried>()) carried->response.column.reset();
    tape_.other_bytes += kept.size() * sizeof(Contact);
    tape_.others.emplace_back(std::move(kept));
  }
  template <class T>
  requires kPlain<T>
  void write(const std::vector<T>& list) {
    const std::span bytes(reinterpret_cast<const std::byte*>(list.data()), list.size() * sizeof(T));
    tape_.sizes.push_back(bytes.size());
    for (std::size_t at = 0; at < bytes.size(); at += Tape::kPieceBytes)
      add(bytes.subspan(at, std::min(Tape::kPieceBytes, bytes.size() - at)));
  }
  void add(std::span<const std::byte> bytes) {
    const std::size_t number = tape_.pieces.size();
    if (earlier_ && number < earlier_->pieces.size() &&
        std::ranges::equal(*earlier_->pieces[number], bytes)) {
      tape_.pieces.push_back(earlier_->pieces[number]);
    } else {
      tape_.pieces.push_back(
          std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end()));
    }
  }

  Tape& tape_;
  const Tape* earlier_;
};

class StateReturner {
 public:
  using Tape = Deformer::State::Tape;
  explicit StateReturner(const Tape& tape) : tape_(tape) {}

  template <class... Members>
  void operator()(Members&... members) {
    (give_back(members), ...);
  }

 private:
  template <class T>
  void give_back(T& member) {
    member = std::any_cast<const T&>(tape_.others[other_++]);
  }
  template <class T>
  requires kPlain<T>
  void give_back(std::vector<T>& list) {
    std::size_t left = tape_.sizes[list_++];
    list.resize(left / sizeof(T));
    auto* to = reinterpret_cast<std::byte*>(list.data());
    while (left > 0) {
      const std::vector<std::byte>& piece = *tape_.pieces[piece_++];
      to = std::copy(piece.begin(), piece.end(), to);
      left -= piece.size();
    }
  }

  const Tape& tape_;
  std::size_t list_ = 0, piece_ = 0, other_ = 0;
};

}  // namespace deform
}  // namespace organbake
