// SPDX-License-Identifier: Apache-2.0
// Deflate (RFC 1951) in blocks with codes of their own. Matches are runs only, so the one distance
// is 1; bytes are looked at by eight.
#include "run_deflate.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <vector>

namespace organbake {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr unsigned kSymbols = 286, kEnd = 256;  // bytes, the block's end, lengths of runs
constexpr unsigned kLongestCode = 12;           // bits, so that four go into a word
constexpr std::size_t kBlock = std::size_t{1} << 17, kLongestRun = 258, kShortestMatch = 3;

using Counts = std::array<std::uint32_t, kSymbols>;
using Lengths = std::array<std::uint8_t, kSymbols>;

struct Bits {
  std::uint32_t value = 0, count = 0;
};

struct Run {
  std::size_t begin, end;
};

std::size_t blocks_of(std::size_t bytes) {
  return std::max<std::size_t>(1, (bytes + kBlock - 1) / kBlock);
}

std::uint64_t eight_bytes(const std::uint8_t* at) {
  std::uint64_t word;
  std::memcpy(&word, at, sizeof(word));
  return word;
}

class BitWriter {
 public:
  explicit BitWriter(char* to) : to_(to) {}
  // At most 56 bits between two flushes. Up to eight bytes are written beyond the last one.
  void put(Bits bits) {
    word_ |= std::uint64_t{bits.value} << count_;
    count_ += bits.count;
  }
  void flush() {
    std::memcpy(to_, &word_, sizeof(word_));
    to_ += count_ / 8;
    word_ >>= count_ & ~7u;
    count_ &= 7;
  }
  char* end() {
    put({0, 7});
    flush();
    return to_;
  }

