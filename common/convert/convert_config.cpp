#include <algorithm>
#include <string_view>
#include <utility>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"
#include "common/core/utf8.hpp"

namespace seastitch {
namespace {

constexpr auto kPart = static_cast<std::size_t>(kMaxConfigBytesPerPart);
constexpr std::size_t kMaxProcesses = 64;  // limit of the files assembled at a time
constexpr std::size_t kMaxFileName = 256;
constexpr std::size_t kMaxFileBytes = 10'000'000;

bool IsConfig(const config_t& msg) {
  return IsTime(FromUtime(msg.utime)) && !msg.process.empty() &&
         msg.process.size() <= kMaxProcessName && msg.version.size() <= kMaxProcessName &&
         !msg.name.empty() && msg.name.size() <= kMaxFileName &&
         convert::ArePlausibleParts(msg.part, msg.num_parts) && msg.text.size() <= kPart;
}

}  // namespace

std::vector<config_t> ToLcm(const ConfigText& file, Time sent, std::int64_t first_seq) {
  std::vector<std::string_view> texts;
  std::string_view rest = file.text;
  do {
    texts.push_back(rest.substr(0, WholeCharacters(rest, kPart)));
    rest.remove_prefix(texts.back().size());
  } while (!rest.empty());
  std::vector<config_t> parts;
  for (std::size_t part = 0; part < texts.size(); ++part) {
    config_t& msg = parts.emplace_back(config_t{});
    msg.utime = ToUtime(sent);
    msg.seq = first_seq + static_cast<std::int64_t>(part);
    msg.process = file.process.substr(0, kMaxProcessName);
    msg.version = file.version.substr(0, kMaxProcessName);
    msg.name = file.name.substr(0, kMaxFileName);
    msg.part = static_cast<std::int32_t>(part);
    msg.num_parts = static_cast<std::int32_t>(texts.size());
    msg.text = texts[part];
  }
  return parts;
}

std::vector<config_t> ConfigParts(const std::string& process, const std::vector<NamedText>& files) {
  std::vector<config_t> all;
  for (const auto& [name, text] : files) {
    const std::vector<config_t> parts = ToLcm({process, {}, name, text}, Time{}, 0);
    all.insert(all.end(), parts.begin(), parts.end());
  }
  return all;
}

std::optional<ConfigText> ConfigAssembler::Add(const config_t& msg) {
  if (!IsConfig(msg) || (!open_.contains(msg.process) && open_.size() >= kMaxProcesses)) {
    ++malformed_;
    return std::nullopt;
  }
  if (msg.part == 0) {
    if (open_.contains(msg.process)) ++malformed_;  // the last part of the previous file was lost
    open_[msg.process] =
        Open{{msg.process, msg.version, msg.name, {}}, msg.utime, msg.num_parts, 0};
  }
  const auto open = open_.find(msg.process);
  const bool continues = open != open_.end() && msg.part == open->second.next_part &&
                         msg.num_parts == open->second.num_parts &&
                         msg.utime == open->second.utime && msg.name == open->second.file.name &&
                         msg.version == open->second.file.version &&
                         open->second.file.text.size() + msg.text.size() <= kMaxFileBytes;
  if (!continues) {
    ++malformed_;
    if (open != open_.end()) open_.erase(open);
    return std::nullopt;
  }
  open->second.file.text += msg.text;
  if (++open->second.next_part < msg.num_parts) return std::nullopt;
  ConfigText whole = std::move(open->second.file);
  open_.erase(open);
  return whole;
}

}  // namespace seastitch
