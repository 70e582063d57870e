#include "products/track/dives.hpp"

#include <algorithm>
#include <utility>

#include "products/counted.hpp"

namespace seastitch {
namespace {

// Lets what closures join have the lowest place of all that they join.
void Group(std::vector<DiveInMap>* dives) {
  for (std::size_t i = 0; i < dives->size(); ++i) (*dives)[i].group = i;
  for (std::size_t round = 0; round < dives->size(); ++round)
    for (DiveInMap& dive : *dives)
      for (const auto& [other, closures] : dive.closures)
        dive.group = std::min(dive.group, (*dives)[other].group);
}

}  // namespace

std::vector<DiveInMap> DivesInMap(const Survey& survey) {
  std::vector<DiveInMap> dives;
  for (const std::string& name : survey.dives) dives.push_back({name, 0, {}, 0});
  std::map<SubmapId, std::size_t> dive_of;
  for (const SurveySubmap& submap : survey.submaps) {
    const auto chain = static_cast<std::size_t>(submap.chain);
    if (chain >= dives.size()) continue;
    dives[chain].submaps += HasSoundings(submap.trigger) ? 1 : 0;
    dive_of[submap.id] = chain;
  }
  for (const LoopRow& row : LoopRows(survey)) {
    const auto a = dive_of.find(row.edge->from), b = dive_of.find(row.edge->to);
    if (a == dive_of.end() || b == dive_of.end() || a->second == b->second) continue;
    if (!(row.weight >= kAcceptedWeight)) continue;
    ++dives[a->second].closures[b->second];
    ++dives[b->second].closures[a->second];
  }
  Group(&dives);
  return dives;
}

std::vector<std::string> SentencesOf(const std::vector<DiveInMap>& dives) {
  std::vector<std::string> sentences;
  if (dives.size() < 2) return sentences;
  for (std::size_t i = 0; i < dives.size(); ++i) {
    const DiveInMap& dive = dives[i];
    std::string sentence = dive.name + " (" + Counted(dive.submaps, "submap") + ")";
    if (dive.submaps == 0) {
      sentences.push_back(sentence + " is not in the map.");
      continue;
    }
    if (dive.closures.empty()) {
      sentences.push_back(sentence +
                          " stands apart: no loop closure joins it to another, and it lies where "
                          "its own navigation puts it.");
      continue;
    }
    sentence += " is joined to ";
    std::size_t left = dive.closures.size();
    for (const auto& [other, closures] : dive.closures) {
      sentence += dives[other].name + " by " +
                  Counted(static_cast<std::uint64_t>(closures), "loop closure");
      --left;
      sentence += left == 0 ? "." : left == 1 ? " and to " : ", to ";
    }
    sentences.push_back(std::move(sentence));
  }
  return sentences;
}

}  // namespace seastitch