 private:
  std::uint64_t word_ = 0;
  unsigned count_ = 0;
  char* to_;
};

// How a match of a length is told: a symbol, and bits behind it.
struct Match {
  std::uint16_t symbol = 0;
  Bits more;
};

std::array<Match, kLongestRun + 1> all_matches() {
  constexpr unsigned kFirst = 257, kLast = 285;
  std::array<Match, kLongestRun + 1> matches;
  unsigned length = kShortestMatch;
  for (unsigned symbol = kFirst; symbol < kLast; ++symbol) {
    const unsigned bits = symbol < 265 ? 0 : (symbol - 261) / 4;
    for (unsigned i = 0; i < 1u << bits && length < kLongestRun; ++i, ++length)
      matches[length] = {static_cast<std::uint16_t>(symbol), {i, bits}};
  }
  matches[kLongestRun] = {kLast, {}};
  return matches;
}

const Match& match(std::size_t length) {
  static const auto matches = all_matches();
  return matches[length];
}

// A run goes by several matches, none of which may be left too short.
template <class Put>
void for_each_match(std::size_t length, const Put& put) {
  while (length > 0) {
    const std::size_t part =
        length <= kLongestRun ? length : std::min(kLongestRun, length - kShortestMatch);
    put(match(part));
    length -= part;
  }
}

// Where a byte is repeated eight times or more, behind the one that is repeated.
std::vector<Run> runs_of(std::span<const std::uint8_t> bytes) {
  std::vector<Run> runs;
  const auto changes = [&](std::size_t i) {
    return eight_bytes(&bytes[i]) ^ eight_bytes(&bytes[i - 1]);
  };
  for (std::size_t i = 1; i + 8 <= bytes.size();) {
    const std::uint64_t change = changes(i);
    if (change != 0) {  // no such run begins before the last of them
      i += 8 - static_cast<std::size_t>(std::countl_zero(change)) / 8;
      continue;
    }
    std::size_t end = i + 8;
    std::uint64_t next = 0;
    while (end + 8 <= bytes.size() && (next = changes(end)) == 0) end += 8;
    if (next != 0) end += static_cast<std::size_t>(std::countr_zero(next)) / 8;
    runs.push_back({i, end});
    i = end + 1;
  }
  return runs;
}

// literals(first, last) and run(length) in turn, in the order of the bytes.
template <class Literals, class RunOf>
void walk(std::size_t count, const std::vector<Run>& runs, const Literals& literals,
          const RunOf& run) {
  std::size_t at = 0;
  for (const Run& one : runs) {
    literals(at, one.begin);
    run(one.end - one.begin);
    at = one.end;
  }
  literals(at, count);
}

Counts count_symbols(std::span<const std::uint8_t> bytes, const std::vector<Run>& runs) {
  Counts counts{};
  std::array<std::array<std::uint32_t, 256>, 4> apart{};  // no count waits for the one before
  walk(
      bytes.size(), runs,
      [&](std::size_t first, std::size_t last) {
        for (; first + 4 <= last; first += 4)
          for (std::size_t k = 0; k < 4; ++k) ++apart[k][bytes[first + k]];
        for (; first < last; ++first) ++apart[0][bytes[first]];
      },
      [&](std::size_t length) {
        for_each_match(length, [&](const Match& part) { ++counts[part.symbol]; });
      });
  for (std::size_t i = 0; i < 256; ++i)
    for (const auto& some : apart) counts[i] += some[i];
  counts[kEnd] = 1;
  return counts;
}

// Huffman's tree by two queues (van Leeuwen 1976): leaves by their counts, and nodes as they come,
// with growing counts, too.
Lengths huffman_lengths(const Counts& counts) {
  struct Node {
    std::uint32_t count;
    unsigned parent, depth;
  };
  constexpr unsigned kSymbolBits = 9;
  std::vector<std::uint64_t> symbols;  // by their counts
  for (std::uint64_t s = 0; s < kSymbols; ++s)
    if (counts[s] > 0) symbols.push_back(std::uint64_t{counts[s]} << kSymbolBits | s);
  std::sort(symbols.begin(), symbols.end());
  const std::size_t leaves = symbols.size();
  std::vector<Node> nodes;
  nodes.reserve(2 * leaves);
  for (const std::uint64_t s : symbols)
    nodes.push_back({static_cast<std::uint32_t>(s >> kSymbolBits), 0, 0});
  std::size_t leaf = 0, inner = leaves;
  const auto least = [&]() -> Node& {
    const bool first =
        leaf < leaves && (inner == nodes.size() || nodes[leaf].count <= nodes[inner].count);
    return nodes[first ? leaf++ : inner++];
  };
  while (nodes.size() < 2 * leaves - 1) {
    Node &one = least(), &other = least();
    one.parent = other.parent = static_cast<unsigned>(nodes.size());
    nodes.push_back({one.count + other.count, 0, 0});
  }
  for (std::size_t i = nodes.size() - 1; i-- > 0;)
    nodes[i].depth = nodes[nodes[i].parent].depth + 1;
  Lengths lengths{};
  for (std::size_t i = 0; i < leaves; ++i)
    lengths[symbols[i] % (1u << kSymbolBits)] =
        static_cast<std::uint8_t>(std::max(1u, nodes[i].depth));
  return lengths;
}

Lengths code_lengths(Counts counts) {
  for (;;) {
    const Lengths lengths = huffman_lengths(counts);
    if (*std::max_element(lengths.begin(), lengths.end()) <= kLongestCode) return lengths;
    for (std::uint32_t& count : counts) count = (count + 1) / 2;  // what is rare counts for more
  }
}

std::uint32_t reversed(std::uint32_t value, unsigned bits) {
  std::uint32_t result = 0;
  for (unsigned i = 0; i < bits; ++i) result |= (value >> i & 1) << (bits - 1 - i);
  return result;
}

// By length, and by symbol among those of one length.
std::array<Bits, kSymbols> codes_of(const Lengths& lengths) {
  std::array<Bits, kSymbols> codes{};
  std::uint32_t next = 0;
  for (unsigned length = 1; length <= kLongestCode; ++length, next <<= 1)
    for (unsigned s = 0; s < kSymbols; ++s)
      if (lengths[s] == length) codes[s] = {reversed(next++, length), length};
  return codes;
}

// The lengths are told by four bits each: a code for lengths would save less than it takes.
void put_header(const Lengths& lengths, bool last, BitWriter& to) {
  constexpr unsigned kOfLengths = 19, kRepeats = 3;  // symbols, of which the first three come first
  to.put({last, 1});
  to.put({2, 2});
  to.put({kSymbols - 257, 5});
  to.put({0, 5});  // one distance
  to.put({kOfLengths - 4, 4});
  for (unsigned i = 0; i < kOfLengths; ++i) {
    to.put({i < kRepeats ? 0u : 4u, 3});
    to.flush();
  }
  for (const std::uint8_t length : lengths) {
    to.put({reversed(length, 4), 4});
    to.flush();
  }
  to.put({reversed(1, 4), 4});
}

void put_block(std::span<const std::uint8_t> bytes, bool last, BitWriter& to) {
  const std::vector<Run> runs = runs_of(bytes);
  const Lengths lengths = code_lengths(count_symbols(bytes, runs));
  const auto codes = codes_of(lengths);
  put_header(lengths, last, to);
  to.flush();
  walk(
      bytes.size(), runs,
      [&](std::size_t first, std::size_t end) {
        for (; first + 4 <= end; first += 4) {
          for (std::size_t k = 0; k < 4; ++k) to.put(codes[bytes[first + k]]);
          to.flush();
        }
        for (; first < end; ++first) {
          to.put(codes[bytes[first]]);
          to.flush();
        }
      },
      [&](std::size_t length) {
        for_each_match(length, [&](const Match& part) {
          to.put(codes[part.symbol]);
          to.put(part.more);
          to.put({0, 1});  // the distance
          to.flush();
        });
      });
  to.put(codes[kEnd]);
  to.flush();
}

}  // namespace

std::size_t run_deflate_bound(std::size_t bytes) {
  constexpr std::size_t kAround = 32, kHeader = 256;
  return kAround + kHeader * blocks_of(bytes) + (bytes / 8 + 1) * kLongestCode;
}

std::size_t run_deflate(std::span<const std::uint8_t> bytes, char* to) {
  char* end = to;
  *end++ = 0x78, *end++ = 0x01;
  BitWriter bits(end);
  const std::size_t blocks = blocks_of(bytes.size());
  for (std::size_t b = 0; b < blocks; ++b)
    put_block(bytes.subspan(b * kBlock, std::min(kBlock, bytes.size() - b * kBlock)),
              b + 1 == blocks, bits);
  end = bits.end();
  const std::uint32_t sum = libdeflate_adler32(1, bytes.data(), bytes.size());
  for (int shift = 24; shift >= 0; shift -= 8) *end++ = static_cast<char>(sum >> shift & 255);
  return static_cast<std::size_t>(end - to);
}

}  // namespace organbake
