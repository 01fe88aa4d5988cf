// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/dicom_bytes.h"

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

}  // namespace organbake
