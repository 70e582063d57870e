#pragma once

#include <array>
#include <filesystem>

namespace seastitch {

// Output folder of a command. Files are written to a temporary folder first: OUT.partial, which
// Publish() renames to OUT; or, if OUT exists, OUT/.partial, whose files and folders Publish()
// moves to OUT, replacing those of the same name, report.json last; products of an earlier command
// that this one did not make are removed. A command that fails leaves OUT unchanged.
class OutputFolder {
 public:
  // Folders of products; Publish() replaces each as a whole.
  static constexpr std::array<const char*, 3> kFolders{"config", "export", "submaps"};
  // All other products of a replay, but for report.json.
  static constexpr std::array<const char*, 14> kFiles{"consistency.png",
                                                      "consistency.tif",
                                                      "consistency_dead_reckoned.png",
                                                      "consistency_dead_reckoned.tif",
                                                      "depth.png",
                                                      "depth.tif",
                                                      "depth_dead_reckoned.png",
                                                      "depth_dead_reckoned.tif",
                                                      "graph.g2o",
                                                      "poses.txt",
                                                      "report.html",
                                                      "survey.bin",
                                                      "survey.gpkg",
                                                      "track.csv"};

  // Creates the temporary folder and the folders above it, and removes what a killed command left
  // there. Throws std::runtime_error "FOLDER: reason" if another command writes to the same OUT, or
  // if OUT has one of kFolders but no report.json: then the folder is not from an earlier output.
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
