// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

class vtkAlgorithm;
class vtkCallbackCommand;
class vtkCommand;
class vtkObject;

namespace organbake {

// VTK reports errors as events and prints them when nobody listens. This listens: what the watched
// objects say is kept, and the caller turns it into a BadDataError. (Parsers
// deep inside VTK can still write to VTK's process-wide log.)
class VtkErrorLog {
 public:
  VtkErrorLog();
  ~VtkErrorLog();
  VtkErrorLog(const VtkErrorLog&) = delete;
  VtkErrorLog& operator=(const VtkErrorLog&) = delete;

  // Watches the algorithm and its executive, which reports a failed request in its own name.
  void watch(vtkAlgorithm* algorithm);
  // Watches an object outside any pipeline.
  void watch_object(vtkObject* object);
  // For readers that take an observer for their inner parser (vtkXMLReader).
  vtkCommand* observer() const;

  bool empty() const { return first_.empty(); }
  // The first error's own words, without VTK's file, line and address; empty when there was none.
  const std::string& first() const { return first_; }
  // Throws BadDataError with the first error, if there was one.
  void throw_if_any(const std::filesystem::path& file) const;

 private:
  static void remember(vtkObject* caller, unsigned long event, void* log, void* text);

  vtkCallbackCommand* observer_;
  std::string first_;
};

}  // namespace organbake
