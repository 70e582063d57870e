#include "logger/config_archive.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/files/whole_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFiles = 64;  // limit of files that wait
constexpr int kMaxVersions = 100;      // limit of versions per file

bool IsPlainName(const std::string& name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= 64 && name[0] != '.' &&
         std::all_of(name.begin(), name.end(), is_plain);
}

// Name of an older version: for mapper.yaml and 2, mapper.2.yaml.
fs::path VersionOf(const fs::path& path, int number) {
  fs::path version = path;
  return version.replace_extension("." + std::to_string(number) + path.extension().string());
}

}  // namespace

ConfigArchive::ConfigArchive(fs::path folder) : folder_(std::move(folder)) {}

void ConfigArchive::Add(const LogEvent& event) {
  config_t msg{};
  const int size = static_cast<int>(event.data.size());
  if (msg.decode(event.data.data(), 0, size) != size) return;
  const std::lock_guard lock(mutex_);
  const auto file = assembler_.Add(msg);
  if (!file || !IsPlainName(file->name)) return;
  if (unsaved_.size() < kMaxFiles || unsaved_.contains(file->name))
    unsaved_.insert_or_assign(file->name, file->text);
}

void ConfigArchive::Save() {
  std::unique_lock lock(mutex_);
  std::map<std::string, std::string> files = std::exchange(unsaved_, {});
  lock.unlock();
  try {
    for (auto file = files.begin(); file != files.end(); file = files.erase(file))
      Save(file->first, file->second);
  } catch (const std::exception&) {
    lock.lock();
    unsaved_.merge(files);  // merge() keeps newer versions that came meanwhile
    ++errors_;
  }
}

std::int64_t ConfigArchive::errors() const {
  const std::lock_guard lock(mutex_);
  return errors_;
}

void ConfigArchive::Save(const std::string& name, const std::string& text) const {
  const fs::path path = folder_ / name;
  if (fs::exists(path)) {
    if (ReadWholeFile(path) == text) return;
    int number = 1;
    while (number < kMaxVersions && fs::exists(VersionOf(path, number))) ++number;
    // Copied, not renamed, so that the file exists at any moment.
    fs::copy_file(path, VersionOf(path, number), fs::copy_options::overwrite_existing);
  }
  WriteDurably(path, text);
}

}  // namespace seastitch
