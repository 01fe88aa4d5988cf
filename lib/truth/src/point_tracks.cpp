// SPDX-License-Identifier: Apache-2.0
// Tracks are the flow from a clip's first picture to each of the others, at pixels spread evenly
// over its skin; what flow calls hidden is occluded, as TAP-Vid says it (Doersch et al. 2022). The
// file is a zip of arrays as NumPy stores them (numpy.lib.format, version 1.0).
#include "point_tracks.h"

#include <algorithm>

namespace organbake {
namespace {

// Arrays as NumPy's .npz: a ZIP file of .npy, which nothing packs.
class Npz {
 public:
  // kind: NumPy's, as "<f4".
  template <class Number>
  void add(const std::string& name, const std::string& kind, const std::vector<std::size_t>& shape,
           const std::vector<Number>& numbers) {
    std::string sides;
    for (const std::size_t side : shape) sides += std::to_string(side) + ", ";
    std::string header =
        "{'descr': '" + kind + "', 'fortran_order': False, 'shape': (" + sides + "), }";
    constexpr std::size_t kMagic = 10, kAligned = 64;
    header.append(kAligned - 1 - (kMagic + header.size()) % kAligned, ' ');
    header += '\n';
    std::string array = "\x93NUMPY\x01";
    array += '\0';
    put(array, header.size(), 2);
    array += header;
    array.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    append(name + ".npy", array);
  }
  std::string bytes() const {
    std::string all = files_ + directory_ + "PK\x05\x06";
    put(all, 0, 4);
    put(all, count_, 2), put(all, count_, 2);
    put(all, directory_.size(), 4), put(all, files_.size(), 4), put(all, 0, 2);
    return all;
  }

 private:
  static void put(std::string& to, std::size_t number, int bytes) {  // the lowest first
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(number >> (8 * i) & 0xFF);
  }
  static std::uint32_t crc32(const std::string& bytes) {
    std::uint32_t crc = ~0u;
    for (const char byte : bytes) {
      crc ^= static_cast<unsigned char>(byte);
      for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
    return ~crc;
  }
  void append(const std::string& name, const std::string& content) {
    constexpr std::size_t kVersion = 20, kFirstDay = 0x21;  // of 1980: the same bytes every day
    std::string what;                                       // the same in both headers
    put(what, kVersion, 2), put(what, 0, 6), put(what, kFirstDay, 2), put(what, crc32(content), 4);
    put(what, content.size(), 4), put(what, content.size(), 4), put(what, name.size(), 2);
    put(what, 0, 2);
    directory_ += "PK\x01\x02";
    put(directory_, kVersion, 2);
    directory_ += what;
    put(directory_, 0, 10), put(directory_, files_.size(), 4);
    directory_ += name;
    files_ += "PK\x03\x04" + what + name + content;
    ++count_;
  }

  std::string files_, directory_;
  std::size_t count_ = 0;
};

}  // namespace

void PointTracks::add(const TruthTracker& tracker, const LensPicture* lens,
                      const PixelTruth& seen) {
  if (wanted_ == 0) return;
  if (frames_++ == 0) {
    first_ = tracker.now(), first_moment_ = tracker.moment();
    choose(seen);
  }
  Flow drawn, flow;
  find_flow(first_, first_moment_, tracker.now(), tracker.moment(), drawn);
  if (lens) lens->show(drawn, first_, flow);
  const Flow& moved = lens ? flow : drawn;
  for (const Point& p : points_) {
    const Eigen::Vector2f px =
        moved.px[p.pixel] + Eigen::Vector2f(static_cast<float>(p.pixel % width_) + 0.5f,
                                            static_cast<float>(p.pixel / width_) + 0.5f);
    const Eigen::Vector3f at = tracker.moment().place(p.organ, p.bound);
    px_.insert(px_.end(), {px.x(), px.y()});
    xyz_mm_.insert(xyz_mm_.end(), {at.x(), at.y(), at.z()});
    hidden_.push_back(moved.seen[p.pixel] == 0);
  }
}

void PointTracks::choose(const PixelTruth& seen) {
  width_ = static_cast<std::size_t>(seen.width);
  std::vector<std::size_t> skin;
  for (std::size_t i = 0; i < seen.pixels(); ++i)
    if (seen.bound[i].has_skin() && seen.solid_at(i) == 0) skin.push_back(i);
  const std::size_t count = std::min(wanted_, skin.size());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t pixel = skin[(2 * k + 1) * skin.size() / (2 * count)];
    points_.push_back({pixel, seen.organ_at(pixel), seen.bound[pixel]});
  }
}

template <class Number>
std::vector<Number> PointTracks::by_point(const std::vector<Number>& by_frame,
                                          std::size_t each) const {
  std::vector<Number> numbers;
  for (std::size_t p = 0; p < points_.size(); ++p)
    for (std::size_t f = 0; f < frames_; ++f)
      for (std::size_t k = 0; k < each; ++k)
        numbers.push_back(by_frame[(f * points_.size() + p) * each + k]);
  return numbers;
}

std::optional<std::string> PointTracks::take() {
  if (frames_ == 0) return std::nullopt;
  Npz npz;
  npz.add("points", "<f4", {points_.size(), frames_, 2}, by_point(px_, 2));
  npz.add("occluded", "|b1", {points_.size(), frames_}, by_point(hidden_, 1));
  npz.add("xyz_mm", "<f4", {points_.size(), frames_, 3}, by_point(xyz_mm_, 3));
  *this = PointTracks(static_cast<int>(wanted_));
  return npz.bytes();
}

}  // namespace organbake
