// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/files.h"

#include "organbake/core/text.h"

namespace organbake {
std::string dicom_number(std::uint32_t value, int bytes) {
  std::string out;
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
  return out;
}

std::string dicom_element(std::uint16_t group, std::uint16_t number, const std::string& vr,
                          const std::string& text) {
  std::string value = text;
  if (value.size() % 2) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
  const bool long_form = vr == "OB" || vr == "OW" || vr == "SQ";
  const auto length = static_cast<std::uint32_t>(value.size());
  return dicom_number(group, 2) + dicom_number(number, 2) + vr +
         (long_form ? std::string(2, '\0') + dicom_number(length, 4) : dicom_number(length, 2)) +
         value;
}

std::string dicom_sequence(std::uint16_t group, std::uint16_t number,
                           const std::vector<std::string>& items) {
  std::string all;
  for (const std::string& item : items) {
    all += dicom_number(0xFFFE, 2) + dicom_number(0xE000, 2) +
           dicom_number(static_cast<std::uint32_t>(item.size()), 4) + item;
  }
  return dicom_element(group, number, "SQ", all);
}

std::string dicom_head(const std::string& sop_class, const std::string& transfer_syntax) {
  const std::string meta = dicom_element(2, 0x0001, "OB", std::string("\0\1", 2)) +
                           dicom_element(2, 0x0002, "UI", sop_class) +
                           dicom_element(2, 0x0010, "UI", transfer_syntax);
  return std::string(128, '\0') + "DICM" +
         dicom_element(2, 0, "UL", dicom_number(static_cast<std::uint32_t>(meta.size()), 4)) + meta;
}

namespace {

const auto element = dicom_element;
const auto little_endian = dicom_number;

std::string optional_element(std::uint16_t group, std::uint16_t number, const std::string& vr,
                             const std::string& value) {
  return value.empty() ? std::string() : element(group, number, vr, value);
}

}  // namespace

void DicomBytes::set_position(const Eigen::Vector3d& position_mm) {
  position = to_text(position_mm.x(), 6) + "\\" + to_text(position_mm.y(), 6) + "\\" +
             to_text(position_mm.z(), 6);
}

std::string DicomBytes::bytes() const {
  const std::string ct_image_storage = "1.2.840.10008.5.1.4.1.1.2";
  std::string raw;
  for (const std::uint16_t pixel : pixels) raw += little_endian(pixel, 2);
  return dicom_head(ct_image_storage, transfer_syntax) +
         optional_element(8, 0x0008, "CS", image_type) +
         element(8, 0x0016, "UI", ct_image_storage) + element(8, 0x0060, "CS", modality) +
         optional_element(0x18, 0x1210, "SH", kernel) + element(0x20, 0x000E, "UI", series_uid) +
         element(0x20, 0x0011, "IS", series_number) +
         optional_element(0x20, 0x0012, "IS", acquisition) +
         optional_element(0x20, 0x0032, "DS", position) +
         optional_element(0x20, 0x0037, "DS", orientation) +
         optional_element(0x20, 0x0052, "UI", frame_of_reference) +
         optional_element(0x20, 0x0100, "IS", temporal_position) +
         element(0x28, 0x0002, "US", little_endian(1, 2)) +
         element(0x28, 0x0004, "CS", photometric) +
         element(0x28, 0x0010, "US", little_endian(rows, 2)) +
         element(0x28, 0x0011, "US", little_endian(columns, 2)) +
         optional_element(0x28, 0x0030, "DS", pixel_spacing) +
         element(0x28, 0x0100, "US", little_endian(16, 2)) +
         element(0x28, 0x0101, "US", little_endian(16, 2)) +
         element(0x28, 0x0102, "US", little_endian(15, 2)) +
         element(0x28, 0x0103, "US", little_endian(is_signed ? 1 : 0, 2)) +
         (padding < 0 ? ""
                      : element(0x28, 0x0120, "US", little_endian(std::uint32_t(padding), 2))) +
         optional_element(0x28, 0x1052, "DS", intercept) +
         optional_element(0x28, 0x1053, "DS", slope) + element(0x7FE0, 0x0010, "OW", raw);
}

std::string enhanced_ct(const std::vector<DicomBytes>& slices) {
  const DicomBytes& first = slices.front();
  const std::string enhanced_ct_storage = "1.2.840.10008.5.1.4.1.1.2.1";
  std::vector<std::string> frames;
  std::string raw;
  for (const DicomBytes& slice : slices) {
    const std::string time = optional_element(
        0x20, 0x9128, "UL",
        slice.temporal_position.empty()
            ? ""
            : little_endian(static_cast<std::uint32_t>(std::stoi(slice.temporal_position)), 4));
    frames.push_back((time.empty() ? "" : dicom_sequence(0x20, 0x9111, {time})) +
                     dicom_sequence(0x20, 0x9113, {element(0x20, 0x0032, "DS", slice.position)}) +
                     dicom_sequence(0x28, 0x9145,
                                    {element(0x28, 0x1052, "DS", slice.intercept) +
                                     element(0x28, 0x1053, "DS", slice.slope)}));
    for (const std::uint16_t pixel : slice.pixels) raw += little_endian(pixel, 2);
  }
  const std::string shared =
      dicom_sequence(0x20, 0x9116, {element(0x20, 0x0037, "DS", first.orientation)}) +
      dicom_sequence(0x28, 0x9110, {element(0x28, 0x0030, "DS", first.pixel_spacing)});
  return dicom_head(enhanced_ct_storage) + element(8, 0x0016, "UI", enhanced_ct_storage) +
         element(8, 0x0060, "CS", first.modality) + element(0x20, 0x000E, "UI", first.series_uid) +
         element(0x20, 0x0011, "IS", first.series_number) +
         element(0x28, 0x0002, "US", little_endian(1, 2)) +
         element(0x28, 0x0004, "CS", first.photometric) +
         element(0x28, 0x0008, "IS", std::to_string(slices.size())) +
         element(0x28, 0x0010, "US", little_endian(first.rows, 2)) +
         element(0x28, 0x0011, "US", little_endian(first.columns, 2)) +
         element(0x28, 0x0100, "US", little_endian(16, 2)) +
         element(0x28, 0x0101, "US", little_endian(16, 2)) +
         element(0x28, 0x0102, "US", little_endian(15, 2)) +
         element(0x28, 0x0103, "US", little_endian(0, 2)) +
         dicom_sequence(0x5200, 0x9229, {shared}) + dicom_sequence(0x5200, 0x9230, frames) +
         element(0x7FE0, 0x0010, "OW", raw);
}

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
    const Eigen::Vector3d corner = frame.corner.value_or(Eigen::Vector3d(10, -20, frame.z));
    const std::string position =
        to_text(corner.x()) + "\\" + to_text(corner.y()) + "\\" + to_text(corner.z());
    std::string group;
    if (!frame.phase.empty()) {
      const auto phase = static_cast<std::uint32_t>(std::stoi(frame.phase));
      group +=
          dicom_sequence(0x20, 0x9111, {dicom_element(0x20, 0x9128, "UL", dicom_number(phase, 4))});
    }
    group += dicom_sequence(0x20, 0x9113, {dicom_element(0x20, 0x0032, "DS", position)});
    if (!frame.orientation.empty())
      group += dicom_sequence(0x20, 0x9116, {dicom_element(0x20, 0x0037, "DS", frame.orientation)});
    if (!frame.pixel_spacing.empty())
      group +=
          dicom_sequence(0x28, 0x9110, {dicom_element(0x28, 0x0030, "DS", frame.pixel_spacing)});
    groups.push_back(
        group +
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
      dicom_sequence(0x20, 0x9116, {dicom_element(0x20, 0x0037, "DS", orientation)}) +
      dicom_sequence(0x28, 0x9110,
                     {optional_element(0x18, 0x0050, "DS", thickness) +
                      optional_element(0x18, 0x0088, "DS", gap) +
                      dicom_element(0x28, 0x0030, "DS", pixel_spacing)});
  return dicom_head(kSegmentation, rle ? kRle : "1.2.840.10008.1.2.1") +
         dicom_element(8, 0x0016, "UI", kSegmentation) + dicom_element(8, 0x0060, "CS", "SEG") +
         optional_element(0x20, 0x0052, "UI", frame_of_reference) +
         dicom_element(0x28, 0x0008, "IS", std::to_string(frames.size())) +
         dicom_element(0x28, 0x0010, "US", us(rows)) +
         dicom_element(0x28, 0x0011, "US", us(columns)) +
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
                    optional_element(0x3006, 0x0024, "UI", regions[i].frame_of_reference) +
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
                         optional_element(0x3006, 0x0044, "DS", regions[i].slab) +
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
