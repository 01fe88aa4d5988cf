// SPDX-License-Identifier: GPL-3.0-or-later
#include "cameras/foreign_calibration.h"

#include <charconv>
#include <sstream>

#include "cameras/opencv_xml.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInPython =
    "; write its matrices as OpenCV does: fs = cv2.FileStorage('lens.yml', "
    "cv2.FILE_STORAGE_WRITE), fs.write('camera_matrix', K), fs.write('distortion_coefficients', D)";
constexpr const char* kInMatlab =
    "; write its parameters as JSON: writelines(jsonencode(toStruct(params)), 'lens.json')";

void add_value(const std::string& key, const std::string& value, NamedMatrices& section) {
  const std::string name = plain_name(key);
  section.words[name] = value;
  double number = 0;
  const char* const end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error == std::errc() && stop == end) section.numbers[name] = number;
}

}  // namespace

void refuse_foreign_calibration(const std::string& bytes, const fs::path& path) {
  const auto begins = [&](const char* with) { return bytes.starts_with(with); };
  if (begins("PK\x03\x04"))
    throw BadDataError(path,
                       std::string("is a NumPy archive (.npz) or another ZIP file") + kInPython);
  if (begins("\x93NUMPY"))
    throw BadDataError(path, std::string("is a NumPy array (.npy)") + kInPython);
  if (begins("\x80")) throw BadDataError(path, std::string("is a Python pickle") + kInPython);
  if (begins("MATLAB ") || begins("\x89HDF"))
    throw BadDataError(path, std::string("is a MATLAB file (.mat)") + kInMatlab);
  if (bytes.find("ocam_model") != bytes.npos ||
      bytes.find("polynomial coefficients for the DIRECT mapping") != bytes.npos)
    throw BadDataError(path,
                       "is of OCamCalib, whose polynomial of a lens is not read; calibrate it as "
                       "OpenCV's fisheye (k1 k2 k3 k4)");
  if (bytes.find('\0') != bytes.npos)
    throw BadDataError(path, "is no text; a calibration is YAML, JSON, XML or an .ini");
}

void add_ini(const std::string& text, const fs::path& path, NamedMatrices& found) {
  std::istringstream lines(text);
  NamedMatrices* section = &found;
  for (std::string line; std::getline(lines, line);) {
    line = trimmed(line);
    if (line.empty() || line.front() == ';' || line.front() == '#') continue;
    const std::size_t equals = line.find('=');
    if (line.front() == '[' && line.back() == ']') {
      section = &found.parts[plain_name(line.substr(1, line.size() - 2))];
    } else if (equals != line.npos) {
      add_value(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)), *section);
    } else {
      throw BadDataError(path, "its line '" + line.substr(0, 40) +
                                   "' is neither a [section] nor of the form key = value");
    }
  }
}

}  // namespace organbake
