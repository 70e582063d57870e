#include "mapper/loops/graph_log.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace seastitch {
namespace {

// Moves the first elements, at most `most`, out of a list.
template <class T>
std::vector<T> TakeFront(std::vector<T>* list, int most) {
  const auto count =
      static_cast<std::ptrdiff_t>(std::min(list->size(), static_cast<std::size_t>(most)));
  std::vector<T> front(std::make_move_iterator(list->begin()),
                       std::make_move_iterator(list->begin() + count));
  list->erase(list->begin(), list->begin() + count);
  return front;
}

}  // namespace

void GraphLog::SetId(std::int64_t graph_id) {
  if (!graph_id_) graph_id_ = graph_id;
}

void GraphLog::Append(std::vector<GraphVertex> vertices,
                      std::vector<GraphEdge> edges,
                      Time submap_time,
                      bool final) {
  SetId(ToUtime(submap_time));
  bool ends = final && !ended_;
  while (!vertices.empty() || !edges.empty() || ends) {
    GraphUpdate update;
    update.vertices = TakeFront(&vertices, kMaxVerticesPerUpdate);
    if (vertices.empty()) update.edges = TakeFront(&edges, kMaxEdgesPerUpdate);
    update.final = ends && vertices.empty() && edges.empty();
    if (update.final) {
      ends = false;
      ended_ = true;
    }
    AppendStep(std::move(update), submap_time);
  }
}

void GraphLog::AppendStep(GraphUpdate update, Time submap_time) {
  update.version = version() + 1;
  update.mounting = mounting_;
  update.graph_id = graph_id();
  update.resumed = std::exchange(resumed_, false);
  steps_.push_back({std::move(update), submap_time});
}

bool GraphLog::Restore(GraphStep step) {
  if (step.update.version != version() + 1) return false;
  graph_id_ = step.update.graph_id;
  steps_.push_back(std::move(step));
  return true;
}

void GraphLog::Resume() {
  resumed_ = true;
  ended_ = false;
}

const GraphStep* GraphLog::After(std::int64_t have_version) const {
  const std::int64_t have = std::max<std::int64_t>(0, have_version);
  return have < version() ? &steps_[static_cast<std::size_t>(have)] : nullptr;
}

}  // namespace seastitch
