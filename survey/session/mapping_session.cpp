#include "survey/session/mapping_session.hpp"

#include <memory>
#include <string>
#include <utility>

#include "common/core/checked.hpp"

namespace seastitch {

MappingSession::MappingSession(const MapperConfig& mapper,
                               const OptimizerParams& optimizer,
                               SurveyCollector* collector,
                               std::function<bool()> stopped,
                               std::function<void(const MapperEvent&)> on_event)
    : collector_(collector),
      stopped_(std::move(stopped)),
      on_event_(std::move(on_event)),
      mapper_(mapper, [this](const MapperEvent& event) { On(event); }),
      optimizer_(optimizer) {}

void MappingSession::Add(const Received& received) {
  mapper_.Add(received);
  Exchange();
}

void MappingSession::AddSubmap(Submap submap, std::optional<Mapper::OfDive> of_dive) {
  mapper_.AddSubmap(std::move(submap), std::move(of_dive));
  Settle();
}

void MappingSession::Finish() {
  mapper_.Finish();
  Settle();
}

void MappingSession::On(const MapperEvent& event) {
  on_event_(event);
  std::visit(Overloaded{[this](const NavState& nav) { Collect(nav); },
                        [this](const CorrectedNavState& corrected) { Collect(corrected); },
                        [this](const std::shared_ptr<const Submap>& submap) {
                          Collect(*submap);
                          // The mapper chooses the pairs of this submap by the newest solution.
                          if (solving_.IsRunning()) TakeSolution();
                        },
                        [this](const GraphStep& step) { Queue(Usable(step.update)); },
                        [this](const CovarianceQuestion& question) { Queue(question.request); },
                        [](const JournalEntry&) {}},
             event);
}

template <class Result>
void MappingSession::Collect(const Result& result) {
  if (const auto checked = Checked(Quantised(result)))
    collector_->Add(*checked);
  else
    ++refused_["results_malformed"];
}

template <class Result>
void MappingSession::Queue(const Result& result) {
  if (auto checked = Checked(result))
    queue_.emplace_back(*std::move(checked));
  else
    ++refused_["results_malformed"];
}

GraphUpdate MappingSession::Usable(GraphUpdate update) {
  if (Checked(update)) return update;
  ++refused_["updates_malformed"];
  if (auto usable = WithoutMalformedEdges(update)) return *std::move(usable);
  ++submaps_lost_;
  update.vertices.clear();
  update.edges.clear();
  update.mounting = {};
  return update;
}

void MappingSession::Exchange() {
  while (true) {
    if (solving_.IsRunning()) {
      // What is exchanged waits, because all of it needs the optimizer.
      if (!solving_.IsDue(mapper_.mapper().last_nav())) return;
      TakeSolution();
    }
    if (queue_.empty()) return;
    const Exchanged next = std::move(queue_.front());
    queue_.pop_front();
    std::visit([this](const auto& what) { Deliver(what); }, next);
  }
}

void MappingSession::Settle() {
  do {
    Exchange();
    while (solving_.IsRunning()) {
      TakeSolution();
      Exchange();
    }
  } while (!stopped_() && mapper_.LookAgain());
}

void MappingSession::Deliver(const GraphUpdate& update) {
  collector_->Add(update);
  if (!optimizer_.Add(update) || !optimizer_.IsDue()) return;
  const SolveStart start =
      update.final || update.resumed ? SolveStart::kFromDeadReckoning : SolveStart::kWarm;
  solving_.Start(mapper_.mapper().last_nav(), [this, start, graph_id = update.graph_id] {
    std::optional<PoseGraph> solution = optimizer_.Solve(start);
    if (solution) solution->graph_id = graph_id;
    return solution;
  });
}

void MappingSession::TakeSolution() {
  std::optional<PoseGraph> solution = solving_.Take();
  solve_failed_ = !solution;
  if (!solution) return;  // the last one stays in use
  solution_ = *std::move(solution);
  if (const auto checked = Checked(solution_))
    Deliver(*checked);
  else
    ++refused_["results_malformed"];
}

void MappingSession::Deliver(const PoseGraph& solution) {
  mapper_.mapper().Take(solution);
  collector_->Add(solution);
}

// A solution since the request gives no answer: it would be out of date.
void MappingSession::Deliver(const CovarianceRequest& request) {
  if (request.graph_version != solution_.graph_version || request.graph_id != solution_.graph_id)
    return;
  Queue(PairCovariances{request.sender,
                        request.seq,
                        request.graph_version,
                        optimizer_.RelativeCovariances(request.pairs),
                        request.graph_id});
}

std::vector<Condition> MappingSession::optimizer_faults() const {
  std::vector<Condition> faults;
  if (submaps_lost_ > 0)
    faults.push_back({&conditions::kSubmapMalformed, std::to_string(submaps_lost_) + " so far"});
  if (solve_failed_) faults.push_back({&conditions::kNoSolution, ""});
  if (!optimizer_.converged()) faults.push_back({&conditions::kSolutionNotConverged, ""});
  if (optimizer_.lacks_covariance()) faults.push_back({&conditions::kNoCovariance, ""});
  return faults;
}

void MappingSession::Deliver(const PairCovariances& answer) { mapper_.mapper().Take(answer); }

}  // namespace seastitch
