// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom_bytes.h"

#include "core/text.h"

namespace organbake {
namespace {

std::string little_endian(std::uint32_t value, int bytes) {
  std::string out;
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
  return out;
}

std::string element(std::uint16_t group, std::uint16_t number, const std::string& vr,
                    std::string value) {
  if (value.size() % 2) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
  const bool long_form = vr == "OB" || vr == "OW";
  const auto length = static_cast<std::uint32_t>(value.size());
  return little_endian(group, 2) + little_endian(number, 2) + vr +
         (long_form ? std::string(2, '\0') + little_endian(length, 4) : little_endian(length, 2)) +
         value;
}

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
  const std::string meta = element(2, 0x0001, "OB", std::string("\0\1", 2)) +
                           element(2, 0x0002, "UI", ct_image_storage) +
                           element(2, 0x0010, "UI", transfer_syntax);
  const std::string meta_length = little_endian(static_cast<std::uint32_t>(meta.size()), 4);
  std::string raw;
  for (const std::uint16_t pixel : pixels) raw += little_endian(pixel, 2);
  return std::string(128, '\0') + "DICM" + element(2, 0, "UL", meta_length) + meta +
         optional_element(8, 0x0008, "CS", image_type) +
         element(8, 0x0016, "UI", ct_image_storage) + element(8, 0x0060, "CS", modality) +
         element(0x20, 0x000E, "UI", series_uid) + element(0x20, 0x0011, "IS", series_number) +
         optional_element(0x20, 0x0012, "IS", acquisition) +
         optional_element(0x20, 0x0032, "DS", position) +
         optional_element(0x20, 0x0037, "DS", orientation) +
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

}  // namespace organbake
