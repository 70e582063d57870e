#include "survey/replay/output_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "products/product_files.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Written last: if it exists, the products are complete.
constexpr const char* kLast = product_files::kReport;

std::runtime_error FolderError(const fs::path& folder, const std::string& reason) {
  return std::runtime_error(folder.string() + ": " + reason);
}

void MoveTo(const fs::path& place, const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file)) fs::remove_all(place, error);  // rename() replaces empty folders only
  if (!error) fs::rename(file, place, error);
  if (error) throw FolderError(place, error.message());
}

std::vector<fs::path> EntriesOf(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder)) entries.push_back(entry.path());
  return entries;
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& out)
    : out_((fs::weakly_canonical(fs::absolute(out)) / "").parent_path()),
      exists_(fs::exists(out_)),
      partial_(exists_ ? out_ / ".partial" : fs::path(out_.string() + ".partial")) {
  if (exists_ && !fs::is_directory(out_)) throw FolderError(out_, "is not a folder");
  if (exists_ && !fs::exists(out_ / kLast))
    for (const fs::path& entry : EntriesOf(out_))
      if (entry != partial_)
        throw FolderError(out_,
                          "holds " + entry.filename().string() +
                              " and no map of a replay: choose an empty or new folder");
  if (!fs::is_directory(out_.parent_path()))
    throw FolderError(out_, "there is no folder " + out_.parent_path().string());
  std::error_code error;
  fs::create_directory(partial_, error);
  if (error) throw FolderError(partial_, error.message());
  lock_ = ::open(partial_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) throw FolderError(partial_, std::strerror(errno));
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock_);
    throw FolderError(out_, "another command is writing there");
  }
  for (const fs::path& old : EntriesOf(partial_))
    if (fs::remove_all(old, error); error) {
      ::close(lock_);
      throw FolderError(old, error.message());
    }
}

OutputFolder::~OutputFolder() {
  Discard();
  ::close(lock_);
}

void OutputFolder::Publish() {
  std::error_code error;
  if (!exists_) {
    fs::rename(partial_, out_, error);
    if (error) throw FolderError(out_, error.message());
    return;
  }
  if (fs::remove(out_ / kLast, error)) RemoveOldProducts();
  for (const fs::path& file : EntriesOf(partial_))
    if (file.filename() != kLast) MoveTo(out_ / file.filename(), file);
  if (fs::exists(partial_ / kLast)) MoveTo(out_ / kLast, partial_ / kLast);
}

// Those that were not made this time, in a folder of an earlier command.
void OutputFolder::RemoveOldProducts() const {
  std::vector<std::string_view> products(product_files::kFolders.begin(),
                                         product_files::kFolders.end());
  products.insert(products.end(), product_files::kAll.begin(), product_files::kAll.end());
  for (const std::string_view product : products) {
    if (fs::exists(partial_ / product)) continue;
    std::error_code error;
    fs::remove_all(out_ / product, error);
    if (error) throw FolderError(out_ / product, error.message());
  }
}

void OutputFolder::Discard() const {
  std::error_code ignored;
  // Repeated, because an interrupted command may still be writing.
  for (int i = 0; i < 3 && fs::exists(partial_, ignored); ++i) fs::remove_all(partial_, ignored);
}

}  // namespace seastitch
