// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/dicom_mask_bytes.h"

#include <cstdint>

#include "organbake/core/text.h"
#include "support/dicom_bytes.h"

namespace organbake {
namespace {

constexpr const char* kSegmentation = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kRle = "1.2.840.10008.1.2.5";
constexpr const char* kStructureSet = "1.2.840.10008.5.1.4.1.1.481.3";

std::string us(int value) { return dicom_number(static_cast<std::uint32_t>(value), 2); }

}  // namespace

std::string SegBytes::bytes() const {
  std::vector<std::string> groups, segments;
  std::string raw;
  std::size_t bit = 0;
  for (const Frame& frame : frames) {
    groups.push_back(
        dicom_sequence(0x20, 0x9113,
                       {dicom_element(0x20, 0x0032, "DS", "10\\-20\\" + to_text(frame.z))}) +
        dicom_sequence(0x62, 0x000A, {dicom_element(0x62, 0x000B, "US", us(frame.segment))}));
    for (const int value : frame.values) {
      if (bits == 8) raw += static_cast<char>(value);
      if (bits == 8) continue;
      if (bit % 8 == 0) raw += '\0';
      raw.back() = static_cast<char>(raw.back() | value << (bit % 8));
      ++bit;
    }
  }
  for (const char* name : {"liver", "cyst, large"}) {
    segments.push_back(
        dicom_element(0x62, 0x0004, "US", us(static_cast<int>(segments.size()) + 1)) +
        dicom_element(0x62, 0x0005, "LO", name));
  }
  const std::string shared =
      dicom_sequence(0x20, 0x9116, {dicom_element(0x20, 0x0037, "DS", "1\\0\\0\\0\\1\\0")}) +
      dicom_sequence(0x28, 0x9110, {dicom_element(0x28, 0x0030, "DS", "0.5\\0.75")});
  return dicom_head(kSegmentation, rle ? kRle : "1.2.840.10008.1.2.1") +
         dicom_element(8, 0x0016, "UI", kSegmentation) + dicom_element(8, 0x0060, "CS", "SEG") +
         dicom_element(0x28, 0x0008, "IS", std::to_string(frames.size())) +
         dicom_element(0x28, 0x0010, "US", us(5)) + dicom_element(0x28, 0x0011, "US", us(7)) +
         dicom_element(0x28, 0x0100, "US", us(bits)) + dicom_element(0x28, 0x0101, "US", us(bits)) +
         dicom_element(0x28, 0x0102, "US", us(bits - 1)) + dicom_element(0x62, 0x0001, "CS", kind) +
         dicom_sequence(0x62, 0x0002, segments) +
         (kind == "FRACTIONAL" ? dicom_element(0x62, 0x000E, "US", us(200)) : "") +
         dicom_sequence(0x5200, 0x9229, {shared}) + dicom_sequence(0x5200, 0x9230, groups) +
         (rle ? run_lengths() : dicom_element(0x7FE0, 0x0010, "OB", raw));
}

std::string SegBytes::run_lengths() const {
  const auto item = [](std::string body) {
    if (body.size() % 2) body += '\0';
    return dicom_number(0xE000FFFE, 4) + dicom_number(static_cast<std::uint32_t>(body.size()), 4) +
           body;
  };
  std::string pixels = dicom_number(0x00107FE0, 4) + std::string("OB\0\0", 4) +
                       dicom_number(0xFFFFFFFF, 4) + item({});
  for (const Frame& frame : frames) {
    std::string segment;
    std::size_t zeros = 0;
    while (zeros < frame.values.size() && frame.values[zeros] == 0) ++zeros;
    if (zeros > 1) segment += {static_cast<char>(257 - zeros), '\0'};
    const std::size_t first = zeros > 1 ? zeros : 0;
    if (first < frame.values.size()) segment += static_cast<char>(frame.values.size() - first - 1);
    for (std::size_t i = first; i < frame.values.size(); ++i)
      segment += static_cast<char>(frame.values[i]);
    pixels += item(dicom_number(1, 4) + dicom_number(64, 4) + std::string(56, '\0') + segment);
  }
  return pixels + dicom_number(0xE0DDFFFE, 4) + dicom_number(0, 4);
}

std::string structure_set(const std::vector<Roi>& regions, const Eigen::Matrix3d& axes) {
  std::vector<std::string> names, drawn;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const std::string number = std::to_string(i + 4);
    names.push_back(dicom_element(0x3006, 0x0022, "IS", number) +
                    dicom_element(0x3006, 0x0026, "LO", regions[i].name));
    std::vector<std::string> contours;
    for (const auto& [z, points] : regions[i].contours) {
      std::string data;
      for (const Eigen::Vector2d& p : points) {
        const Eigen::Vector3d world = axes * Eigen::Vector3d(p.x(), p.y(), z);
        for (int axis = 0; axis < 3; ++axis) {
          data += (data.empty() ? "" : "\\") + to_text(world[axis], 6);
        }
      }
      contours.push_back(dicom_element(0x3006, 0x0042, "CS", "CLOSED_PLANAR") +
                         dicom_element(0x3006, 0x0050, "DS", data));
    }
    drawn.push_back(dicom_sequence(0x3006, 0x0040, contours) +
                    dicom_element(0x3006, 0x0084, "IS", number));
  }
  return dicom_head(kStructureSet) + dicom_element(8, 0x0016, "UI", kStructureSet) +
         dicom_element(8, 0x0060, "CS", "RTSTRUCT") + dicom_sequence(0x3006, 0x0020, names) +
         dicom_sequence(0x3006, 0x0039, drawn);
}

}  // namespace organbake
