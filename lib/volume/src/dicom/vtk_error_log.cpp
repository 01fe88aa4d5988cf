// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/vtk_error_log.h"
#include "organbake/core/text.h"

#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkExecutive.h>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// "ERROR: In ./X.cxx, line 12\nvtkX (0x55…): words\n\n" → "words". vtk-dicom nests such texts, so
// the last address in the text is the one to cut at.
std::string own_words(const char* text) {
  std::string words = text ? text : "";
  const std::size_t address = words.rfind("): ");
  if (address != std::string::npos && words.find("(0x") < address) words.erase(0, address + 3);
  for (char& c : words) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  words = trimmed(words, " ");
  return words.empty() ? "VTK could not read it" : words;
}

}  // namespace

VtkErrorLog::VtkErrorLog() : observer_(vtkCallbackCommand::New()) {
  observer_->SetClientData(this);
  observer_->SetCallback(&VtkErrorLog::remember);
}

VtkErrorLog::~VtkErrorLog() {
  // Watched objects may outlive the log; they keep the command, which must then do nothing.
  observer_->SetCallback(nullptr);
  observer_->Delete();
}

vtkCommand* VtkErrorLog::observer() const { return observer_; }

void VtkErrorLog::watch(vtkAlgorithm* algorithm) {
  watch_object(algorithm);
  watch_object(algorithm->GetExecutive());
}

void VtkErrorLog::watch_object(vtkObject* object) {
  object->AddObserver(vtkCommand::ErrorEvent, observer_);
  object->AddObserver(vtkCommand::WarningEvent, observer_);
}

void VtkErrorLog::remember(vtkObject*, unsigned long event, void* log, void* text) {
  auto* self = static_cast<VtkErrorLog*>(log);
  if (event == vtkCommand::ErrorEvent && self->first_.empty()) {
    self->first_ = own_words(static_cast<const char*>(text));
  }
}

void VtkErrorLog::throw_if_any(const std::filesystem::path& file) const {
  if (!empty()) throw BadDataError(file, first_);
}

}  // namespace organbake
