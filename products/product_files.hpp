#pragma once

#include <array>
#include <string_view>

// Names of the files of a replay, in its folder (docs/files.md).
namespace seastitch::product_files {

inline constexpr char kElevation[] = "elevation.tif";
inline constexpr char kElevationAsNavigated[] = "elevation_as_navigated.tif";
inline constexpr char kSpread[] = "spread.tif";
inline constexpr char kDensity[] = "density.tif";
inline constexpr char kShoalest[] = "shoalest.tif";
inline constexpr char kUncertainty[] = "uncertainty.tif";
inline constexpr char kMismatch[] = "mismatch.tif";
inline constexpr char kMismatchAsNavigated[] = "mismatch_as_navigated.tif";
inline constexpr char kBag[] = "survey.bag";
inline constexpr char kQgisProject[] = "survey.qgs";
inline constexpr char kGeoPackage[] = "survey.gpkg";
inline constexpr char kDepthPicture[] = "depth.png";
inline constexpr char kDepthPictureAsNavigated[] = "depth_as_navigated.png";
inline constexpr char kMismatchPicture[] = "mismatch.png";
inline constexpr char kMismatchPictureAsNavigated[] = "mismatch_as_navigated.png";
inline constexpr char kTrack[] = "track.csv";
inline constexpr char kPoses[] = "poses.txt";
inline constexpr char kGraph[] = "graph.g2o";
inline constexpr char kReportPage[] = "report.html";
inline constexpr char kReport[] = "report.json";
inline constexpr char kFinishedMap[] = "survey.bin";

// Version of the list of files and of their contents, in report.json.
inline constexpr int kVersion = 2;

// All of them but for kReport, and then those of version 1, which a replay into the same folder
// removes.
inline constexpr auto kAll = std::to_array<std::string_view>({kElevation,
                                                              kElevationAsNavigated,
                                                              kSpread,
                                                              kDensity,
                                                              kShoalest,
                                                              kUncertainty,
                                                              kMismatch,
                                                              kMismatchAsNavigated,
                                                              kBag,
                                                              kQgisProject,
                                                              kGeoPackage,
                                                              kDepthPicture,
                                                              kDepthPictureAsNavigated,
                                                              kMismatchPicture,
                                                              kMismatchPictureAsNavigated,
                                                              kTrack,
                                                              kPoses,
                                                              kGraph,
                                                              kReportPage,
                                                              kFinishedMap,
                                                              "consistency.png",
                                                              "consistency.tif",
                                                              "consistency_dead_reckoned.png",
                                                              "consistency_dead_reckoned.tif",
                                                              "depth.tif",
                                                              "depth_dead_reckoned.png",
                                                              "depth_dead_reckoned.tif"});

// Folders of products.
inline constexpr char kConfigFolder[] = "config";
inline constexpr char kExportFolder[] = "export";
inline constexpr char kSubmapFolder[] = "submaps";
inline constexpr std::array<const char*, 3> kFolders{kConfigFolder, kExportFolder, kSubmapFolder};

}  // namespace seastitch::product_files
