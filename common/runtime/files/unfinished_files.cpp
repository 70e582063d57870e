#include "common/runtime/files/unfinished_files.hpp"

#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <string>

namespace seastitch {
namespace {

// A handler of a signal takes no argument and must not allocate: it reads these.
std::vector<std::string> names;
volatile std::sig_atomic_t active = 0;

void DeleteAll() {
  for (const std::string& name : names) ::unlink(name.c_str());
}

void OnSignal(int signal) {
  if (active != 0) DeleteAll();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

UnfinishedFiles::UnfinishedFiles(const std::vector<std::filesystem::path>& files) {
  if (active != 0) throw std::logic_error("two objects of UnfinishedFiles at a time");
  names.clear();
  for (const std::filesystem::path& file : files)
    if (!file.empty() && !std::filesystem::exists(file)) names.push_back(file.string());
  active = 1;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
}

UnfinishedFiles::~UnfinishedFiles() {
  if (active == 0) return;
  DeleteAll();
  Keep();
}

void UnfinishedFiles::Keep() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  active = 0;
}

}  // namespace seastitch
