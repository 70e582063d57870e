#pragma once

#include <filesystem>

namespace seastitch {

// Output folder of a command. Files are written to a temporary folder first: OUT.partial, which
// Publish() renames to OUT; or, if OUT exists, OUT/.partial, whose files and folders Publish()
// moves to OUT, replacing those of the same name, report.json last; products of an earlier command
// that this one did not make are removed. A command that fails leaves OUT unchanged.
class OutputFolder {
 public:
  // Creates the temporary folder, and removes what a killed command left there. Throws
  // std::runtime_error "FOLDER: reason" if another command writes to the same OUT, if the folder
  // above OUT does not exist, or if OUT is not empty and has no report.json: then it is not from an
  // earlier output.
  explicit OutputFolder(const std::filesystem::path& out);
  ~OutputFolder();  // Discard()
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // The temporary folder, to write to.
  const std::filesystem::path& path() const { return partial_; }
  // Throws std::runtime_error "FOLDER: reason".
  void Publish();
  // Removes the temporary folder; without effect after Publish().
  void Discard() const;

 private:
  void RemoveOldProducts() const;

  const std::filesystem::path out_;
  const bool exists_;
  const std::filesystem::path partial_;
  int lock_ = -1;
};

}  // namespace seastitch
